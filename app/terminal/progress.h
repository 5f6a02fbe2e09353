// Progress of a command: a line on stderr that is drawn again, if that is a terminal.
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <string>
#include <thread>

#include "app/terminal/messages.h"
#include "common/base/watch.h"

namespace mray::app {

/// The watch of what a command works on: cancelled by a signal (app/terminal/failure.h). How far
/// the work is becomes the part of the current step of the command's Progress.
Watch command_watch();
/// Its part, for calls that take both apart.
std::atomic<float>& step_done();

/// How far a command is.
struct ProgressState {
    /// The name of the work, such as "rendering".
    std::string label;
    std::uint64_t done = 0;
    /// 0: nothing is counted, and `part` is that of all.
    std::uint64_t total = 0;
    /// Seconds since it began.
    double elapsed_s = 0;
    /// The current step in words, or empty.
    std::string step = {};
    /// The part of it that is done, from 0 to 1; negative: not known.
    float part = -1;
    /// True if `part` is a part of one counted unit, not of all the work.
    bool counts_part = false;
};

/// One line of at most `columns` characters: `rendering [#####.....] 5/10  frame 12  4 s left`.
/// The time is missing before anything is done.
std::string progress_line(const ProgressState& state, int columns);

/// A thread draws the line ten times a second, but not in the first fifth of a second, nor in the
/// background of a terminal; the destructor clears it. Nothing is drawn if stderr is no terminal,
/// TERM is unset or "dumb", or under --quiet. At most one exists at a time.
class Progress {
public:
    /// `total` units are to be done; 0: they are not counted, the label names the only step.
    Progress(std::string label, std::uint64_t total, const Messages& messages);
    ~Progress();
    Progress(const Progress&) = delete;
    Progress& operator=(const Progress&) = delete;

    /// A step begins. With `counts_part` it is a unit of which its work says how much is done.
    void begin(std::string step, bool counts_part = false);
    /// Units that are done; no part of another one is until begin().
    void update(std::uint64_t done);

private:
    using Clock = std::chrono::steady_clock;

    void run();
    void show();

    ProgressState state_;
    Clock::time_point begin_ = Clock::now();
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
