#include "rig/cli/progress_bar.h"

#include <fmt/format.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>

namespace darkbox {
namespace {

constexpr auto quiet_for = std::chrono::milliseconds(500);
constexpr auto redraw_every = std::chrono::milliseconds(80);
constexpr int bar_cells = 28;
constexpr const char* erase_line = "\r\033[K";

int terminal_columns() {
    winsize size{};
    return ::ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0 ? size.ws_col : 80;
}

std::string time_left(const ProgressUpdate& update, double seconds) {
    if (update.done == 0 || update.done >= update.total || seconds < 1.0) return "";
    const double left = seconds * static_cast<double>(update.total - update.done) / static_cast<double>(update.done);
    return left < 90 ? fmt::format("  {:.0f} s left", left) : fmt::format("  {:.0f} min left", left / 60);
}

}  // namespace

std::string progress_line(const ProgressUpdate& update, double seconds, int columns) {
    std::string line = fmt::format("{:<12}", update.stage);
    if (update.total > 0) {
        const double share = std::min(1.0, static_cast<double>(update.done) / static_cast<double>(update.total));
        const int full = static_cast<int>(share * bar_cells);
        line += fmt::format("[{:#<{}}{:.<{}}] {}/{}{}", "", full, "", bar_cells - full, update.done, update.total,
                            time_left(update, seconds));
    }
    if (!update.detail.empty()) line += "  " + update.detail;
    if (static_cast<int>(line.size()) >= columns) line.resize(static_cast<std::size_t>(std::max(columns - 1, 0)));
    return line;
}

ProgressBar::ProgressBar() : on_terminal_(::isatty(STDERR_FILENO) != 0), start_(Clock::now()) {}

ProgressBar::~ProgressBar() { finish(); }

void ProgressBar::show(const ProgressUpdate& update) {
    if (!on_terminal_) return;
    const std::scoped_lock lock(mutex_);
    const auto now = Clock::now();
    const bool new_stage = update.stage != stage_;
    if (new_stage) {
        stage_ = update.stage;
        stage_start_ = now;
    }
    if (now - start_ < quiet_for || (!new_stage && now - drawn_at_ < redraw_every)) return;
    drawn_at_ = now;
    visible_ = true;
    const double seconds = std::chrono::duration<double>(now - stage_start_).count();
    std::fputs((erase_line + progress_line(update, seconds, terminal_columns())).c_str(), stderr);
    std::fflush(stderr);
}

void ProgressBar::finish() {
    const std::scoped_lock lock(mutex_);
    if (!visible_) return;
    visible_ = false;
    std::fputs(erase_line, stderr);
    std::fflush(stderr);
}

}  // namespace darkbox
