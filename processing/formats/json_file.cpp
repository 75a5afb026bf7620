#include "processing/formats/json_file.h"

#include "processing/formats/atomic_file.h"

namespace darkbox {

nlohmann::json read_json(const std::filesystem::path& path) {
    const std::string text = read_text(path);
    return reading_keys(path, "JSON", [&] { return nlohmann::json::parse(text); });
}

void write_json(const std::filesystem::path& path, const nlohmann::ordered_json& json) {
    write_file(path, json.dump(2) + "\n");
}

}  // namespace darkbox
