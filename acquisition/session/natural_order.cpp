#include "acquisition/session/natural_order.h"

#include <algorithm>
#include <compare>

namespace darkbox {
namespace {

bool is_digit(char c) { return c >= '0' && c <= '9'; }

/// Cuts the leading run of digits off `text`; it is returned without its leading zeros.
std::string_view take_number(std::string_view& text) {
    const auto end = std::find_if_not(text.begin(), text.end(), is_digit);
    std::string_view number = text.substr(0, static_cast<std::size_t>(end - text.begin()));
    text.remove_prefix(number.size());
    number.remove_prefix(std::min(number.find_first_not_of('0'), number.size()));
    return number;
}

/// Of any length: the one with more digits is the larger.
std::strong_ordering compare_numbers(std::string_view a, std::string_view b) {
    if (a.size() != b.size()) return a.size() <=> b.size();
    return a <=> b;
}

}  // namespace

bool natural_less(std::string_view a, std::string_view b) {
    std::string_view rest_a = a;
    std::string_view rest_b = b;
    while (!rest_a.empty() && !rest_b.empty()) {
        if (is_digit(rest_a.front()) && is_digit(rest_b.front())) {
            const auto order = compare_numbers(take_number(rest_a), take_number(rest_b));
            if (order != 0) return order < 0;
        } else {
            const auto byte_a = static_cast<unsigned char>(rest_a.front());
            const auto byte_b = static_cast<unsigned char>(rest_b.front());
            if (byte_a != byte_b) return byte_a < byte_b;
            rest_a.remove_prefix(1);
            rest_b.remove_prefix(1);
        }
    }
    if (rest_a.empty() != rest_b.empty()) return rest_a.empty();
    return a < b;
}

}  // namespace darkbox
