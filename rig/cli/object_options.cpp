#include "rig/cli/object_options.h"

namespace darkbox {

void add_object_options(CLI::App& command, ObjectOptions& options) {
    command.add_option("--inventory", options.inventory, "The object's number in the collection");
    command
        .add_option("--meta", options.meta,
                    "KEY=VALUE, an element of Dublin Core: title, creator, date, description, rights, ...; once for "
                    "each value")
        ->take_all();
}

ObjectRecord object_record(const ObjectOptions& options) {
    ObjectRecord record;
    record.inventory = options.inventory;
    for (const std::string& text : options.meta) add_assignment("--meta", record, text);
    require_valid("the object", record);
    return record;
}

}  // namespace darkbox
