#include <fmt/format.h>

#include <cmath>
#include <memory>
#include <numbers>

#include "acquisition/frame/error.h"
#include "processing/formats/environment_file.h"
#include "processing/maps/srgb.h"
#include "processing/pipeline/provenance.h"
#include "processing/pipeline/stages.h"
#include "processing/pipeline/steps.h"
#include "rig/cli/arguments.h"
#include "rig/cli/choices.h"
#include "rig/cli/commands.h"
#include "rig/cli/relight_options.h"
#include "rig/cli/relit_files.h"

namespace darkbox {
namespace {

enum class Sequence {
    none,
    circle,  ///< a light going round the object
    turn,    ///< the environment turning about the upright axis
};

struct RelightOrder {
    std::filesystem::path session;
    std::filesystem::path out;
    RelightArguments relight;
    Sequence sequence = Sequence::none;
    std::size_t frames = 36;
    double elevation_deg = 45;
    std::size_t constant_r = 0;  ///< pictures of the stack; 0 = none
    int bits = 8;
};

std::size_t count_pictures(const RelightOrder& a) {
    if (a.constant_r > 0) return a.constant_r;
    return a.sequence == Sequence::none ? 1 : a.frames;
}

void require_one_kind_of_light(const RelightOrder& a) {
    const bool circle = a.sequence == Sequence::circle, turn = a.sequence == Sequence::turn;
    const std::size_t kinds = std::size_t{!a.relight.lights.empty() || !a.relight.lamp_positions.empty()} +
                              a.relight.environments.size() + std::size_t{circle} + std::size_t{a.constant_r > 0};
    if (kinds != 1)
        throw UsageError("relight needs one kind of light: lights, an environment, a circling light or a constant r",
                         "give --light X,Y,Z or --light-position X,Y,Z (once or more), --environment FILE, --sequence "
                         "circle or --constant-r N");
    if (turn && a.relight.environments.empty())
        throw UsageError("--sequence turn turns an environment, and there is none", "give --environment FILE");
}

/// `turn` 0...1 of the circle: from the viewer's right by way of above. At 90 degrees the light is at the camera.
Light light_on_circle(double turn, double elevation_deg) {
    const double around = 2 * std::numbers::pi * turn, up = elevation_deg * std::numbers::pi / 180;
    Light light;
    light.direction = {std::cos(up) * std::cos(around), std::cos(up) * std::sin(around), std::sin(up)};
    return light;
}

/// What lights the pictures, one after the other.
class LightingPlan {
public:
    LightingPlan(const RelightOrder& a, const RelightOptions& options) : arguments_(a), options_(options) {
        require_readable_lights(a.relight);
        if (!a.relight.environments.empty()) environment_ = read_environment(a.relight.environments.front());
    }

    /// Before the first picture.
    void place_lights(const RelightScene& scene) { lights_ = lights_of(arguments_.relight, scene); }

