#include "processing/formats/light_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>
#include <optional>
#include <span>

#include "acquisition/frame/error.h"
#include "processing/formats/atomic_file.h"

namespace darkbox {
namespace {

namespace fs = std::filesystem;

constexpr double shortest_vector = 1e-4;
constexpr double unit_tolerance = 1e-2;

/// A line that holds something, as words.
struct Line {
    std::size_t number = 0;  ///< counted from 1
    std::string text;
    std::vector<std::string> words;
};

InputError bad_line(const fs::path& path, std::size_t line, const std::string& what) {
    return {fmt::format("{}, line {}: {}", path.string(), line, what),
            "correct that line; lights are unit vectors x y z from the object to the light"};
}

/// "0,5" is a decimal comma; "0.5,0.1" and "0,0,1" use commas between numbers.
bool has_decimal_comma(const std::string& word) {
    const bool digits = word.find_first_not_of("0123456789+-eE,") == std::string::npos;
    return digits && std::count(word.begin(), word.end(), ',') == 1 && word.front() != ',' && word.back() != ',';
}

std::vector<std::string> words_of(const std::string& text) {
    std::vector<std::string> words;
    for (std::size_t start = text.find_first_not_of(" \t"); start != std::string::npos;) {
        const std::size_t end = text.find_first_of(" \t", start);
        words.push_back(text.substr(start, end - start));
        start = text.find_first_not_of(" \t", end);
    }
    return words;
}

std::vector<std::string> split_at_commas(const std::vector<std::string>& words) {
    std::vector<std::string> parts;
    for (std::string word : words) {
        if (!has_decimal_comma(word)) std::replace(word.begin(), word.end(), ',', ' ');
        for (std::string& part : words_of(word)) parts.push_back(std::move(part));
    }
    return parts;
}

std::vector<Line> lines_of(const fs::path& path) {
    const std::string text = read_text(path);
    std::vector<Line> lines;
    std::size_t number = 0;
    for (std::size_t start = 0; start < text.size();) {
        const std::size_t end = std::min(text.find('\n', start), text.size());
        std::string line = text.substr(start, end - start);
        start = end + 1;
        ++number;
        if (number == 1 && line.starts_with("\xEF\xBB\xBF")) line.erase(0, 3);
        while (!line.empty() && (line.back() == '\r' || line.back() == ' ' || line.back() == '\t')) line.pop_back();
        const std::vector<std::string> words = words_of(line);
        if (!words.empty() && words.front().front() != '#') lines.push_back({number, line, words});
    }
    if (lines.empty())
        throw InputError(fmt::format("{} holds no lights", path.string()), "give a line x y z for each photograph");
    return lines;
}

std::optional<double> number_in(std::string word) {
    if (has_decimal_comma(word)) std::replace(word.begin(), word.end(), ',', '.');
    const char* first = word.data() + (word.front() == '+' ? 1 : 0);
    const char* last = word.data() + word.size();
    double value = 0;
    const auto [end, error] = std::from_chars(first, last, value);
    if (error != std::errc() || end != last) return std::nullopt;
    return value;
}

double require_number(const fs::path& path, const Line& line, const std::string& word) {
    const auto value = number_in(word);
    if (!value) throw bad_line(path, line.number, fmt::format("'{}' is not a number", word));
    if (!std::isfinite(*value)) throw bad_line(path, line.number, fmt::format("'{}' is not a finite number", word));
    return *value;
}

std::optional<std::size_t> count_in(const Line& line) {
    if (line.words.size() != 1) return std::nullopt;
    const auto value = number_in(line.words.front());
    if (!value || !(*value >= 0 && *value < 1e6) || *value != std::floor(*value)) return std::nullopt;
    return static_cast<std::size_t>(*value);
}

Eigen::Vector3d vector_in(const fs::path& path, const Line& line, std::span<const std::string> words) {
    Eigen::Vector3d v;
    for (int i = 0; i < 3; ++i) v[i] = require_number(path, line, words[static_cast<std::size_t>(i)]);
    return v;
}

/// "C:\scans\a 1.jpg" -> "a 1.jpg"
std::string basename_of(const std::string& name) { return name.substr(name.find_last_of("/\\") + 1); }

/// What stands before the last three words, with its inner spaces as they are.
std::string name_in(const Line& line) {
    std::string rest = line.text;
    for (int i = 0; i < 3; ++i) {
        rest.erase(rest.find_last_of(" \t"));
        rest.erase(rest.find_last_not_of(" \t") + 1);
    }
    return basename_of(rest.substr(rest.find_first_not_of(" \t")));
}

/// A light whose direction is as long as the line says.
Light light_in(const fs::path& path, const Line& line, LightFileForm form) {
    Light light;
    std::vector<std::string> words = line.words;
    if (form == LightFileForm::lp) {
        if (words.size() < 4) throw bad_line(path, line.number, "a name and x y z are needed");
        light.file = name_in(line);
        words.erase(words.begin(), words.end() - 3);
    } else {
        words = split_at_commas(words);
        if (words.size() != 3)
            throw bad_line(path, line.number, fmt::format("x y z are needed, but {} values are there", words.size()));
    }
    light.direction = vector_in(path, line, words);
    const double norm = light.direction.norm();
    if (!std::isfinite(norm)) throw bad_line(path, line.number, "the vector is too long to have a length");
    if (norm < shortest_vector)
        throw bad_line(path, line.number,
                       fmt::format("the vector's length is {:.2g}, too short for a direction", norm));
    return light;
}

bool looks_like_xyz(const Line& line) {
    const auto words = split_at_commas(line.words);
    return words.size() == 3 &&
           std::all_of(words.begin(), words.end(), [](const auto& w) { return number_in(w).has_value(); });
}

LightFileForm form_of(const std::vector<Line>& lines) {
    if (!count_in(lines.front())) return LightFileForm::bare;
    return lines.size() > 1 && looks_like_xyz(lines[1]) ? LightFileForm::counted : LightFileForm::lp;
}

void require_count(const fs::path& path, const Line& first, std::size_t found) {
    const std::size_t told = *count_in(first);
    if (told != found)
        throw bad_line(path, first.number, fmt::format("it announces {} lights, but {} follow", told, found));
}

/// Two lines for one photograph contradict each other, and nobody can say which of them holds.
void require_different_names(const fs::path& path, const std::vector<Line>& lines, const Lights& lights) {
    std::map<std::string, std::size_t> line_of;
    for (std::size_t i = 0; i < lights.size(); ++i) {
        const auto [known, added] = line_of.emplace(lights[i].file, lines[i].number);
        if (!added)
            throw InputError(fmt::format("{} names {} twice, in lines {} and {}", path.string(), lights[i].file,
                                         known->second, lines[i].number),
                             "give each photograph one line");
    }
}

bool any_decimal_comma(const std::vector<Line>& lines) {
    return std::any_of(lines.begin(), lines.end(), [](const Line& line) {
        return std::any_of(line.words.begin(), line.words.end(), has_decimal_comma);
    });
}

std::string joined(const Eigen::Vector3d& v) { return fmt::format("{:.9g} {:.9g} {:.9g}\n", v[0], v[1], v[2]); }

}  // namespace

LightFile read_lights(const fs::path& path) {
    std::vector<Line> lines = lines_of(path);
    LightFile file;
    file.form = form_of(lines);
    if (file.form != LightFileForm::bare) {
        require_count(path, lines.front(), lines.size() - 1);
        lines.erase(lines.begin());
    }
    bool unit_length = true;
    for (const Line& line : lines) {
        Light light = light_in(path, line, file.form);
        unit_length = unit_length && std::abs(light.direction.norm() - 1.0) <= unit_tolerance;
        light.direction.normalize();
        file.lights.push_back(light);
    }
    if (file.form == LightFileForm::lp) require_different_names(path, lines, file.lights);
    if (any_decimal_comma(lines))
        file.warnings.push_back(fmt::format("{} has decimal commas; they were read as points", path.string()));
    if (!unit_length)
        file.warnings.push_back(
            fmt::format("{} has vectors that are not of unit length; only their directions count", path.string()));
    return file;
}

std::vector<Eigen::Vector3d> read_light_intensities(const fs::path& path) {
    std::vector<Eigen::Vector3d> intensities;
    for (const Line& line : lines_of(path)) {
        std::vector<std::string> words = split_at_commas(line.words);
        if (words.size() == 1) words.resize(3, words.front());
        if (words.size() != 3) throw bad_line(path, line.number, "r g b, or one number, are needed");
        const Eigen::Vector3d intensity = vector_in(path, line, words);
        if (!(intensity.minCoeff() > 0)) throw bad_line(path, line.number, "an intensity must be above 0");
        intensities.push_back(intensity);
    }
    return intensities;
}

void write_lp(const fs::path& path, const Lights& lights) {
    std::string lines;
    std::size_t count = 0;
    for (const Light& light : lights) {
        if (!light.used) continue;
        std::string name = basename_of(light.file);
        std::replace_if(name.begin(), name.end(), [](char c) { return c == ' ' || c == '\t'; }, '_');
        lines += name + " " + joined(light.direction);
        ++count;
    }
    write_file(path, fmt::format("{}\n{}", count, lines));
}

void write_light_directions(const fs::path& path, const Lights& lights) {
    std::string lines;
    for (const Light& light : lights) lines += joined(light.direction);
    write_file(path, lines);
}

void write_light_intensities(const fs::path& path, const Lights& lights) {
    std::string lines;
    for (const Light& light : lights) lines += joined(light.intensity);
    write_file(path, lines);
}

}  // namespace darkbox
