#include <fmt/format.h>

#include <memory>

#include "processing/pipeline/import.h"
#include "rig/cli/arguments.h"
#include "rig/cli/choices.h"
#include "rig/cli/commands.h"
#include "rig/cli/object_options.h"

namespace darkbox {
namespace {

constexpr std::string_view warning_prefix = "warning: ";

struct ImportArguments {
    ImportOptions options;
    std::vector<std::string> balls;
    ObjectOptions object;
};

CommandResult run(const ImportArguments& arguments, const WorkContext& work) {
    ImportOptions options = arguments.options;
    for (const std::string& text : arguments.balls) options.balls.push_back(parse_ball(text));
    options.record = object_record(arguments.object);
    const Session session = import_photographs(options, work);

    CommandResult result;
    Json notes = Json::array();
    for (const std::string& note : session.info().notes) {
        if (note.starts_with(warning_prefix))
            result.warnings.push_back(note.substr(warning_prefix.size()));
        else
            notes.push_back(note);
    }
    result.json = {{"session", session.folder().string()},
                   {"object", session.info().object},
                   {"frames", session.frames().size()},
                   {"notes", notes}};
    result.text = fmt::format("{}: {} frames, sealed. Next: darkbox process {}", session.folder().string(),
                              session.frames().size(), session.folder().string());
    return result;
}

}  // namespace

void add_import_command(CommandLine& line) {
    const auto a = std::make_shared<ImportArguments>();
    CLI::App& command =
        line.add("import", "Make a sealed session of photographs from any camera",
                 "darkbox import photos --ball-images ball --mask photos/mask.png --transfer linear --out s",
                 [a](const WorkContext& work) { return run(*a, work); });
    command
        .add_option("folders", a->options.folders, "Folders of photographs: plain, DiLiGenT, or RTI with an .lp file")
        ->required();
    command.add_option("--out", a->options.out, "Folder of the new session")->required();
    command.add_option("--object", a->options.object, "Name of the object; default: the first folder's name");
    add_object_options(command, a->object);
    command.add_option("--ball-images", a->options.ball_images, "Folder with a mirror ball under the same lamps");
    command.add_option("--flat-images", a->options.flat_images,
                       "Folder with a white or grey plane in the object's place, facing the camera, under the same "
                       "lamps: tells their intensities");
    command.add_option("--ball", a->balls, "A ball's outline, pixels: X,Y,R; once for each ball");
    command.add_option("--ball-diameter", a->options.ball_diameter_mm, "Of the mirror balls, mm: tells the scale");
    command.add_option("--ball-mask", a->options.ball_mask, "Picture that is white on the ball");
    command.add_option("--mask", a->options.mask, "Picture that is white on the object");
    command.add_option("--lights", a->options.lights, "Light directions: .lp, counted or bare x y z lines");
    const std::map<std::string, ImportTransfer> transfers{
        {"auto", ImportTransfer::automatic}, {"linear", ImportTransfer::linear}, {"srgb", ImportTransfer::srgb}};
    command.add_option("--transfer", a->options.transfer, "Transfer curve: auto, linear, srgb")
        ->transform(one_of(transfers));
    const std::map<std::string, ImportLayout> layouts{
        {"auto", ImportLayout::automatic}, {"plain", ImportLayout::plain}, {"diligent", ImportLayout::diligent}};
    command.add_option("--format", a->options.layout, "Layout of the folders: auto, plain, diligent")
        ->transform(one_of(layouts));
}

}  // namespace darkbox
