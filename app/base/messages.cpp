#include "app/base/messages.h"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <signal.h>
#include <unistd.h>

#include <cmath>
#include <condition_variable>
#include <cstdlib>
#include <filesystem>
#include <mutex>
#include <new>
#include <set>

#include "common/base/output_file.h"
#include "common/base/watch.h"
#include "common/text/text.h"

namespace mray::app {
namespace {

std::atomic<int> received_signal = SIGINT;
std::atomic<bool> has_received = false;
static_assert(std::atomic<int>::is_always_lock_free && std::atomic<bool>::is_always_lock_free);

void on_signal(int signal) {
    if (has_received.exchange(true)) ::_exit(128 + signal);
    received_signal = signal;
}

const char* hint_text(Hint hint) {
    return hint == Hint::kLenient          ? " or accept it with --lenient"
           : hint == Hint::kReplaceMissing ? ", or use --skip-missing"
                                           : "";
}

constexpr const char* kStdout = "/dev/stdout";
constexpr const char* kProgram = "morphray: ";

constexpr std::string_view kClearLine = "\r\x1b[K";
/// A line that wraps cannot be cleared.
constexpr std::size_t kProgressColumns = 79;

/// Guards the terminal, which stdout and stderr may be, and the line of progress on it.
std::mutex terminal_mutex;
bool has_line = false;

void write_stderr(std::string_view text) { std::fwrite(text.data(), 1, text.size(), stderr); }

void clear_line() {
    if (std::exchange(has_line, false)) write_stderr(kClearLine);
}

void write_line(const char* prefix, std::string_view message) {
    const std::scoped_lock lock(terminal_mutex);
    clear_line();
    write_stderr(prefix + escape(std::string(message)) + '\n');
}

bool shows_progress() {
    const char* const terminal = std::getenv("TERM");
    return ::isatty(STDERR_FILENO) != 0 && terminal != nullptr && terminal != std::string_view() &&
           terminal != std::string_view("dumb");
}

}  // namespace

// The library's errors have the order of the program's, which is that of the codes from kUsage.
static_assert(static_cast<int>(morphray::ErrorCode::device_lost) ==
              static_cast<int>(ErrorKind::kDeviceLost));
static_assert(static_cast<int>(ExitCode::kDeviceLost) - static_cast<int>(ExitCode::kUsage) ==
              static_cast<int>(ErrorKind::kDeviceLost));

ErrorKind kind_of(morphray::ErrorCode code) {
    if (code == morphray::ErrorCode::cancelled) return ErrorKind::kCancelled;
    return code <= morphray::ErrorCode::device_lost ? static_cast<ErrorKind>(code)
                                                    : ErrorKind::kInternal;
}

ExitCode exit_code_of(ErrorKind kind) {
    if (kind == ErrorKind::kCancelled) return static_cast<ExitCode>(128 + interrupt_signal());
    if (kind == ErrorKind::kInternal) return ExitCode::kInternal;
    return static_cast<ExitCode>(static_cast<int>(ExitCode::kUsage) + static_cast<int>(kind));
}

std::string message_of(const Error& error) {
    // Work that was given the flag of the signal does not know of signals.
    if (error.what() == std::string(kWorkCancelled))
        return std::string(interrupt_signal() == SIGTERM ? "terminated" : "interrupted") +
               "; finished results are kept";
    return std::string(error.what()) + hint_text(error.hint());
}

Failure describe_failure(const std::exception_ptr& failure) {
    std::string internal;
    try {
        std::rethrow_exception(failure);
    } catch (const Error& error) {
        return {message_of(error), exit_code_of(error.kind())};
    } catch (const std::bad_alloc&) {
        return {kOutOfMemory, ExitCode::kLimit};
    } catch (const std::length_error&) {
        return {"something is larger than memory can be; choose a smaller scene or image",
                ExitCode::kLimit};
    } catch (const std::exception& error) {
        if (is_out_of_threads(error)) return {kOutOfThreads, ExitCode::kLimit};
        internal = error.what();
    } catch (...) {
        internal = "unknown exception";
    }
    // OpenEXR gives it names of its own.
    if (is_out_of_memory) return {kOutOfMemory, ExitCode::kLimit};
    return {fmt::format("internal error: {}; please report it", internal), ExitCode::kInternal};
}

void handle_signals() {
    for (const int signal : {SIGINT, SIGTERM, SIGHUP})
        if (::signal(signal, on_signal) == SIG_IGN) ::signal(signal, SIG_IGN);
    ::signal(SIGPIPE, SIG_IGN);
}

const std::atomic<bool>& interrupt_flag() { return has_received; }

int interrupt_signal() { return received_signal; }

void throw_if_interrupted() {
    if (interrupted()) throw Error(ErrorKind::kCancelled, kWorkCancelled);
}

void Messages::error(const Failure& failure) const {
    const bool begins_with_file =
        failure.code == ExitCode::kBadInput || failure.code == ExitCode::kOutput;
    write_line(begins_with_file ? "" : kProgram, failure.message);
}

void Messages::warn(const Warning& warning) const {
    static std::mutex mutex;
    const std::scoped_lock lock(mutex);
    std::string line = warning.line(hint_text(warning.hint));
    if (!warnings_.empty() && warnings_.back() == line) return;
    warnings_.push_back(std::move(line));
    write_line(warning.place.empty() ? kProgram : "", warnings_.back());
}

void Messages::tell(std::string_view message) const {
    if (!quiet_) write_line(kProgram, message);
}

void Messages::note(std::string_view message) const {
    if (verbose_) write_line(kProgram, message);
}

void Messages::print(std::string_view text) const {
    if (quiet_ || text.empty()) return;
    const std::scoped_lock lock(terminal_mutex);
    clear_line();
    write_file(kStdout, text);
}

Progress::Progress(std::string label, std::uint64_t total, const Messages& messages)
    : label_(std::move(label)), total_(total), is_shown_(!messages.quiet() && shows_progress()) {
    if (!is_shown_) return;
    clock_ = std::jthread([this](const std::stop_token& stop) {
        std::condition_variable_any wake;
        std::unique_lock lock(terminal_mutex);
        do draw();
        while (!wake.wait_for(lock, stop, std::chrono::milliseconds(500),
                              [&] { return stop.stop_requested(); }));
    });
}

Progress::~Progress() {
    // Ends it.
    clock_ = {};
    const std::scoped_lock lock(terminal_mutex);
    clear_line();
}

void Progress::begin(std::string step) {
    const std::scoped_lock lock(terminal_mutex);
    step_ = std::move(step);
    draw();
}

void Progress::update(std::uint64_t done) {
    const std::scoped_lock lock(terminal_mutex);
    done_ = done;
    share = 0;
    draw();
}

/// The terminal's mutex is locked.
void Progress::draw() const {
    if (!is_shown_) return;
    std::string line = label_;
    if (total_ > 0) line += fmt::format(" {}/{}", done_, total_);
    if (!step_.empty()) line += "  " + step_;
    if (share > 0) line += fmt::format(", {:.0f}%", 100 * share);
    const double units = static_cast<double>(done_) + share;
    const double seconds = since_.ms() / 1e3;
    const double left = seconds * (static_cast<double>(total_) / units - 1);
    // Earlier estimates jump.
    if (seconds > 2 && units > 0 && left > 0)
        line += fmt::format(", {:%T} to go", std::chrono::seconds(std::lround(left)));
    write_stderr(fmt::format("{}{}", kClearLine, line.substr(0, kProgressColumns)));
    has_line = true;
}

void write_report(const std::string& file, std::string_view text) {
    write_file(file == "-" ? kStdout : file, text);
}

void attempt(Failure& failure, const Messages& messages, const std::function<void()>& work) {
    try {
        work();
    } catch (...) {
        const Failure now = describe_failure(std::current_exception());
        messages.error(now);
        if (failure.code == ExitCode::kOk || failure.code == ExitCode::kPartial) failure = now;
    }
}

ExitCode write_reports(ExitCode work, const Messages& messages,
                       std::initializer_list<Report> reports,
                       const std::function<std::string()>& text, const std::string& verdict) {
    Failure failure{{}, work};
    bool is_shown = true;
    for (const Report& report : reports) {
        if (report.first.empty()) continue;
        is_shown = is_shown && !is_stdout(report.first);
        attempt(failure, messages, [&] { write_report(report.first, report.second()); });
    }
    if (is_shown) attempt(failure, messages, [&] { messages.print(text()); });
    if (work == ExitCode::kCheckFailed && (messages.quiet() || !is_shown))
        messages.error({verdict, work});
    return failure.code;
}

void require_distinct(const std::vector<std::string>& files) {
    namespace fs = std::filesystem;
    std::set<fs::path> places;
    for (const std::string& file : files) {
        std::error_code error;
        if (file.empty() || (fs::is_other(file, error) && !is_stdout(file))) continue;
        const fs::path place = is_stdout(file) ? "-" : fs::absolute(file, error).lexically_normal();
        if (!places.insert(place).second)
            throw Error(ErrorKind::kBadArgument,
                        "two outputs go to {}; a file or stdout takes one report", quote(file));
    }
}

void check_reports(const std::vector<std::string>& files) {
    require_distinct(files);
    for (const std::string& file : files) {
        if (!file.empty() && file != "-") check_writable(file);
    }
}

bool is_stdout(std::string_view file) { return file == "-" || file == kStdout; }

}  // namespace mray::app
