#include "processing/formats/report/report.h"

#include <fmt/format.h>

#include <algorithm>

#include "processing/formats/report/html.h"
#include "processing/formats/report/plots.h"
#include "processing/formats/report/style.h"

namespace darkbox {
namespace {

std::string warnings_html(const std::vector<std::string>& warnings) {
    if (warnings.empty()) return "<p class='fine'>No warnings.</p>";
    std::string html = "<ul class='warnings'>";
    for (const std::string& warning : warnings) html += "<li>" + escaped(warning) + "</li>";
    return html + "</ul>";
}

std::string facts_html(const std::vector<std::pair<std::string, std::string>>& facts) {
    std::string html = "<div class='card scroll'><table class='facts'>";
    for (const auto& [name, value] : facts)
        html += fmt::format("<tr><td>{}</td><td>{}</td></tr>", escaped(name), escaped(value));
    return html + "</table></div>";
}

std::string picture_html(const ReportPicture& picture) {
    const std::string link =
        picture.file.empty() ? std::string() : fmt::format(" <a href='{0}'>{0}</a>", escaped(picture.file));
    return fmt::format("<figure><img src='{}' alt='{}'><figcaption><b>{}</b><span>{}{}</span></figcaption></figure>",
                       data_uri(picture.image), escaped(picture.title), escaped(picture.title),
                       escaped(picture.caption), link);
}

std::string gallery_html(const char* heading, const char* kind, const std::vector<ReportPicture>& pictures) {
    if (pictures.empty()) return {};
    std::string html = fmt::format("<h2>{}</h2><div class='grid-of {}'>", heading, kind);
    for (const ReportPicture& picture : pictures) html += picture_html(picture);
    return html + "</div>";
}

std::string figure_html(const std::string& svg, const char* title, const std::string& caption) {
    return fmt::format("<figure>{}<figcaption><b>{}</b><span>{}</span></figcaption></figure>", svg, title, caption);
}

std::string ellipse_words(const Lights& lights, double magnification) {
    if (std::none_of(lights.begin(), lights.end(), [](const Light& l) { return l.sigma_deg() > 0; })) return {};
    if (magnification <= 1) return "Ellipses are one standard deviation. ";
    return fmt::format("Ellipses are one standard deviation, magnified {:.0f} times. ", magnification);
}

std::string plots_html(const ReportContent& content) {
    std::string figures;
    if (!content.lights.empty())
        figures += figure_html(light_plot(content.lights), "Light directions",
                               fmt::format("As the camera sees them come; rings are degrees off its axis. {}Condition "
                                           "number {:.3g}.",
                                           ellipse_words(content.lights, light_plot_magnification(content.lights)),
                                           content.condition_number));
    if (content.ball)
        figures +=
            figure_html(ball_plot(*content.ball, content.lights), "Mirror ball",
                        "Brightest of all frames, outline and highlights. " +
                            ellipse_words(content.lights, ball_plot_magnification(*content.ball, content.lights)));
    if (!content.exposure_histogram.empty())
        figures += figure_html(histogram_plot(content.exposure_histogram), "Exposure",
                               "Brightest channel of every sample on the object, all photographs; square-root scale.");
    return figures.empty() ? "" : "<h2>Light and exposure</h2><div class='grid-of'>" + figures + "</div>";
}

std::string light_row(const Light& light, std::size_t number) {
    const std::string sigma = light.sigma_deg() > 0 ? fmt::format("{:.3f}", light.sigma_deg()) : std::string("–");
    return fmt::format(
        "<tr{}><td>{}</td><td class='text'>{}</td><td>{:.4f}</td><td>{:.4f}</td><td>{:.4f}</td><td>{}</td>"
        "<td>{:.3g}</td><td>{:.3g}</td><td>{:.3g}</td></tr>",
        light.used ? "" : " class='unused'", number, escaped(light.file), light.direction.x(), light.direction.y(),
        light.direction.z(), sigma, light.intensity[0], light.intensity[1], light.intensity[2]);
}

std::string lights_html(const Lights& lights) {
    if (lights.empty()) return {};
    std::string html =
        "<h2>Lights</h2><div class='card scroll'><table><tr><th>#</th><th class='text'>photograph</th><th>x</th>"
        "<th>y</th><th>z</th><th>σ (°)</th><th>red</th><th>green</th><th>blue</th></tr>";
    for (std::size_t i = 0; i < lights.size(); ++i) html += light_row(lights[i], i + 1);
    return html + "</table></div>";
}

std::string timings_html(const std::vector<std::pair<std::string, double>>& timings) {
    if (timings.empty()) return {};
    std::string html = "<h2>Timings</h2><div class='card scroll'><table><tr><th>stage</th><th>seconds</th></tr>";
    for (const auto& [stage, seconds] : timings)
        html += fmt::format("<tr><td>{}</td><td>{:.3f}</td></tr>", escaped(stage), seconds);
    return html + "</table></div>";
}

}  // namespace

std::string report_html(const ReportContent& content) {
    const std::string title = escaped(content.title);
    return fmt::format(
               "<!doctype html><html lang='en'><head><meta charset='utf-8'><meta name='viewport' "
               "content='width=device-width, initial-scale=1'><title>{} – darkbox</title><style>{}</style></head>"
               "<body><main><h1>{}</h1><p class='sub'>darkbox session report</p>",
               title, report_style, title) +
           warnings_html(content.warnings) + facts_html(content.facts) + gallery_html("Results", "", content.pictures) +
           gallery_html("Relit", "small", content.relit) + plots_html(content) + lights_html(content.lights) +
           timings_html(content.timings) + "</main></body></html>\n";
}

}  // namespace darkbox
