#include <fmt/format.h>

#include <memory>

#include "acquisition/frame/error.h"
#include "processing/formats/environment_file.h"
#include "processing/formats/srgb.h"
#include "processing/pipeline/stages.h"
#include "rig/cli/arguments.h"
#include "rig/cli/commands.h"
#include "rig/cli/relight_options.h"

namespace darkbox {
namespace {

struct Arguments {
    std::filesystem::path session;
    std::filesystem::path out;
    RelightArguments relight;
};

RelightResult render(const RelightScene& scene, const RelightArguments& arguments, const WorkContext& work) {
    const RelightOptions options = relight_options(arguments);
    if (arguments.environments.size() + (arguments.lights.empty() ? 0 : 1) != 1)
        throw InputError("relight needs either lights or one environment",
                         "give --light X,Y,Z (once or more) or --environment FILE");
    if (!arguments.environments.empty())
        return relight(scene, read_environment(arguments.environments[0]), options, work);
    Lights lights;
    for (const std::string& text : arguments.lights) lights.push_back(parse_light(text));
    return relight(scene, lights, options, work);
}

CommandResult run(const Arguments& arguments, const WorkContext& work) {
    require_outside_payload(arguments.out);
    const RelightScene scene = load_shaded_scene(Session::open(arguments.session));
    const RelightResult relit = render(scene, arguments.relight, work);
    const double gain = viewing_gain(scene.albedo.albedo, scene.albedo.valid);
    write_relit(arguments.out, relit.image, gain);

    CommandResult result;
    result.json = {{"out", arguments.out.string()},      {"width", relit.image.cols},
                   {"height", relit.image.rows},         {"viewing_gain", gain},
                   {"fold_seconds", relit.fold_seconds}, {"seconds_per_frame", relit.render_seconds}};
    result.text = fmt::format("{}: {} x {} pixels in {:.1f} ms", arguments.out.string(), relit.image.cols,
                              relit.image.rows, 1e3 * relit.render_seconds);
    return result;
}

}  // namespace

void add_relight_command(CommandLine& line) {
    const auto a = std::make_shared<Arguments>();
    CLI::App& command = line.add("relight", "Show the object under other lights or an environment",
                                 "darkbox relight s --light=-0.5,0.5,0.7 --model phong --out relit.png\n  "
                                 "darkbox relight s --environment sky.hdr --out under-sky.exr",
                                 [a](const WorkContext& work) { return run(*a, work); });
    command.add_option("session", a->session, "The processed session's folder")->required();
    command.add_option("--out", a->out, "Picture: .png and .jpg are for looking at, .exr is linear")->required();
    add_relight_options(command, a->relight);
}

}  // namespace darkbox
