#include "app/terminal/interrupt.h"

#include <fmt/format.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstdint>
#include <cstring>
#include <mutex>
#include <string_view>

#include "app/terminal/progress.h"
#include "clips/frame_range.h"
#include "common/base/watch.h"
#include "common/text/message_text.h"

namespace mray::app {
namespace {

constexpr std::array<int, 3> kEndings = {SIGINT, SIGTERM, SIGHUP};
constexpr std::array<int, 5> kSignals = {SIGINT, SIGTERM, SIGHUP, SIGPIPE, SIGALRM};

// A signal handler can only use globals.

/// The signal that arrived, or 0.
std::atomic<int> received_signal = 0;
std::atomic<bool> has_received = false;
/// After a signal the process ends at the end of the grace while this is kRuns: not if a thread has
/// begun to end the program. kEnds: the handler is ending it.
enum class Grace { kRuns, kOver, kEnds };
std::atomic<Grace> grace = Grace::kRuns;
/// The EndOfGrace that live.
std::atomic<int> ways_out = 0;

/// Returns whether it is over; if not, the process is ending.
bool let_grace_be_over() {
    Grace before = Grace::kRuns;
    return grace.compare_exchange_strong(before, Grace::kOver) || before == Grace::kOver;
}

/// The path of RemovedAtEnd, or null.
std::atomic<const char*> removed_folder = nullptr;
/// Sends SIGALRM at the end of the grace; meaningful if has_timer.
timer_t timer;
std::atomic<bool> has_timer = false;
static_assert(std::atomic<bool>::is_always_lock_free && std::atomic<Grace>::is_always_lock_free &&
              std::atomic<std::int64_t>::is_always_lock_free);  // required in a signal handler

/// The lines for kEndings, as they are written.
struct Lines {
    std::array<std::array<char, 8192>, kEndings.size()> text;
    std::array<std::size_t, kEndings.size()> size;
};
/// The ones that the handler reads are not written to: the others are filled and take their place.
std::array<Lines, 2> both_lines;
std::atomic<std::size_t> read_lines = 0;

std::mutex results_mutex;
/// As tell_results() was told.
std::string results_finished;
std::string results_place;

const char* name_of(int signal) {
    if (signal == SIGTERM) return "terminated";
    return signal == SIGHUP ? "hung up" : "interrupted";
}

/// The caller holds the mutex.
std::string message_of(int signal) {
    if (results_finished.empty() && results_place.empty())
        return fmt::format("{}; finished results are kept", name_of(signal));
    std::string text = name_of(signal);
    if (!results_finished.empty()) text += "; " + results_finished;
    if (!results_place.empty()) text += "; finished results are in " + results_place;
    return text;
}

/// The caller holds the mutex.
void prepare_lines() {
    const std::size_t other = 1 - read_lines.load();
    Lines& lines = both_lines[other];
    for (std::size_t i = 0; i < kEndings.size(); ++i) {
        const std::string line = "morphray: " + shown(message_of(kEndings[i])) + '\n';
        const std::size_t size = std::min(line.size(), lines.text[i].size());
        std::memcpy(lines.text[i].data(), line.data(), size);
        lines.text[i][size - 1] = '\n';
        lines.size[i] = size;
    }
    read_lines.store(other);
}

void set_handler(int signal, void (*handler)(int)) {
    struct sigaction action = {};
    action.sa_handler = handler;
    action.sa_flags = SA_RESTART;
    sigemptyset(&action.sa_mask);
    sigaction(signal, &action, nullptr);
}

constexpr std::int64_t kNsPerMs = 1'000'000;
constexpr std::int64_t kNsPerSecond = 1'000'000'000;

std::int64_t now_ns() {
    timespec now = {};
    clock_gettime(CLOCK_MONOTONIC, &now);
    return now.tv_sec * kNsPerSecond + now.tv_nsec;
}

/// When the grace ends.
std::atomic<std::int64_t> end_ns = 0;

void end_grace_at(std::int64_t ns) {
    if (!has_timer.load()) return;
    itimerspec end = {};
    end.it_value.tv_sec = ns / kNsPerSecond;
    end.it_value.tv_nsec = ns % kNsPerSecond;
    timer_settime(timer, TIMER_ABSTIME, &end, nullptr);
}

void on_signal(int signal) {
    received_signal.store(signal);
    has_received.store(true);
    for (const int next : kEndings) set_handler(next, SIG_DFL);
    const int error = errno;
    end_ns.store(now_ns() + InterruptGuard::kGraceMs * kNsPerMs);
    end_grace_at(end_ns.load());
    errno = error;
}

/// Removes the folder of RemovedAtEnd by another program, because a walk through a folder takes
/// memory, which a signal handler must not ask for. _Fork() runs no handlers of others.
void remove_folder_in_handler() {
    const char* const folder = removed_folder.load();
    if (folder == nullptr) return;
    const pid_t child = ::_Fork();
    if (child == 0) {
        ::execl("/bin/rm", "rm", "-rf", "--", folder, static_cast<char*>(nullptr));
        ::_exit(1);
    }
    if (child > 0) ::waitpid(child, nullptr, 0);
}

/// The grace has ended. Only calls that a signal handler may make.
void on_end_of_grace(int) {
    Grace runs = Grace::kRuns;
    if (received_signal.load() == 0 || !grace.compare_exchange_strong(runs, Grace::kEnds)) return;
    clear_progress_in_handler();
    const Lines& lines = both_lines[read_lines.load()];
    for (std::size_t i = 0; i < kEndings.size(); ++i) {
        if (received_signal.load() != kEndings[i]) continue;
        [[maybe_unused]] const ssize_t ignored =
            ::write(STDERR_FILENO, lines.text[i].data(), lines.size[i]);
    }
    remove_folder_in_handler();
    ::_exit(static_cast<int>(interrupt_exit_code()));
}

}  // namespace

InterruptGuard::InterruptGuard() : before_() {
    received_signal.store(0);
    has_received.store(false);
    grace.store(Grace::kRuns);
    tell_results({}, {});
    for (std::size_t i = 0; i < kSignals.size(); ++i) sigaction(kSignals[i], nullptr, &before_[i]);
    set_handler(SIGALRM, on_end_of_grace);
    sigevent event = {};
    event.sigev_notify = SIGEV_SIGNAL;
    event.sigev_signo = SIGALRM;
    // Without a timer, for which there may be no memory, work still polls interrupted().
    has_timer.store(::timer_create(CLOCK_MONOTONIC, &event, &timer) == 0);
    for (std::size_t i = 0; i < kSignals.size() - 1; ++i) {
        if (before_[i].sa_handler == SIG_IGN) continue;
        set_handler(kSignals[i], kSignals[i] == SIGPIPE ? SIG_IGN : on_signal);
    }
}

InterruptGuard::~InterruptGuard() {
    let_grace_be_over();
    for (std::size_t i = 0; i < kSignals.size() - 1; ++i)
        sigaction(kSignals[i], &before_[i], nullptr);
    if (has_timer.exchange(false)) ::timer_delete(timer);
    sigaction(kSignals.back(), &before_.back(), nullptr);
}

const std::atomic<bool>& interrupt_flag() { return has_received; }

bool interrupted() { return received_signal.load() != 0; }

std::string interrupt_message() {
    const std::scoped_lock lock(results_mutex);
    return message_of(received_signal.load());
}

void tell_results(const std::string& finished, const std::string& place) {
    const std::scoped_lock lock(results_mutex);
    results_finished = finished;
    results_place = place;
    // After a signal the handler may read the lines, so that they change no more.
    if (!interrupted()) prepare_lines();
}

RemovedAtEnd::RemovedAtEnd(const std::filesystem::path& folder)
    : folder_(std::filesystem::absolute(folder).string()) {
    removed_folder.store(folder_.c_str());
}

RemovedAtEnd::~RemovedAtEnd() { removed_folder.store(nullptr); }

std::string finished_text(const std::string& unit, std::span<const double> finished,
                          std::size_t total) {
    if (finished.empty() && total == 1) return fmt::format("the {} is not done", unit);
    const std::string all = fmt::format("of {} {}{}", total, unit, total == 1 ? "" : "s");
    if (finished.empty()) return fmt::format("none {} is done", all);
    std::string text =
        fmt::format("{} {} {} done", finished.size(), all, finished.size() == 1 ? "is" : "are");
    // Fractions of frames may make it much longer than a line.
    constexpr std::size_t kMostCharacters = 60;
    if (const std::string range = frame_range_text(finished); range.size() <= kMostCharacters)
        text += fmt::format(" ({})", range);
    return text;
}

void throw_if_interrupted() {
    if (!interrupted()) return;
    // A thread that is waited for on the way out leaves the limit of the wait as it is.
    if (ways_out.load() == 0) let_grace_be_over();
    throw Error(ErrorKind::kCancelled, kWorkCancelled);
}

ExitCode interrupt_exit_code() {
    const int signal = received_signal.load();
    if (signal == SIGHUP) return ExitCode::kHungUp;
    return signal == SIGTERM ? ExitCode::kTerminated : ExitCode::kInterrupted;
}

EndOfGrace::EndOfGrace() : is_set_(interrupted()) {
    if (!is_set_ || ways_out.fetch_add(1) > 0) return;
    constexpr std::int64_t kLeastMs = 30;
    Grace over = Grace::kOver;
    grace.compare_exchange_strong(over, Grace::kRuns);
    end_grace_at(std::max(end_ns.load(), now_ns() + kLeastMs * kNsPerMs));
}

EndOfGrace::~EndOfGrace() {
    if (!is_set_ || ways_out.fetch_sub(1) > 1 || let_grace_be_over()) return;
    // The handler, which runs in another thread, ends the process.
    for (;;) ::pause();
}

}  // namespace mray::app
