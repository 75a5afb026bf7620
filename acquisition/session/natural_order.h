#pragma once

#include <string_view>

namespace darkbox {

/// The order in which people count: "cat.2.png" before "cat.10.png". Runs of digits compare by value, all else by byte;
/// names that differ only in leading zeros compare by byte, so that the order is total.
bool natural_less(std::string_view a, std::string_view b);

}  // namespace darkbox
