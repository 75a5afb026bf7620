#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "processing/calibration/intensity.h"
#include "processing/calibration/light_geometry.h"
#include "processing/formats/atomic_file.h"
#include "processing/formats/calibration_file.h"
#include "processing/formats/exr.h"
#include "processing/formats/json_file.h"
#include "processing/formats/map_files.h"
#include "processing/formats/png.h"
#include "processing/formats/report/page_picture.h"
#include "processing/formats/report/report.h"
#include "processing/maps/srgb.h"
#include "processing/pipeline/ball_picture.h"
#include "processing/pipeline/default_relit.h"
#include "processing/pipeline/false_colour.h"
#include "processing/pipeline/photographs_seen.h"
#include "processing/pipeline/provenance.h"
#include "processing/pipeline/session_files.h"
#include "processing/pipeline/stages.h"
#include "processing/pipeline/steps.h"

namespace darkbox {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t histogram_bins = 64;

std::string controls_of(const std::vector<FrameRecord>& lit) {
    const FrameRecord& first = lit.front();
    std::string text = fmt::format("{}x{} pixels, {} bit {}, {}", first.width, first.height, first.bit_depth,
                                   first.format, first.transfer == TransferCurve::linear ? "linear" : "sRGB");
    if (first.exposure_s > 0) text += fmt::format(", {:.4g} ms, gain {:.3g}", first.exposure_s * 1e3, first.gain);
    return text;
}

void add_facts(const Session& session, ReportContent& content) {
    const SessionInfo& info = session.info();
    const auto lit = photographs_of(session, FrameKind::lit);
    content.facts = {{"Object", info.object}, {"Taken", info.created}, {"Source", info.source}};
    if (!info.rig.empty()) content.facts.emplace_back("Rig", info.rig);
    if (!info.camera.empty()) content.facts.emplace_back("Camera", info.camera);
    content.facts.emplace_back("Frames", fmt::format("{} lit of {}", lit.size(), session.frames().size()));
    if (!lit.empty()) content.facts.emplace_back("Format", controls_of(lit));
    for (const std::string& note : info.notes) {
        constexpr std::string_view warning = "warning: ";
        if (note.starts_with(warning))
            content.warnings.push_back(note.substr(warning.size()));
        else
            content.facts.emplace_back("Note", note);
    }
    for (const SessionEvent& event : session.events())
        content.facts.emplace_back("Event", event.when + " " + event.what);
}

/// As small as a page shows it; `file`, from the session's folder, has all of it.
void add_picture(const cv::Mat3b& image, std::string title, std::string caption, std::string file,
                 std::vector<ReportPicture>& pictures) {
    pictures.push_back({for_page(image), std::move(title), std::move(caption), std::move(file)});
}

/// What the frames themselves show: their mean, and how they are exposed.
void add_photographs(const PhotographsSeen& seen, ReportContent& content) {
    add_picture(viewable(seen.mean, viewing_gain(seen.mean, seen.mask)), "Mean photograph",
                fmt::format("Mean of {} photographs, brightened for viewing", seen.photographs), "", content.pictures);
    content.exposure_histogram = seen.exposure;
}

void add_calibration(const Session& session, const ResultFiles& files, const cv::Mat3f& brightest,
                     ReportContent& content, const WorkContext& work) {
    const Calibration calibration = read_calibration(files.calibration).calibration;
    content.lights = calibration.lights;
    content.condition_number = calibration.condition_number;
    content.warnings.insert(content.warnings.end(), calibration.warnings.begin(), calibration.warnings.end());
    content.facts.emplace_back(
        "Lights", fmt::format("{}, {} of {} used", calibration.method, direction_matrix(calibration.lights).rows(),
                              calibration.lights.size()));
    content.facts.emplace_back("Light geometry", in_words(light_geometry(calibration.lights)));
    content.facts.emplace_back("Intensities", name(calibration.intensity_origin));
    for (const std::string& rejected : calibration.rejected) content.facts.emplace_back("Left out", rejected);
    if (calibration.balls.empty()) return;
    const bool separate = !photographs_of(session, FrameKind::ball).empty();
    const BallView view = view_of_balls(separate ? brightest_of_ball(session, work) : brightest, calibration.balls);
    ReportBall ball{view.image, {}, {}};
    for (const Ball& found : calibration.balls) {
        const cv::Point2d centre = view.in_view(found.x, found.y);
        ball.balls.push_back({centre.x, centre.y, found.radius * view.scale, found.confidence});
    }
    for (std::size_t i = 0; i < calibration.highlights.size(); ++i) {
        if (!calibration.highlights[i]) continue;
        Highlight highlight = *calibration.highlights[i];
        const cv::Point2d at = view.in_view(highlight.u, highlight.v);
        highlight.u = at.x;
        highlight.v = at.y;
        ball.highlights.emplace_back(calibration.lights[i].file, highlight);
    }
    content.ball = ball;
}

/// How many lights each pixel's normal rests on, and how far it may be off, where the solver says so.
void add_confidence(const ResultFiles& files, const cv::Mat1b& valid, ReportContent& content) {
    const cv::Mat1f used = read_exr_channel(files.confidence, "lights_used");
    double least = 0, most = 0;
    cv::minMaxLoc(used, &least, &most, nullptr, nullptr, valid);
    add_picture(heat(used, valid, std::max(most, 1.0)), "Lights used",
                least < most ? fmt::format("Photographs behind each normal, from {:.0f} to {:.0f} (white)", least, most)
                             : fmt::format("{:.0f} photographs behind every normal", most),
                "results/confidence.exr", content.pictures);
    const std::optional<cv::Mat1f> sigma = find_exr_channel(files.confidence, "sigma_deg");
    if (!sigma) return;
    cv::Mat3f grey;
    cv::merge(std::vector<cv::Mat>{*sigma, *sigma, *sigma}, grey);
    const double top = 1.0 / viewing_gain(grey, valid, 99.0);
    add_picture(heat(*sigma, valid, top), "Predicted error of the normal",
                fmt::format("One standard deviation of its angle; white is {:.3g}°", top), "results/confidence.exr",
                content.pictures);
}

/// "12.3 mm in all, 2 parts, each about its own mean"
std::string height_span(const ResultFiles& files, double span) {
    if (!fs::exists(files.results_summary)) return fmt::format("{:.4g} in all", span);
    const auto json = read_json(files.results_summary);
    return reading_keys(files.results_summary, "a summary of a stage", [&] {
        const auto& height = json.at("height");
        const int parts = height.at("parts").get<int>();
        return fmt::format("{:.4g} {} in all{}", span, height.at("unit").get<std::string>(),
                           parts > 1 ? fmt::format("; {} parts, each about its own mean", parts) : std::string());
    });
}

void add_normals(const ResultFiles& files, ReportContent& content) {
    const NormalMap normals = read_normal_map(files.normals);
    const AlbedoMap albedo = read_albedo_map(files.albedo, normals.valid);
    const cv::Mat1f residual = read_exr_channel(files.confidence, "residual");
    const double gain = viewing_gain(albedo.albedo, albedo.valid);
    add_picture(normal_colours(normals), "Normals", "Red = right, green = up, blue = towards the camera",
                "results/normals.png", content.pictures);
    add_picture(viewable(albedo.albedo, gain), "Albedo",
                fmt::format("The unshaded image, brightened {:.3g} times", gain), "results/albedo.png",
                content.pictures);
    cv::Mat3f grey;
    cv::merge(std::vector<cv::Mat>{residual, residual, residual}, grey);
    const double top = 1.0 / viewing_gain(grey, normals.valid, 99.0);
    add_picture(heat(residual, normals.valid, top), "Residual",
                fmt::format("What the solver's law leaves unexplained; white is {:.3g} of full scale", top),
                "results/confidence.exr", content.pictures);
    add_confidence(files, normals.valid, content);
    if (!fs::exists(files.height)) return;
    const cv::Mat1f height = read_exr_channel(files.height, "Y");
    double low = 0, high = 0;
    cv::minMaxLoc(height, &low, &high, nullptr, nullptr, normals.valid);
    add_picture(heat(cv::Mat(height - low), normals.valid, std::max(high - low, 1e-6)), "Height",
                fmt::format("From dark (far) to white (near): {}", height_span(files, high - low)),
                "results/height.exr", content.pictures);
}

void add_texels(const ResultFiles& files, ReportContent& content) {
    const IndexMap index = read_index_map(files.index);
    add_picture(false_colours(index), "Texels", fmt::format("{} texels in false colours", index.texels),
                "texels/index.png", content.pictures);
}

/// Timings and warnings that the stages left in their summaries.
void add_summary(const fs::path& file, const std::string& stage, ReportContent& content) {
    if (!fs::exists(file)) return;
    const auto json = read_json(file);
    reading_keys(file, "a summary of a stage", [&] {
        for (const auto& [part, seconds] : json.at("seconds").items())
            content.timings.emplace_back(stage + ": " + part, seconds.get<double>());
        if (stage != "normals") return;
        for (const auto& warning : json.at("warnings")) content.warnings.push_back(warning.get<std::string>());
        content.facts.emplace_back(
            "Residual", fmt::format("{:.4g} of full scale over {} pixels", json.at("residual_rms").get<double>(),
                                    json.at("pixels").get<std::size_t>()));
        if (json.contains("height")) {
            const auto& height = json.at("height");
            content.facts.emplace_back(
                "Surface", fmt::format("heights {:.4g} to {:.4g} {}; mesh of {} vertices and {} triangles",
                                       height.at("lowest").get<double>(), height.at("highest").get<double>(),
                                       height.at("unit").get<std::string>(), height.at("vertices").get<std::size_t>(),
                                       height.at("faces").get<std::size_t>()));
            content.timings.emplace_back("normals: height", height.at("seconds").get<double>());
        }
        if (json.contains("mean_angular_error_deg"))
            content.facts.emplace_back("Angular error", fmt::format("{:.2f}° mean against the given truth",
                                                                    json.at("mean_angular_error_deg").get<double>()));
    });
}

std::vector<fs::path> add_relit(const Session& session, const ResultFiles& files, ReportContent& content,
                                const WorkContext& work) {
    std::vector<fs::path> written;
    for (RelitPicture& picture : relight_by_default(load_shaded_scene(session), work)) {
        written.push_back(files.results_folder / ("relit-" + picture.name + ".png"));
        write_png(written.back(), picture.image);
        add_picture(picture.image, picture.name, picture.caption, "results/relit-" + picture.name + ".png",
                    content.relit);
        picture.image.release();
    }
    describe_pictures(session, "relit", written);
    return written;
}

}  // namespace

ReportSummary run_report(const Session& session, const WorkContext& work) {
    const ResultFiles files(session.folder());
    ReportSummary summary;
    Stopwatch watch;
    ReportContent content;
    content.title = session.info().object.empty() ? session.folder().filename().string() : session.info().object;
    add_facts(session, content);
    {
        const PhotographsSeen seen = see_photographs(session, histogram_bins, work);
        add_photographs(seen, content);
        if (fs::exists(files.calibration)) add_calibration(session, files, seen.brightest, content, work);
    }
    if (fs::exists(files.normals)) add_normals(files, content);
    if (fs::exists(files.index)) add_texels(files, content);
    if (fs::exists(files.shading)) summary.relit = add_relit(session, files, content, work);
    add_summary(files.calibration_summary, "calibrate", content);
    add_summary(files.results_summary, "normals", content);
    add_summary(files.texels, "texels", content);
    add_summary(files.shading_summary, "shade", content);
    step(work, {"writing the report", 0, 1, files.report.string()});
    write_file(files.report, report_html(content));
    summary.file = files.report;
    summary.warnings = content.warnings;
    summary.seconds = watch.lap();
    step(work, {"writing the report", 1, 1, ""});
    return summary;
}

}  // namespace darkbox
