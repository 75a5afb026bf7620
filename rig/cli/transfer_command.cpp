#include <fmt/format.h>

#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "acquisition/frame/error.h"
#include "processing/formats/environment_file.h"
#include "processing/formats/exr.h"
#include "processing/formats/map_files.h"
#include "processing/formats/map_picture.h"
#include "processing/formats/picture.h"
#include "processing/formats/png.h"
#include "processing/maps/srgb.h"
#include "processing/pipeline/provenance.h"
#include "processing/pipeline/stages.h"
#include "processing/transfer/transfer.h"
#include "rig/cli/arguments.h"
#include "rig/cli/choices.h"
#include "rig/cli/commands.h"
#include "rig/cli/relight_options.h"
#include "rig/cli/relit_files.h"

namespace darkbox {
namespace {

namespace fs = std::filesystem;

struct TransferArguments {
    fs::path source;
    fs::path source_normals;
    fs::path source_albedo;
    fs::path source_mask;
    fs::path target;
    fs::path target_mask;
    fs::path out;
    fs::path source_control;
    fs::path target_control;
    std::vector<fs::path> apply;
    TransferOptions options;
    RelightArguments relight;
};

const std::map<std::string, TransferMethod> methods{{"analogies", TransferMethod::analogies},
                                                    {"patchmatch", TransferMethod::patchmatch},
                                                    {"preview", TransferMethod::preview}};

/// The source's maps, and its shading maps where it is a session: only then can the target be relit.
struct Source {
    TransferSource maps;
    std::optional<ShadingMaps> shading;
};

Source load_source(const TransferArguments& a) {
    const bool plain = !a.source_normals.empty() || !a.source_albedo.empty();
    if (plain == !a.source.empty())
        throw UsageError("transfer needs one source",
                         "give --source SESSION, or --source-normals FILE and --source-albedo FILE");
    if (!plain) {
        RelightScene scene = load_scene(Session::open(a.source));
        return {{std::move(scene.normals), std::move(scene.albedo), std::move(scene.index)}, std::move(scene.shading)};
    }
    if (a.source_normals.empty() || a.source_albedo.empty())
        throw UsageError("a source of plain maps needs both maps",
                         "give --source-normals FILE and --source-albedo FILE");
    const cv::Mat1b mask = a.source_mask.empty() ? cv::Mat1b() : read_mask(a.source_mask);
    TransferSource maps;
    maps.normals = mask.empty() ? read_normal_map(a.source_normals) : read_normal_map(a.source_normals, mask);
    maps.albedo = read_albedo_map(a.source_albedo, mask.empty() ? maps.normals.valid : mask);
    if (a.source_albedo.extension() != ".exr") maps.white = 1.0F;
    return {std::move(maps), std::nullopt};
}

/// The target's normals, and where its surface lies where near lamps are to light it.
struct Target {
    NormalMap normals;
    SceneGeometry geometry = {};
};

Target load_target(const TransferArguments& a) {
    const bool near = !a.relight.lamp_positions.empty();
    if (fs::is_directory(a.target)) {
        if (!a.target_mask.empty())
            throw UsageError("--target-mask goes with a plain normal map, a session has its own mask", "leave it out");
        const Session session = Session::open(a.target);
        Target target{load_scene(session).normals};
        if (near) target.geometry = load_geometry(session);
        return target;
    }
    if (near)
        throw InputError("a plain map as target does not say where its pixels lie, which --light-position needs",
                         "use a processed session as --target, or --light");
    return a.target_mask.empty() ? Target{read_normal_map(a.target)}
                                 : Target{read_normal_map(a.target, read_mask(a.target_mask))};
}

ControlMaps load_control(const TransferArguments& a) {
    if (a.source_control.empty() != a.target_control.empty())
        throw UsageError("a control map has two sides", "give --control-source FILE and --control-target FILE");
    if (a.source_control.empty()) return {};
    return {read_picture(a.source_control).samples, read_picture(a.target_control).samples};
}

/// Maps that go with the source's pixels, each with the name it gets in --out.
struct CarriedMap {
    fs::path name;
    MapPicture map;
};

std::vector<CarriedMap> load_carried(const TransferArguments& a, cv::Size source) {
    std::vector<CarriedMap> carried;
    for (const fs::path& file : a.apply) {
        const fs::path name = "applied-" + file.filename().string();
        for (const CarriedMap& other : carried)
            if (other.name == name)
                throw InputError(fmt::format("two maps to apply are called {}", file.filename().string()),
                                 "rename one, or apply them one after the other");
        carried.push_back({name, read_map_picture(file)});
        const cv::Size size = carried.back().map.size();
        if (size != source)
            throw InputError(fmt::format("{} is {}x{}, but the source is {}x{}", file.string(), size.width, size.height,
                                         source.width, source.height),
                             "apply a map of the source's own pixels");
    }
    return carried;
}

/// relit-1.png, relit-2.png, ... one for each light, then one for each environment.
std::vector<fs::path> write_relit_pictures(const TransferArguments& a, const RelightScene& scene,
                                           const WorkContext& work) {
    const RelightOptions options = relight_options(a.relight);
    const Relighter relighter(scene, work);
    std::vector<fs::path> written;
    const auto write = [&](const Lighting& lighting, double gain) {
        written.push_back(a.out / fmt::format("relit-{}.png", written.size() + 1));
        render_to_file(relighter, lighting, options, {.gain = gain}, written.back(), work);
    };
    const double gain = viewing_gain(scene.albedo.albedo, scene.albedo.valid);
    for (const Light& light : lights_of(a.relight, scene)) write(Lights{light}, gain);
    for (const std::string& file : a.relight.environments) {
        const FoldedEnvironment folded = relighter.fold(read_environment(file), options, work);
        write(folded, gain_under(folded, relighter, options, scene.normals.valid, work));
    }
    return written;
}

/// The colours are the source's, so the pictures say what is known of it.
void describe_transferred(const TransferArguments& a, const std::vector<fs::path>& relit) {
    const Session source = Session::open(a.source);
    std::vector<std::string> parameters{fmt::format("transfer.target={}", a.target.filename().string()),
                                        fmt::format("transfer.seed={}", a.options.seed)};
    for (const auto& [name, method] : methods)
        if (method == a.options.method) parameters.push_back("transfer.method=" + name);
    describe_pictures(source, "texture moved onto another object", {a.out / "albedo.png"}, parameters);
    for (std::string& parameter : described(a.relight)) parameters.push_back(std::move(parameter));
    describe_pictures(source, "texture moved onto another object, relit", relit, parameters);
}

Json json_of(const std::optional<double>& figure) { return figure ? Json(*figure) : Json(); }

CommandResult run(const TransferArguments& a, const WorkContext& work) {
    const bool relit_wanted =
        !a.relight.lights.empty() || !a.relight.lamp_positions.empty() || !a.relight.environments.empty();
    require_outside_payload(a.out);
    if (!a.source.empty() && !a.source_mask.empty())
        throw UsageError("--source-mask goes with plain maps, a session has its own", "leave it out");
    // What will be needed after the long work is refused before it.
    relight_options(a.relight);
    require_readable_lights(a.relight);
    for (const std::string& file : a.relight.environments) read_environment(file);
    const Source source = load_source(a);
    if (relit_wanted && !source.shading)
        throw InputError("plain maps cannot be relit: they have no shading maps",
                         "use a processed session as --source");
    const Target target = load_target(a);
    const ControlMaps control = load_control(a);
    const std::vector<CarriedMap> carried = load_carried(a, source.maps.normals.valid.size());
    const TransferResult moved = transfer_texture(source.maps, target.normals, a.options, work, control);

    // A picture's colours come out as they went in; radiance has no white of its own.
    const AlbedoMap& albedo = source.maps.albedo;
    const double gain = source.maps.white ? 1.0 / *source.maps.white : viewing_gain(albedo.albedo, albedo.valid);
    write_png(a.out / "albedo.png", viewable(moved.albedo.albedo, gain));
    write_albedo_map(a.out / "albedo.exr", moved.albedo);
    write_coordinates(a.out / "coordinates.png", moved.coordinates);
    if (moved.index.texels > 0) write_index_map(a.out / "index.png", moved.index);
    write_normal_map(a.out / "normals.exr", moved.normals);
    write_normal_map(a.out / "normals.png", moved.normals);
    write_exr(a.out / "uncovered.exr", moved.uncovered_deg);
    for (const CarriedMap& map : carried) write_map_picture(a.out / map.name, map.map.read_through(moved.coordinates));
    std::vector<fs::path> relit;
    if (relit_wanted)
        relit =
            write_relit_pictures(a, {moved.normals, moved.albedo, moved.index, *source.shading, target.geometry}, work);
    if (!a.source.empty()) describe_transferred(a, relit);

    CommandResult result;
    result.json = {{"out", a.out.string()},
                   {"seconds", moved.seconds},
                   {"patch_energy", json_of(moved.patch_energy)},
                   {"coherence", moved.coherence},
                   {"histogram_distance", json_of(moved.histogram_distance)},
                   {"guide_error_deg", json_of(moved.guide_error_deg)},
                   {"coverage_deg", moved.coverage_deg},
                   {"relit", Json::array()},
                   {"applied", Json::array()}};
    for (const CarriedMap& map : carried) result.json["applied"].push_back((a.out / map.name).string());
    for (const fs::path& path : relit) result.json["relit"].push_back(path.string());
    constexpr double covered_deg = 15;
    if (moved.coverage_deg > covered_deg)
        result.warnings.push_back(
            fmt::format("the source does not show all of the target's normals: 5 % of them are more than {:.0f} "
                        "degrees from any of the source's; uncovered.exr shows where",
                        moved.coverage_deg));
    result.text = fmt::format("{}: {} x {} pixels in {:.1f} s, coherence {:.2f}", a.out.string(),
                              moved.coordinates.cols, moved.coordinates.rows, moved.seconds, moved.coherence);
    if (moved.patch_energy) result.text += fmt::format(", patch energy {:.1f}", *moved.patch_energy);
    return result;
}

}  // namespace

void add_transfer_command(CommandLine& line) {
    const auto a = std::make_shared<TransferArguments>();
    CLI::App& command =
        line.add("transfer", "Move an object's texture onto another object",
                 "darkbox transfer --source s --target other --out moved --light=-0.5,0.5,0.7 --environment sky.hdr",
                 [a](const WorkContext& work) { return run(*a, work); });
    command.add_option("--source", a->source, "Processed session whose texture is taken");
    command.add_option("--source-normals", a->source_normals, "Or plain maps: normals as PNG or EXR");
    command.add_option("--source-albedo", a->source_albedo, "  and unshaded colours");
    command.add_option("--source-mask", a->source_mask, "  and a picture that is white on the object");
    command.add_option("--target", a->target, "Processed session, or a normal map as PNG or EXR")->required();
    command.add_option("--target-mask", a->target_mask, "White on the target, for a plain normal map");
    command.add_option("--out", a->out, "Folder for albedo, index, coordinates, normals and relit-*.png")->required();
    command.add_option("--method", a->options.method, "analogies, patchmatch or preview (default: patchmatch)")
        ->transform(one_of(methods));
    command.add_option("--apply", a->apply, "Other maps of the source, carried over in their own format")
        ->expected(1, -1);
    command.add_option("--control-source", a->source_control, "patchmatch: a drawn guide, 8- or 16-bit PNG or EXR");
    command.add_option("--control-target", a->target_control, "  and where on the target its colours are wanted");
    command.add_option("--control-weight", a->options.control_weight, "  and its weight against albedo")
        ->capture_default_str();
    command.add_option("--jitter", a->options.jitter, "patchmatch, preview: 0...1, how freely chunks are picked")
        ->capture_default_str();
    command.add_option("--window", a->options.window, "Side of the window, pixels, odd")->capture_default_str();
    command.add_option("--coarse-window", a->options.coarse_window, "analogies: side of the window one level up, odd")
        ->capture_default_str();
    command.add_flag("--exact-search", a->options.exact_search,
                     "analogies: compare with every pixel of the source, for tests: slow");
    command.add_option("--kappa", a->options.kappa, "Coherence weight: what continues a neighbour's patch wins")
        ->capture_default_str();
    command.add_option("--normal-weight", a->options.normal_weight, "Weight of normals against albedo")
        ->capture_default_str();
    command.add_option("--sigma", a->options.normal_sigma, "Low-pass of the normals, pixels")->capture_default_str();
    command.add_option("--passes", a->options.passes,
                       "Refinement of each level; 0 = analogies as they are, or bare seeds (default: by the method)");
    command.add_option("--seed", a->options.seed, "Seed of the random choices")->capture_default_str();
    add_relight_options(command, a->relight);
}

}  // namespace darkbox
