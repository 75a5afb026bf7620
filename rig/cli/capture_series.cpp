#include "rig/cli/capture_series.h"

#include <fmt/format.h>

#include <algorithm>

#include "acquisition/device/device_error.h"

namespace darkbox {
namespace {

namespace fs = std::filesystem;

/// What `step` throws, with the place in the series before its message.
template <class Step>
auto at_place(const std::string& place, Step step) {
    const auto text = [&place](const Error& error) { return fmt::format("{}: {}", place, error.what()); };
    try {
        return step();
    } catch (const Cancelled& error) {
        throw Cancelled(text(error), error.hint());
    } catch (const InputError& error) {
        throw InputError(text(error), error.hint());
    } catch (const DeviceError& error) {
        throw DeviceError(text(error), error.hint());
    }
}

}  // namespace

std::vector<fs::path> numbered_names(const fs::path& base, int count) {
    const std::size_t digits = std::max<std::size_t>(3, std::to_string(count).size());
    const fs::path plain = base.has_filename() ? base : base.parent_path();  // "vase/" is "vase"
    std::vector<fs::path> names;
    for (int i = 1; i <= count; ++i) names.emplace_back(fmt::format("{}-{:0{}}", plain.string(), i, digits));
    return names;
}

CommandResult capture_series(const CaptureSeries& series, const std::vector<fs::path>& names,
                             const CaptureInto& capture, const WorkContext& work) {
    CommandResult result;
    result.json["captures"] = Json::array();
    for (std::size_t i = 0; i < names.size(); ++i) {
        const std::string place = fmt::format("capture {} of {}", i + 1, names.size());
        const CommandResult one = at_place(place, [&] { return capture(names[i]); });
        result.json["captures"].push_back(one.json);
        result.text += one.text + "\n";
        for (const std::string& warning : one.warnings)
            result.warnings.push_back(fmt::format("{}: {}", names[i].filename().string(), warning));
        if (!series.between || i + 1 == names.size()) continue;
        work.tell({"between captures", i + 1, names.size(), series.between->words.front()});
        at_place("after " + place, [&] {
            run_hook(*series.between,
                     {{"DARKBOX_SESSION", one.json.at("session").get<std::string>()},
                      {"DARKBOX_NEXT", names[i + 1].string()},
                      {"DARKBOX_CAPTURED", std::to_string(i + 1)},
                      {"DARKBOX_REPEAT", std::to_string(names.size())},
                      {"DARKBOX_OBJECT", series.object}},
                     work.stop);
        });
    }
    result.text.pop_back();
    return result;
}

}  // namespace darkbox
