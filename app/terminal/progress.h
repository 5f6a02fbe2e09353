// A progress bar on a terminal.
#pragma once

#include <chrono>
#include <cstdint>
#include <string>

namespace mray::app {

enum class ProgressMode { kOff, kPlain, kColour };

/// Off if quiet, if `fd` is no terminal or if TERM is unset, empty or "dumb"; plain if NO_COLOR is
/// set and not empty (no-color.org); otherwise in colour.
ProgressMode progress_mode(bool quiet, int fd = 2);

/// One line of at most `columns` characters (escape sequences not counted), ASCII only:
/// `label [#####.....] 5/10  12 s left`. The estimate is missing before the first step is done, and
/// bar and estimate are left out where there is little room.
std::string progress_line(const std::string& label, std::uint64_t done, std::uint64_t total,
                          double elapsed_s, int columns, ProgressMode mode);

/// Redraws its line at most ten times a second, and not in the first fifth of a second. The
/// destructor clears the line. Nothing else may write to the terminal between update() and hide().
/// Not thread-safe.
class Progress {
public:
    Progress(std::string label, std::uint64_t total, ProgressMode mode, int fd = 2);
    ~Progress() { hide(); }
    Progress(const Progress&) = delete;
    Progress& operator=(const Progress&) = delete;

    void update(std::uint64_t done);
    /// Clears the line for a message; the next update() draws it again.
    void hide();

private:
    using Clock = std::chrono::steady_clock;

    std::string label_;
    std::uint64_t total_;
    ProgressMode mode_;
    int fd_;
    Clock::time_point begin_ = Clock::now();
    Clock::time_point next_draw_;
    bool visible_ = false;
};

}  // namespace mray::app
