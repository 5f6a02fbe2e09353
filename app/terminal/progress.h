// Progress of a command: a line on a terminal, or lines for people or programs. All on stderr.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <string>
#include <thread>
#include <tuple>

#include "app/base/options.h"
#include "common/base/watch.h"

namespace mray::app {

/// kPlain and kColour are a line that is drawn again, kLines and kJson write a line now and then.
enum class ProgressMode { kOff, kPlain, kColour, kLines, kJson };

/// The mode of ProgressChoice::kAuto: off if quiet, if `fd` is no terminal or if TERM is unset,
/// empty or "dumb"; plain if NO_COLOR is set and not empty (no-color.org); otherwise in colour.
ProgressMode progress_mode(bool quiet, int fd = 2);

/// The mode that --progress asks for; without it as above, quiet under --quiet.
ProgressMode progress_mode(const Options& options);

/// The watch of what a command works on: cancelled by a signal (app/terminal/interrupt.h). How far
/// the work is becomes the part of the current step of the command's Progress.
Watch command_watch();
/// Its part, for calls that take both apart.
std::atomic<float>& step_done();

/// How the part of a step counts that its work says is done: as a part of a unit; as that of one
/// work of several in the unit, which is only shown; or not.
enum class StepPart { kCounted, kShown, kHidden };

/// How far a command is.
struct ProgressState {
    /// The name of the work, such as "rendering".
    std::string label;
    /// The name of one of the units that are counted, such as "frame".
    std::string unit = {};
    std::uint64_t done = 0;
    /// 0: nothing is counted.
    std::uint64_t total = 0;
    /// Seconds since the beginning, and since the first unit was begun.
    double elapsed_s = 0;
    double counted_s = 0;
    /// The current step in words, ASCII without quotes, or empty.
    std::string step = {};
    /// The part of it that is done, from 0 to 1; negative: not known.
    float part = -1;
    StepPart counts_part = StepPart::kHidden;
};

/// One line of at most `columns` characters (escape sequences not counted), ASCII only:
/// `rendering [#####.....] 5/10  frame 12 43.2 %  1.2 frames/s  4 s left`. Rate and time are
/// missing before anything is done. Where there is little room, first the rate is left out, then
/// the step, then the time, and then the bar. Without units: `label [###.....] 43.2 %  4 s left`,
/// or `label 3 s`.
std::string progress_line(const ProgressState& state, int columns, ProgressMode mode);

/// `rendering 5/10  frame 12 43.2 %  4 s left` with a newline, for a file of messages.
std::string progress_text_line(const ProgressState& state);

/// An object with a newline: `"schema": "morphray/1"`, `progress` (the label), `done` (at most
/// total), `total`, `step` and `part`, which are null if there is none, `elapsed_s` and `left_s`,
/// which is null before anything is done.
std::string progress_json_line(const ProgressState& state);

/// A thread draws the line ten times a second, but not in the first fifth of a second, nor in the
/// background of a terminal; finish() and the destructor clear it. A line of kLines is written at
/// most once a second, of kJson at once and then at most ten times a second, if something has
/// changed; both also by finish(), and neither without units. What cannot be written is left out.
/// At most one exists at a time. Members are called by one thread.
class Progress {
public:
    /// `total` units are to be done; 0: they are not counted, the label names the only step, and
    /// only a terminal shows it.
    Progress(std::string label, const char* unit, std::uint64_t total, ProgressMode mode,
             int fd = 2);
    ~Progress();
    Progress(const Progress&) = delete;
    Progress& operator=(const Progress&) = delete;

    /// Work on a unit begins.
    void begin(std::string step, StepPart part = StepPart::kCounted);
    /// Work begins that is no unit, such as a tree for those to come.
    void prepare(std::string step);
    /// Units that are done; no part of another one is until begin().
    void update(std::uint64_t done);
    /// All units are done: clears the line, or writes the last one.
    void finish();

private:
    void set_step(std::string step, StepPart part);
    void run();
    void show();
    void stop();
    ProgressState now() const;

    using Clock = std::chrono::steady_clock;

    ProgressState state_;
    ProgressMode mode_;
    int fd_;
    Clock::time_point begin_ = Clock::now();
    /// When the first unit was begun, if one was.
    Clock::time_point counted_from_ = begin_;
    bool has_begun_ = false;
    /// Units, step and thousandths that the last line showed.
    std::tuple<std::uint64_t, std::string, int> shown_ = {};
    bool stops_ = false;
    std::condition_variable wakes_;
    std::thread thread_;
};

/// While it lives no progress is drawn, so that something else can be written to the terminal. At
/// most one a thread, and no call of Progress within.
class ProgressPause {
public:
    ProgressPause();

private:
    std::unique_lock<std::mutex> lock_;
};

}  // namespace mray::app
