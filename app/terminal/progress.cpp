#include "app/terminal/progress.h"

#include <fmt/format.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <string_view>
#include <system_error>
#include <utility>

#include "app/terminal/failure.h"

namespace mray::app {
namespace {

using namespace std::chrono_literals;

constexpr auto kQuietStart = 200ms;
constexpr auto kInterval = 100ms;
constexpr int kDefaultColumns = 80;
constexpr std::string_view kClearLine = "\r\x1b[K";

bool is_shown(bool quiet) {
    const char* const terminal = std::getenv("TERM");
    return !quiet && ::isatty(STDERR_FILENO) != 0 && terminal != nullptr &&
           terminal != std::string_view() && terminal != std::string_view("dumb");
}

int terminal_columns() {
    winsize size = {};
    return ::ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0 ? size.ws_col
                                                                             : kDefaultColumns;
}

/// The part of everything that is done, from 0 to 1.
double fraction_of(const ProgressState& state) {
    const bool counts = state.total == 0 || state.counts_part;
    const double part = counts ? std::clamp(state.part, 0.0f, 1.0f) : 0;
    if (state.total == 0) return part;
    return std::min((static_cast<double>(state.done) + part) / static_cast<double>(state.total),
                    1.0);
}

std::string remaining_time(double seconds) {
    constexpr double kMinute = 60;
    constexpr double kHour = 3600;
    if (seconds < kMinute) return fmt::format("{:.0f} s left", seconds);
    if (seconds < kHour) return fmt::format("{:.0f} min left", seconds / kMinute);
    return fmt::format("{:.1f} h left", seconds / kHour);
}

// A line that cannot be drawn is no error.
void draw(std::string_view text) {
    [[maybe_unused]] const ssize_t ignored = ::write(STDERR_FILENO, text.data(), text.size());
}

/// Whether another program has the terminal.
bool is_in_background() {
    const pid_t front = ::tcgetpgrp(STDERR_FILENO);
    return front >= 0 && front != ::getpgrp();
}

/// Guards the state of the Progress that exists, and what is written to the terminal.
std::mutex terminal_mutex;
bool has_line = false;

void clear_line() {
    if (std::exchange(has_line, false)) draw(kClearLine);
}

}  // namespace

std::atomic<float>& step_done() {
    static std::atomic<float> part = -1.0f;
    return part;
}

Watch command_watch() { return Watch(&interrupt_flag(), &step_done()); }

std::string progress_line(const ProgressState& state, int columns) {
    constexpr std::size_t kBar = 20;
    const double fraction = fraction_of(state);
    const auto full = static_cast<std::size_t>(fraction * static_cast<double>(kBar));
    std::string line = fmt::format("{} [{}{}] ", state.label, std::string(full, '#'),
                                   std::string(kBar - full, '.'));
    line += state.total > 0 ? fmt::format("{}/{}", std::min(state.done, state.total), state.total)
                            : fmt::format("{:.0f} %", 100 * fraction);
    if (!state.step.empty()) line += "  " + state.step;
    if (fraction > 0 && fraction < 1)
        line += "  " + remaining_time(state.elapsed_s * (1 - fraction) / fraction);
    return line.substr(0, static_cast<std::size_t>(std::max(columns, 0)));
}

Progress::Progress(std::string label, std::uint64_t total, const Messages& messages)
    : state_{.label = std::move(label), .total = total} {
    step_done() = -1;
    if (!is_shown(messages.quiet())) return;
    try {
        thread_ = std::thread([this] { run(); });
    } catch (const std::system_error&) {
        // Without a thread nothing is shown.
    }
}

Progress::~Progress() {
    if (!thread_.joinable()) return;
    {
        const std::scoped_lock lock(terminal_mutex);
        stops_ = true;
        clear_line();
    }
    wakes_.notify_one();
    thread_.join();
}

void Progress::show() {
    if (is_in_background()) return;
    ProgressState state = state_;
    state.elapsed_s = std::chrono::duration<double>(Clock::now() - begin_).count();
    state.part = step_done();
    // Many terminals wrap after the last column.
    const int columns = terminal_columns() - 1;
    draw(fmt::format("{}{}", kClearLine, progress_line(state, columns)));
    has_line = true;
}

void Progress::run() {
    std::unique_lock lock(terminal_mutex);
    if (wakes_.wait_for(lock, kQuietStart, [this] { return stops_; })) return;
    do show();
    while (!wakes_.wait_for(lock, kInterval, [this] { return stops_; }));
}

void Progress::begin(std::string step, bool counts_part) {
    const std::scoped_lock lock(terminal_mutex);
    state_.step = std::move(step);
    state_.counts_part = counts_part;
    step_done() = -1;
}

void Progress::update(std::uint64_t done) {
    const std::scoped_lock lock(terminal_mutex);
    state_.done = done;
    state_.counts_part = false;
}

ProgressPause::ProgressPause() : lock_(terminal_mutex) { clear_line(); }

}  // namespace mray::app
