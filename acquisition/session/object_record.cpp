#include "acquisition/session/object_record.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "acquisition/frame/error.h"
#include "acquisition/session/record_checks.h"

namespace darkbox {
namespace {

constexpr std::size_t longest_value = 4000;     ///< bytes
constexpr std::size_t longest_inventory = 200;  ///< bytes
constexpr std::size_t most_values = 100;

bool holds_control(std::string_view text, bool lines) {
    return std::ranges::any_of(text, [lines](char c) {
        const auto byte = static_cast<unsigned char>(c);
        return (byte < 0x20 || byte == 0x7F) && !(lines && c == '\n');
    });
}

void require_text(const std::string& where, std::string_view name, const std::string& value, std::size_t longest,
                  bool lines) {
    if (value.size() > longest)
        throw InputError(fmt::format("{}: {} has {} bytes; allowed: up to {}", where, name, value.size(), longest),
                         "shorten it");
    if (!is_utf8(value))
        throw InputError(fmt::format("{}: {} is not UTF-8: {}", where, name, shown(value)), "write it in UTF-8");
    if (holds_control(value, lines))
        throw InputError(fmt::format("{}: {} holds a control character: {}", where, name, shown(value)),
                         lines ? "only line breaks (LF) may stand in it" : "write it on one line");
}

void require_element(const std::string& where, const std::string& element) {
    if (std::ranges::find(dublin_core_elements, element) == dublin_core_elements.end())
        throw InputError(fmt::format("{}: Dublin Core has no element {}", where, shown(element)),
                         fmt::format("choose one of: {}", fmt::join(dublin_core_elements, ", ")));
}

void require_value(const std::string& where, const std::string& element, const std::string& value) {
    if (value.find_first_not_of(" \t\n") == std::string::npos)
        throw InputError(fmt::format("{}: {} is empty", where, element), "give it a value, or leave it out");
    require_text(where, element, value, longest_value, true);
}

}  // namespace

void add_value(const std::string& where, ObjectRecord& record, const std::string& element, const std::string& value) {
    require_element(where, element);
    require_value(where, element, value);
    record.dublin_core[element].push_back(value);
}

void add_assignment(const std::string& where, ObjectRecord& record, const std::string& text) {
    const auto equals = text.find('=');
    if (equals == std::string::npos)
        throw InputError(fmt::format("{}: {} is not KEY=VALUE", where, shown(text)), "write title=\"A vase\"");
    add_value(where, record, text.substr(0, equals), text.substr(equals + 1));
}

void require_valid(const std::string& where, const ObjectRecord& record) {
    require_text(where, "inventory", record.inventory, longest_inventory, false);
    std::size_t count = 0;
    for (const auto& [element, values] : record.dublin_core) {
        require_element(where, element);
        if (values.empty()) require_value(where, element, "");
        for (const std::string& value : values) require_value(where, element, value);
        count += values.size();
    }
    if (count > most_values)
        throw InputError(fmt::format("{}: {} values of Dublin Core; allowed: up to {}", where, count, most_values),
                         "leave some out");
}

}  // namespace darkbox
