#include "app/terminal/progress.h"

#include <fmt/format.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <string_view>
#include <utility>

namespace mray::app {
namespace {

using namespace std::chrono_literals;

constexpr auto kQuietStart = 200ms;
constexpr auto kInterval = 100ms;
constexpr auto kLineInterval = 1s;
constexpr int kMaxBar = 40;
constexpr int kMinBar = 4;
constexpr int kDefaultColumns = 80;
constexpr std::string_view kClearLine = "\r\x1b[K";

std::string_view environment(const char* name) {
    const char* value = std::getenv(name);
    return value == nullptr ? std::string_view() : value;
}

int terminal_columns(int fd) {
    winsize size = {};
    return ::ioctl(fd, TIOCGWINSZ, &size) == 0 && size.ws_col > 0 ? size.ws_col : kDefaultColumns;
}

std::string remaining_time(double seconds) {
    constexpr double kMinute = 60;
    constexpr double kHour = 3600;
    if (seconds < kMinute) return fmt::format("{:.0f} s left", seconds);
    if (seconds < kHour) return fmt::format("{:.0f} min left", seconds / kMinute);
    return fmt::format("{:.1f} h left", seconds / kHour);
}

/// "[###...]" of `width` characters in all.
std::string bar(double fraction, int width, ProgressMode mode) {
    const auto cells = static_cast<std::size_t>(width - 2);
    const auto full = static_cast<std::size_t>(fraction * static_cast<double>(cells));
    const std::string done(full, '#');
    const std::string open(cells - full, '.');
    if (mode == ProgressMode::kColour) return fmt::format("[\x1b[32m{}\x1b[0m{}]", done, open);
    return fmt::format("[{}{}]", done, open);
}

/// Seconds that the remaining steps will take; negative if that cannot be told yet.
double seconds_left(std::uint64_t done, std::uint64_t total, double elapsed_s) {
    if (done == 0) return -1;
    return elapsed_s * static_cast<double>(total - done) / static_cast<double>(done);
}

// A bar that cannot be drawn is no error.
void draw(int fd, std::string_view text) {
    [[maybe_unused]] const ssize_t ignored = ::write(fd, text.data(), text.size());
}

}  // namespace

ProgressMode progress_mode(bool quiet, int fd) {
    const std::string_view terminal = environment("TERM");
    if (quiet || ::isatty(fd) == 0 || terminal.empty() || terminal == "dumb") {
        return ProgressMode::kOff;
    }
    return environment("NO_COLOR").empty() ? ProgressMode::kColour : ProgressMode::kPlain;
}

ProgressMode progress_mode(const Options& options) {
    switch (options.progress) {
        case ProgressChoice::kPlain:
            return ProgressMode::kLines;
        case ProgressChoice::kJson:
            return ProgressMode::kJson;
        case ProgressChoice::kOff:
            return ProgressMode::kOff;
        default:
            return progress_mode(options.quiet);
    }
}

std::string progress_text_line(const std::string& label, std::uint64_t done, std::uint64_t total,
                               double elapsed_s) {
    done = std::min(done, total);
    const double left = seconds_left(done, total, elapsed_s);
    return fmt::format("{} {}/{}{}\n", label, done, total,
                       left >= 0 && done < total ? "  " + remaining_time(left) : "");
}

std::string progress_json_line(const std::string& label, std::uint64_t done, std::uint64_t total,
                               double elapsed_s) {
    done = std::min(done, total);
    const double left = seconds_left(done, total, elapsed_s);
    return fmt::format(R"({{"schema": "morphray/1", "progress": "{}", "done": {}, "total": {}, )"
                       R"("elapsed_s": {:.3f}, "left_s": {}}})"
                       "\n",
                       label, done, total, elapsed_s,
                       left < 0 ? "null" : fmt::format("{:.3f}", left));
}

std::string progress_line(const std::string& label, std::uint64_t done, std::uint64_t total,
                          double elapsed_s, int columns, ProgressMode mode) {
    done = std::min(done, total);
    const double fraction =
        total == 0 ? 1.0 : static_cast<double>(done) / static_cast<double>(total);
    const std::string count = fmt::format("{}/{}", done, total);
    std::string estimate;
    if (done > 0 && done < total) {
        estimate = "  " + remaining_time(elapsed_s * (1 - fraction) / fraction);
    }
    const auto room = static_cast<std::size_t>(std::max(columns, 0));
    std::size_t fixed = label.size() + 1 + count.size();
    if (fixed > room) return (label + ' ' + count).substr(0, room);
    if (fixed + estimate.size() > room) estimate.clear();
    fixed += estimate.size() + 1;
    const int bar_width = std::min(kMaxBar, static_cast<int>(room) - static_cast<int>(fixed));
    if (bar_width < kMinBar) return fmt::format("{} {}{}", label, count, estimate);
    return fmt::format("{} {} {}{}", label, bar(fraction, bar_width, mode), count, estimate);
}

Progress::Progress(std::string label, std::uint64_t total, ProgressMode mode, int fd)
    : label_(std::move(label)),
      total_(total),
      mode_(mode),
      fd_(fd),
      next_draw_(begin_ + kQuietStart) {
    if (mode_ == ProgressMode::kLines) next_draw_ = begin_ + kLineInterval;
    if (mode_ == ProgressMode::kJson) write_line(0);
}

double Progress::elapsed_s() const {
    return std::chrono::duration<double>(Clock::now() - begin_).count();
}

void Progress::write_line(std::uint64_t done) {
    const bool is_json = mode_ == ProgressMode::kJson;
    draw(fd_, is_json ? progress_json_line(label_, done, total_, elapsed_s())
                      : progress_text_line(label_, done, total_, elapsed_s()));
    next_draw_ = Clock::now();
    if (is_json)
        next_draw_ += kInterval;
    else
        next_draw_ += kLineInterval;
}

void Progress::finish() {
    if (mode_ == ProgressMode::kLines || mode_ == ProgressMode::kJson) write_line(total_);
    hide();
    mode_ = ProgressMode::kOff;
}

void Progress::update(std::uint64_t done) {
    if (mode_ == ProgressMode::kOff) return;
    const Clock::time_point now = Clock::now();
    if (now < next_draw_) return;
    if (mode_ == ProgressMode::kLines || mode_ == ProgressMode::kJson) {
        // finish() writes the last one.
        if (done < total_) write_line(done);
        return;
    }
    next_draw_ = now + kInterval;
    // Many terminals wrap after the last column.
    const int columns = terminal_columns(fd_) - 1;
    draw(fd_, fmt::format("{}{}", kClearLine,
                          progress_line(label_, done, total_, elapsed_s(), columns, mode_)));
    visible_ = true;
}

void Progress::hide() {
    if (!visible_) return;
    draw(fd_, kClearLine);
    visible_ = false;
    next_draw_ = Clock::now();
}

}  // namespace mray::app
