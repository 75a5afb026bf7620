#include "rig/cli/relight_options.h"

#include <fmt/format.h>

#include <filesystem>
#include <numbers>

#include "processing/pipeline/session_geometry.h"
#include "rig/cli/arguments.h"
#include "rig/cli/choices.h"

namespace darkbox {
namespace {

const std::map<std::string, ReflectanceModel> reflectance_models{{"lambert", ReflectanceModel::lambert},
                                                                 {"phong", ReflectanceModel::phong},
                                                                 {"phong-split", ReflectanceModel::phong_split}};
const std::map<std::string, Lookup> lookups{{"thesis", Lookup::thesis}, {"detail", Lookup::detail}};

}  // namespace

void add_relight_options(CLI::App& command, RelightArguments& a) {
    command.add_option("--light", a.lights, "Vector to a light, viewer frame: X,Y,Z or X,Y,Z:R,G,B; may be repeated")
        ->expected(1)
        ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
    command
        .add_option("--light-position", a.lamp_positions,
                    "Place of a near lamp, mm in the viewer frame: X,Y,Z or X,Y,Z:R,G,B as it arrives at the object; "
                    "may be repeated")
        ->expected(1)
        ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
    command.add_option("--environment", a.environments, "Light probe, equirectangular .hdr or .exr")
        ->expected(1)
        ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
    command.add_option("--yaw", a.yaw_deg, "Turns the environment about the upright axis, degrees")
        ->capture_default_str();
    command
        .add_option("--model", a.options.model,
                    "lambert; phong: one coefficient, highlights of the texel's colour; phong-split: a coat of gloss")
        ->transform(one_of(reflectance_models));
    command
        .add_option("--lookup", a.options.lookup, "thesis: the texel's radiance; detail: scaled by the pixel's albedo")
        ->transform(one_of(lookups));
    const std::map<std::string, OutOfRange> beyond{{"clamp", OutOfRange::clamp}, {"scale", OutOfRange::scale}};
    command
        .add_option("--out-of-range", a.options.out_of_range,
                    "Coefficients above 1 (k_d + k_s > 1): clamp to the brightest level, or scale it")
        ->transform(one_of(beyond));
    command.add_option("--diffuse", a.options.phong_diffuse, "Phong's k_d, 0 to 1")->capture_default_str();
    command.add_option("--specular", a.options.phong_specular, "Phong's k_s, 0 to 1")->capture_default_str();
    command.add_option("--exponent", a.options.phong_exponent, "Phong's exponent, 1 to 1000")->capture_default_str();
    command.add_option("--specular-colour", a.specular_colour, "Colour of phong-split's highlights: R,G,B, 0 to 1");
    command.add_option("--exposure", a.options.exposure, "Factor on the result")->capture_default_str();
}

std::vector<std::string> described(const RelightArguments& arguments) {
    std::vector<std::string> parameters;
    for (const auto& [name, model] : reflectance_models)
        if (model == arguments.options.model) parameters.push_back("relight.model=" + name);
    for (const auto& [name, lookup] : lookups)
        if (lookup == arguments.options.lookup) parameters.push_back("relight.lookup=" + name);
    parameters.push_back(fmt::format("relight.exposure={}", arguments.options.exposure));
    for (const std::string& light : arguments.lights) parameters.push_back("relight.light=" + light);
    for (const std::string& place : arguments.lamp_positions) parameters.push_back("relight.light-position=" + place);
    for (const std::string& file : arguments.environments)
        parameters.push_back("relight.environment=" + std::filesystem::path(file).filename().string());
    return parameters;
}

void require_readable_lights(const RelightArguments& arguments) {
    for (const std::string& light : arguments.lights) parse_light(light);
    for (const std::string& place : arguments.lamp_positions) parse_lamp_position(place, Eigen::Vector3d::Zero());
}

Lights lights_of(const RelightArguments& arguments, const RelightScene& scene) {
    Lights lights;
    for (const std::string& light : arguments.lights) lights.push_back(parse_light(light));
    if (arguments.lamp_positions.empty()) return lights;
    const Eigen::Vector3d object =
        scene.geometry.view->point_at(centroid_of(scene.normals.valid).value_or(cv::Point2d(0, 0)));
    for (const std::string& place : arguments.lamp_positions) lights.push_back(parse_lamp_position(place, object));
    return lights;
}

RelightOptions relight_options(const RelightArguments& arguments) {
    RelightOptions options = arguments.options;
    options.environment_yaw = arguments.yaw_deg * std::numbers::pi / 180;
    if (!arguments.specular_colour.empty()) {
        const auto colour = parse_numbers("--specular-colour", arguments.specular_colour, 3);
        options.specular_colour = {colour[0], colour[1], colour[2]};
    }
    options.validate();
    return options;
}

}  // namespace darkbox
