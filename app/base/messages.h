// Exit codes, signals, and output to the terminal: results to stdout, everything else to stderr.
#pragma once

#include <atomic>
#include <exception>
#include <initializer_list>
#include <thread>
#include <vector>

#include "common/base/errors.h"
#include "common/frame_times.h"
#include "morphray/error.hpp"

namespace mray::app {

enum class ExitCode : int {
    kOk = 0,
    kCheckFailed = 1,
    kUsage = 2,
    kBadInput = 3,
    kUnavailable = 4,
    kOutput = 5,
    kLimit = 6,
    kDeviceLost = 7,
    kPartial = 8,
    kInternal = 70,
    kHungUp = 129,
    kInterrupted = 130,
    kTerminated = 143,
};

/// The kind of error that has the exit code of this one.
ErrorKind kind_of(morphray::ErrorCode code);

/// Calls `work` of the library; its errors come out as those of the program.
template <class Work>
decltype(auto) call_library(Work&& work) {
    try {
        return std::forward<Work>(work)();
    } catch (const morphray::Error& error) {
        throw Error(kind_of(error.code()), error.what());
    }
}

/// kCancelled has the code of its signal.
ExitCode exit_code_of(ErrorKind kind);

/// With the option that would avoid the error.
std::string message_of(const Error& error);

struct Failure {
    /// One line, which says what to do.
    std::string message;
    ExitCode code = ExitCode::kOk;
};

/// Whether an allocation has failed.
inline std::atomic<bool> is_out_of_memory = false;

Failure describe_failure(const std::exception_ptr& failure);

/// The first signal sets the flag, the second ends the process. Ignored ones (nohup) stay so.
void handle_signals();

/// The flag is true once a signal has arrived. Calls that can be cancelled take it.
const std::atomic<bool>& interrupt_flag();
inline bool interrupted() { return interrupt_flag().load(); }
/// The signal that has arrived; SIGINT without one.
int interrupt_signal();

/// Called between pieces of work, so that no file is half written. Throws Error(kCancelled).
void throw_if_interrupted();

/// All members may be called from any thread, warnings() while no other one warns.
class Messages {
public:
    explicit Messages(bool quiet = false, bool verbose = false)
        : quiet_(quiet), verbose_(verbose) {}

    /// Writes a line to stderr, with "morphray: " unless it begins with a file. Ignores failures.
    void error(const Failure& failure) const;
    /// Likewise, unless it repeats the warning before.
    void warn(const Warning& warning) const;
    /// All warnings so far, each as the line that was written without the program's name.
    const std::vector<std::string>& warnings() const { return warnings_; }
    /// As error(), unless --quiet.
    void tell(std::string_view message) const;
    /// As error(), only under --verbose.
    void note(std::string_view message) const;

    /// Writes results to stdout unless --quiet. Throws Error(kOutput) if that fails.
    void print(std::string_view text) const;
    bool quiet() const { return quiet_; }

private:
    bool quiet_;
    bool verbose_;
    mutable std::vector<std::string> warnings_;
};

/// A line on a terminal's stderr such as "rendering 5/10  frame 12, 40%, 00:03:20 to go",
/// drawn twice a second. At most one exists at a time.
class Progress {
public:
    /// `total` units are to be done; 0: they are not counted, the label names the only step.
    Progress(std::string label, std::uint64_t total, const Messages& messages);
    ~Progress();
    Progress(const Progress&) = delete;
    Progress& operator=(const Progress&) = delete;

    void begin(std::string step);
    void update(std::uint64_t done);
    /// The share of the next unit that is done, from 0 to 1.
    std::atomic<double> share = 0;

private:
    void draw() const;

    std::string label_;
    std::uint64_t total_;
    bool is_shown_;
    std::uint64_t done_ = 0;
    std::string step_;
    Stopwatch since_;
    std::jthread clock_;
};

/// Calls work(first, count) for batches of `total` things, until a signal arrives.
template <class Work>
void in_batches(const char* label, std::size_t total, const Messages& messages, const Work& work) {
    constexpr std::size_t kBatch = std::size_t{1} << 16;
    Progress progress(label, total, messages);
    for (std::size_t done = 0; done < total; done += kBatch) {
        throw_if_interrupted();
        progress.update(done);
        work(done, std::min(kBatch, total - done));
    }
}

/// Writes to the file, or to stdout for "-". Throws Error(kOutput).
void write_report(const std::string& file, std::string_view text);

/// Calls work(). What it throws is an error message, and replaces a failure of kOk or kPartial.
void attempt(Failure& failure, const Messages& messages, const std::function<void()>& work);

/// The file, empty if none is wanted, and what makes its text.
using Report = std::pair<std::string, std::function<std::string()>>;

/// Attempts all reports, and to print the text, unless a report takes stdout. If that hides the
/// text of a failed check, stderr has its verdict. Returns the code of work and reports.
ExitCode write_reports(ExitCode work, const Messages& messages,
                       std::initializer_list<Report> reports,
                       const std::function<std::string()>& text, const std::string& verdict = {});

/// Throws Error(kBadArgument) if two of the outputs have one place. Devices take any number.
void require_distinct(const std::vector<std::string>& files);
/// require_distinct, and check_writable for each that is neither empty nor "-".
void check_reports(const std::vector<std::string>& files);

/// Whether the report takes stdout: "-" or /dev/stdout.
bool is_stdout(std::string_view file);

}  // namespace mray::app
