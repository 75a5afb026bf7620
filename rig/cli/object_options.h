#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "acquisition/session/object_record.h"

namespace darkbox {

/// What the command line says of an object beside its name.
struct ObjectOptions {
    std::string inventory;
    std::vector<std::string> meta;  ///< "title=A vase"

    bool empty() const { return inventory.empty() && meta.empty(); }
};

void add_object_options(CLI::App& command, ObjectOptions& options);

/// Throws InputError that names the option.
ObjectRecord object_record(const ObjectOptions& options);

}  // namespace darkbox
