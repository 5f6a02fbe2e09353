// Progress of a command: a bar on a terminal, or lines for people or programs. All on stderr.
#pragma once

#include <chrono>
#include <cstdint>
#include <string>

#include "app/base/options.h"

namespace mray::app {

/// kPlain and kColour are bars, kLines and kJson write a line now and then.
enum class ProgressMode { kOff, kPlain, kColour, kLines, kJson };

/// The mode of ProgressChoice::kAuto: off if quiet, if `fd` is no terminal or if TERM is unset,
/// empty or "dumb"; plain if NO_COLOR is set and not empty (no-color.org); otherwise in colour.
ProgressMode progress_mode(bool quiet, int fd = 2);

/// The mode that --progress asks for; without it as above, quiet under --quiet.
ProgressMode progress_mode(const Options& options);

/// One line of at most `columns` characters (escape sequences not counted), ASCII only:
/// `label [#####.....] 5/10  12 s left`. The estimate is missing before the first step is done, and
/// bar and estimate are left out where there is little room.
std::string progress_line(const std::string& label, std::uint64_t done, std::uint64_t total,
                          double elapsed_s, int columns, ProgressMode mode);

/// `label 5/10  12 s left` with a newline, for a file of messages.
std::string progress_text_line(const std::string& label, std::uint64_t done, std::uint64_t total,
                               double elapsed_s);

/// An object with a newline: `"schema": "morphray/1"`, `progress` (the label), `done` (at most
/// total), `total`, `elapsed_s` and `left_s`, which is null before the first step is done.
std::string progress_json_line(const std::string& label, std::uint64_t done, std::uint64_t total,
                               double elapsed_s);

/// A bar is redrawn at most ten times a second, and not in the first fifth of a second. The
/// destructor clears it. Nothing else may write to the terminal between update() and hide(). Lines
/// are written at most once a second, JSON at once and then at most ten times a second; both also
/// by finish(). What cannot be written is left out. Not thread-safe.
class Progress {
public:
    Progress(std::string label, std::uint64_t total, ProgressMode mode, int fd = 2);
    ~Progress() { hide(); }
    Progress(const Progress&) = delete;
    Progress& operator=(const Progress&) = delete;

    void update(std::uint64_t done);
    /// All steps are done: clears a bar, or writes the last line.
    void finish();
    /// Clears the line for a message; the next update() draws it again.
    void hide();

private:
    void write_line(std::uint64_t done);
    double elapsed_s() const;

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
