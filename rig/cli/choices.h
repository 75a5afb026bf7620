#pragma once

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <map>
#include <string>

namespace darkbox {

/// For an option that takes one of a few words, each standing for a value of an enumeration. Another word is refused
/// by naming those that are allowed.
template <class Enum>
CLI::Validator one_of(const std::map<std::string, Enum>& words) {
    std::string allowed;
    for (const auto& [word, value] : words) allowed += (allowed.empty() ? "" : ", ") + word;
    const auto take = [words, allowed](std::string& text) -> std::string {
        const auto found = words.find(text);
        if (found == words.end()) return fmt::format("'{}' is none of: {}", text, allowed);
        text = std::to_string(static_cast<int>(found->second));
        return {};
    };
    return {take, "{" + allowed + "}", "one_of"};
}

}  // namespace darkbox
