#include "app/terminal/progress.h"

#include <fmt/format.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <new>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include "app/base/numbers.h"
#include "app/terminal/interrupt.h"

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

/// Units that are done, with the part of one that is.
double done_of(const ProgressState& state) {
    const bool counts = state.counts_part == StepPart::kCounted;
    const double part = counts ? std::clamp(state.part, 0.0f, 1.0f) : 0;
    return std::min(static_cast<double>(state.done) + part, static_cast<double>(state.total));
}

/// The part of everything that is done, from 0 to 1.
double fraction_of(const ProgressState& state) {
    if (state.total > 0) return done_of(state) / static_cast<double>(state.total);
    return std::clamp(state.part, 0.0f, 1.0f);
}

/// Seconds that the remaining units will take, or the rest of the only step; negative if that
/// cannot be told yet, or no more.
double seconds_left(const ProgressState& state) {
    if (state.total == 0) {
        const float part = state.part;
        return part > 0 && part < 1 ? state.elapsed_s * (1 - part) / part : -1;
    }
    const double done = done_of(state);
    if (!(done > 0) || state.done >= state.total) return -1;
    return state.counted_s * (static_cast<double>(state.total) - done) / done;
}

std::string left_text(const ProgressState& state) {
    const double left = seconds_left(state);
    return left < 0 ? std::string() : remaining_time(left);
}

/// "1.2 frames/s" or "3.4 s/frame".
std::string rate_text(const ProgressState& state) {
    const double done = done_of(state);
    if (state.unit.empty() || !(done > 0) || !(state.counted_s > 0)) return {};
    const double rate = done / state.counted_s;
    if (rate < 1) return fmt::format("{:.1f} s/{}", 1 / rate, state.unit);
    if (rate < 100) return fmt::format("{:.1f} {}s/s", rate, state.unit);
    return fmt::format("{} {}s/s", brief_count(rate), state.unit);
}

/// Thousandths of the step that are done, rounded down; -1 if that is not known.
int thousandths_of(const ProgressState& state) {
    if (!(state.part >= 0)) return -1;
    return static_cast<int>(std::min(state.part, 1.0f) * 1000);
}

/// "43.2 %".
std::string percent_text(const ProgressState& state) {
    const int thousandths = thousandths_of(state);
    return fmt::format("{}.{} %", thousandths / 10, thousandths % 10);
}

/// "frame 12 43.2 %".
std::string step_text(const ProgressState& state) {
    if (state.step.empty() || !(state.part >= 0)) return state.step;
    return fmt::format("{} {}", state.step, percent_text(state));
}

std::size_t width_of(const std::vector<std::string>& texts) {
    std::size_t width = 0;
    for (const std::string& text : texts) width += text.empty() ? 0 : text.size() + 2;
    return width;
}

// A line that cannot be drawn is no error.
void draw(int fd, std::string_view text) {
    [[maybe_unused]] const ssize_t ignored = ::write(fd, text.data(), text.size());
}

/// Whether another program has the terminal.
bool is_in_background(int fd) {
    const pid_t front = ::tcgetpgrp(fd);
    return front >= 0 && front != ::getpgrp();
}

/// Guards the state of the Progress that exists, and what is written to the terminal.
std::mutex terminal_mutex;
/// The terminal that shows a line, or -1.
std::atomic<int> line_fd = -1;

void clear_line() {
    const int fd = line_fd.exchange(-1);
    if (fd >= 0) draw(fd, kClearLine);
}

}  // namespace

std::atomic<float>& step_done() {
    static std::atomic<float> part = -1.0f;
    return part;
}

Watch command_watch() { return Watch(&interrupt_flag(), &step_done()); }

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

std::string progress_text_line(const ProgressState& state) {
    std::string line =
        fmt::format("{} {}/{}", state.label, std::min(state.done, state.total), state.total);
    for (const std::string& text : {step_text(state), left_text(state)})
        if (!text.empty()) line += "  " + text;
    return line + '\n';
}

std::string progress_json_line(const ProgressState& state) {
    const double left = seconds_left(state);
    return fmt::format(
        R"({{"schema": "morphray/1", "progress": "{}", "done": {}, "total": {}, "step": {}, )"
        R"("part": {}, "elapsed_s": {:.3f}, "left_s": {}}})"
        "\n",
        state.label, std::min(state.done, state.total), state.total,
        state.step.empty() ? "null" : fmt::format("\"{}\"", state.step),
        state.part < 0 ? "null" : fmt::format("{:.4f}", std::min(state.part, 1.0f)),
        state.elapsed_s, left < 0 ? "null" : fmt::format("{:.3f}", left));
}

