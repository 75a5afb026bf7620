#include "rig/capture/dose_book.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <fstream>
#include <nlohmann/json.hpp>

#include "acquisition/device/device_error.h"
#include "acquisition/device/unique_fd.h"
#include "acquisition/frame/error.h"
#include "acquisition/session/durable_file.h"
#include "acquisition/session/session.h"
#include "rig/capture/light_dose.h"

namespace darkbox {
namespace {

UniqueFd open_to_add(const std::filesystem::path& file) {
    UniqueFd fd(::open(file.c_str(), O_WRONLY | O_APPEND | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0644));
    if (!fd) throw_errno("open", file.string(), errno);
    return fd;
}

std::optional<std::pair<std::string, LightDose>> told_by(const std::string& line) {
    const auto json = nlohmann::json::parse(line, nullptr, false);
    if (!json.is_object()) return std::nullopt;
    LightDose dose;
    for (const auto& [key, part] : {std::pair{"lux_s", &LightDose::lux_s},
                                    {"uv_j_per_m2", &LightDose::uv_j_per_m2},
                                    {"ir_j_per_m2", &LightDose::ir_j_per_m2}}) {
        if (!json.contains(key) || !json[key].is_number() || !(json[key].get<double>() >= 0)) return std::nullopt;
        dose.*part = json[key].get<double>();
    }
    if (!json.contains("object") || !json["object"].is_string()) return std::nullopt;
    return std::pair{json["object"].get<std::string>(), dose};
}

}  // namespace

DoseBook::DoseBook(const std::filesystem::path& sessions_folder) : file_(sessions_folder / ".darkbox" / "dose.jsonl") {
    read();
}

void DoseBook::read() {
    std::ifstream in(file_, std::ios::binary);
    std::string line;
    for (std::size_t number = 1; std::getline(in, line); ++number) {
        torn_ = in.eof();
        const auto told = told_by(line);
        if (told)
            spent_[told->first] += told->second;
        else if (line.ends_with('}'))
            throw InputError(fmt::format("{}:{}: the line tells no dose of light", file_.string(), number),
                             "correct the line by hand, or remove it: what it held then counts as never spent");
    }
}

LightDose DoseBook::spent(const std::string& object) const {
    const auto found = spent_.find(object);
    return found == spent_.end() ? LightDose{} : found->second;
}

void DoseBook::add(const std::string& object, const std::string& session, const LightDose& dose) {
    const nlohmann::ordered_json json{{"time", iso8601_now()},
                                      {"object", object},
                                      {"session", session},
                                      {"lux_s", dose.lux_s},
                                      {"uv_j_per_m2", dose.uv_j_per_m2},
                                      {"ir_j_per_m2", dose.ir_j_per_m2}};
    std::string line = torn_ ? "\n" : "";
    line += json.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
    line += '\n';
    make_folder_durably(file_.parent_path());
    const UniqueFd fd = open_to_add(file_);
    write_all(fd.get(), bytes_of(line), file_);
    torn_ = false;
    spent_[object] += dose;
}

void DoseBook::flush() const {
    const UniqueFd fd = open_to_add(file_);
    if (::fsync(fd.get()) != 0) throw_errno("fsync", file_.string(), errno);
}

}  // namespace darkbox
