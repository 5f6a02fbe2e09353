// Output to the terminal: results to stdout, everything else to stderr, a line of progress too.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <initializer_list>
#include <string>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include "common/base/errors.h"
#include "common/frame_times.h"

namespace mray::app {

enum class ExitCode : int;
struct Failure;

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

/// Writes to the file, or to stdout for "-". Throws Error(kOutput).
void write_report(const std::string& file, std::string_view text);

void take_exception(Failure& failure, const Messages& messages);

/// Calls work(). What it throws is an error message, and replaces a failure of kOk or kPartial.
template <class Work>
void attempt(Failure& failure, const Messages& messages, const Work& work) {
    try {
        work();
    } catch (...) {
        take_exception(failure, messages);
    }
}

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

/// Passes warnings on to messages, which must outlive it.
inline WarnFunction warn_by(const Messages& messages) {
    return [&messages](const Warning& warning) { messages.warn(warning); };
}

}  // namespace mray::app