std::string progress_line(const ProgressState& state, int columns, ProgressMode mode) {
    const auto room = static_cast<std::size_t>(std::max(columns, 0));
    const bool counts = state.total > 0;
    const bool has_bar = counts || state.part >= 0;
    std::string count;
    if (counts) {
        count = fmt::format("{}/{}", std::min(state.done, state.total), state.total);
    } else {
        count = has_bar ? percent_text(state) : fmt::format("{:.0f} s", state.elapsed_s);
    }
    std::string rate = rate_text(state);
    std::string step = step_text(state);
    std::string left = left_text(state);
    const std::size_t fixed = state.label.size() + 1 + count.size();
    if (fixed > room) return (state.label + ' ' + count).substr(0, room);
    // A bar of the least width, and the space before it.
    constexpr std::size_t kBarRoom = kMinBar + 1;
    for (std::string* text : {&rate, &step, &left})
        if (fixed + kBarRoom + width_of({step, rate, left}) > room) text->clear();
    std::string line = state.label + ' ';
    const std::size_t others = fixed + 1 + width_of({step, rate, left});
    if (has_bar && others + kMinBar <= room) {
        const auto width = static_cast<int>(std::min<std::size_t>(kMaxBar, room - others));
        line += bar(fraction_of(state), width, mode) + ' ';
    }
    line += count;
    for (const std::string& text : {step, rate, left})
        if (!text.empty()) line += "  " + text;
    return line;
}

Progress::Progress(std::string label, const char* unit, std::uint64_t total, ProgressMode mode,
                   int fd)
    : state_{.label = std::move(label), .unit = unit, .total = total}, mode_(mode), fd_(fd) {
    const bool is_line = mode_ == ProgressMode::kPlain || mode_ == ProgressMode::kColour;
    if (total == 0 && !is_line) mode_ = ProgressMode::kOff;
    step_done() = -1;
    if (mode_ == ProgressMode::kOff) return;
    if (mode_ == ProgressMode::kJson) show();
    try {
        thread_ = std::thread([this] { run(); });
    } catch (const std::system_error&) {
        // Without a thread nothing is shown.
    } catch (const std::bad_alloc&) {
    }
}

Progress::~Progress() { stop(); }

void Progress::stop() {
    if (!thread_.joinable()) return;
    {
        const std::scoped_lock lock(terminal_mutex);
        stops_ = true;
        clear_line();
    }
    wakes_.notify_one();
    thread_.join();
}

ProgressState Progress::now() const {
    const auto seconds_since = [](Clock::time_point from) {
        return std::chrono::duration<double>(Clock::now() - from).count();
    };
    ProgressState state = state_;
    state.elapsed_s = seconds_since(begin_);
    state.counted_s = seconds_since(counted_from_);
    state.part = step_done();
    if (state.total > 0 && state.counts_part == StepPart::kHidden) state.part = -1;
    return state;
}

void Progress::show() {
    const ProgressState state = now();
    if (mode_ == ProgressMode::kLines || mode_ == ProgressMode::kJson) {
        const std::tuple shown(state.done, state.step, thousandths_of(state));
        // finish() writes the last one.
        if (shown == shown_ || (state.done >= state.total && !stops_)) return;
        shown_ = shown;
        draw(fd_,
             mode_ == ProgressMode::kJson ? progress_json_line(state) : progress_text_line(state));
        return;
    }
    if (is_in_background(fd_)) return;
    // Many terminals wrap after the last column.
    const int columns = terminal_columns(fd_) - 1;
    draw(fd_, fmt::format("{}{}", kClearLine, progress_line(state, columns, mode_)));
    line_fd = fd_;
}

void Progress::run() {
    const bool is_line = mode_ == ProgressMode::kPlain || mode_ == ProgressMode::kColour;
    const std::chrono::milliseconds interval =
        mode_ == ProgressMode::kLines ? std::chrono::milliseconds(kLineInterval) : kInterval;
    std::unique_lock lock(terminal_mutex);
    if (is_line && wakes_.wait_for(lock, kQuietStart, [this] { return stops_; })) return;
    if (is_line) show();
    while (!wakes_.wait_for(lock, interval, [this] { return stops_; })) show();
}

void Progress::set_step(std::string step, StepPart part) {
    state_.step = std::move(step);
    state_.counts_part = part;
    step_done() = -1;
}

void Progress::begin(std::string step, StepPart part) {
    const std::scoped_lock lock(terminal_mutex);
    if (!std::exchange(has_begun_, true)) counted_from_ = Clock::now();
    set_step(std::move(step), part);
}

void Progress::prepare(std::string step) {
    const std::scoped_lock lock(terminal_mutex);
    set_step(std::move(step), StepPart::kShown);
}

void Progress::update(std::uint64_t done) {
    const std::scoped_lock lock(terminal_mutex);
    state_.done = done;
    if (state_.counts_part == StepPart::kCounted) state_.counts_part = StepPart::kShown;
}

void Progress::finish() {
    stop();
    if (mode_ == ProgressMode::kOff || state_.total == 0) return;
    state_.done = state_.total;
    set_step({}, StepPart::kHidden);
    if (mode_ == ProgressMode::kLines) draw(fd_, progress_text_line(now()));
    if (mode_ == ProgressMode::kJson) draw(fd_, progress_json_line(now()));
    mode_ = ProgressMode::kOff;
}

ProgressPause::ProgressPause() : lock_(terminal_mutex) { clear_line(); }

}  // namespace mray::app