    Lighting at(std::size_t picture, const Relighter& relighter, const WorkContext& work) const {
        const double count = static_cast<double>(count_pictures(arguments_)), i = static_cast<double>(picture);
        if (arguments_.constant_r > 0) return ConstantCoefficient{(i + 1) / count};
        if (arguments_.sequence == Sequence::circle)
            return Lights{light_on_circle(i / count, arguments_.elevation_deg)};
        if (!lights_.empty()) return lights_;
        RelightOptions turned = options_;
        turned.environment_yaw += 2 * std::numbers::pi * i / count;
        return relighter.fold(environment_, turned, work);
    }

private:
    const RelightOrder& arguments_;
    RelightOptions options_;
    Lights lights_;
    Environment environment_;
};

struct Seconds {
    double fold = 0;    ///< of environments
    double render = 0;  ///< of all pictures, without writing them
};

Seconds write_pictures(const std::vector<std::filesystem::path>& names, const LightingPlan& plan,
                       const Relighter& relighter, const RelightOptions& options, const PictureStyle& style,
                       const WorkContext& work) {
    Seconds seconds;
    for (std::size_t i = 0; i < names.size(); ++i) {
        step(work, {"relighting", i, names.size(), names[i].filename().string()});
        Stopwatch watch;
        const Lighting lighting = plan.at(i, relighter, work);
        seconds.fold += watch.lap();
        seconds.render += render_to_file(relighter, lighting, options, style, names[i], work);
    }
    step(work, {"relighting", names.size(), names.size(), ""});
    return seconds;
}

CommandResult run(const RelightOrder& a, const WorkContext& work) {
    // What will be needed after reading the maps is refused before it.
    require_outside_payload(a.out);
    require_one_kind_of_light(a);
    const RelightOptions options = relight_options(a.relight);
    const std::vector<std::filesystem::path> names = picture_names(a.out, count_pictures(a));
    LightingPlan plan(a, options);

    const Session session = Session::open(a.session);
    RelightScene scene = load_shaded_scene(session);
    if (!a.relight.lamp_positions.empty()) scene.geometry = load_geometry(session);
    plan.place_lights(scene);
    const PictureStyle style{viewing_gain(scene.albedo.albedo, scene.albedo.valid), a.bits};
    const Relighter relighter(scene, work);
    const Seconds seconds = write_pictures(names, plan, relighter, options, style, work);
    describe_pictures(session, "relit", names, described(a.relight));

    const auto count = static_cast<double>(names.size());
    CommandResult result;
    result.json = {{"out", a.out.string()},
                   {"pictures", Json::array()},
                   {"width", relighter.size().width},
                   {"height", relighter.size().height},
                   {"viewing_gain", style.gain},
                   {"fold_seconds", seconds.fold / count},
                   {"seconds_per_frame", seconds.render / count}};
    for (const auto& name : names) result.json["pictures"].push_back(name.string());
    result.text = fmt::format("{}: {} of {} x {} pixels, {:.2f} ms to render each", a.out.string(),
                              names.size() == 1 ? "a picture" : fmt::format("{} pictures", names.size()),
                              relighter.size().width, relighter.size().height, 1e3 * seconds.render / count);
    return result;
}

}  // namespace

void add_relight_command(CommandLine& line) {
    const auto a = std::make_shared<RelightOrder>();
    CLI::App& command =
        line.add("relight", "Show the object under other lights or an environment, in one picture or many",
                 "darkbox relight s --light=-0.5,0.5,0.7 --light 1,0,1:0.2,0.3,0.6 --model phong --out relit.png\n  "
                 "darkbox relight s --light-position=-80,40,200 --out near.png\n  "
                 "darkbox relight s --environment sky.hdr --out under-sky.exr\n  "
                 "darkbox relight s --sequence circle --frames 100 --elevation 30 --out frames/%04d.png\n  "
                 "ffmpeg -framerate 25 -i frames/%04d.png -pix_fmt yuv420p circle.mp4",
                 [a](const WorkContext& work) { return run(*a, work); });
    command.add_option("session", a->session, "The processed session's folder")->required();
    command
        .add_option("--out", a->out,
                    "Picture: .png and .jpg are for looking at, .exr is linear; several: a folder or frames/%04d.png")
        ->required();
    add_relight_options(command, a->relight);
    const std::map<std::string, Sequence> sequences{{"circle", Sequence::circle}, {"turn", Sequence::turn}};
    command
        .add_option("--sequence", a->sequence,
                    "circle: a light goes round the object; turn: the environment turns about the upright axis")
        ->transform(one_of(sequences));
    command.add_option("--frames", a->frames, "Pictures of a whole sequence")
        ->check(CLI::Range(1, 100000))
        ->capture_default_str();
    command.add_option("--elevation", a->elevation_deg, "Of the circling light over the picture's plane, degrees")
        ->check(CLI::Range(-90.0, 90.0))
        ->capture_default_str();
    command.add_option("--constant-r", a->constant_r, "N pictures of the same coefficient everywhere: 1/N, 2/N, ... 1")
        ->check(CLI::Range(1, 100000));
    command.add_option("--bits", a->bits, "Of a PNG: 8 or 16")->check(CLI::IsMember({8, 16}))->capture_default_str();
}

}  // namespace darkbox
