// The loops over cases of consecutive seeds.
#pragma once

#include <cstdint>
#include <string>

#include "common/base/stopwatch.h"
#include "tests/fuzz/judge/referee.h"
#include "tests/fuzz/run/options.h"
#include "tests/fuzz/run/process.h"

namespace mray::fuzz {

/// The counts of a process.
class Progress {
public:
    explicit Progress(const Process& process) : process_(process) {}

    Tally tally;

    /// Notes the case that begins, and writes the counts to stderr every few seconds.
    void begin(std::uint64_t current);
    double seconds() const { return watch_.ms() / 1000; }
    bool has_failed() const { return tally.failed_cases > 0; }
    /// Prints the counts; returns the exit code.
    int finish() const;

private:
    static constexpr double kSeconds = 5;

    std::string summary() const;

    const Process& process_;
    Stopwatch watch_;
    double next_ = kSeconds;
};

/// Whether a loop over cases must end: enough failures, or SIGINT or SIGTERM.
bool is_over(const FuzzOptions& options, const Progress& progress);

/// Tries a process's part of make_case() or make_questions(). Returns an exit code.
int run_campaign(const FuzzOptions& options, const Process& process);

}  // namespace mray::fuzz
