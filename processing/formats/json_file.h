#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>

#include "acquisition/frame/error.h"

namespace darkbox {

/// Throws InputError that names the file when it is missing or is not JSON.
nlohmann::json read_json(const std::filesystem::path& path);

/// Indented, with a final newline; atomic.
void write_json(const std::filesystem::path& path, const nlohmann::ordered_json& json);

/// Runs `body`; a key that is missing or of the wrong kind becomes an InputError: "FILE is not KIND: ...".
template <class Body>
decltype(auto) reading_keys(const std::filesystem::path& path, const char* kind, Body&& body) {
    try {
        return std::forward<Body>(body)();
    } catch (const nlohmann::json::exception& error) {
        throw InputError(path.string() + " is not " + kind + ": " + error.what(), "make it again");
    }
}

}  // namespace darkbox
