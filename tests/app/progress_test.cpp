#include "app/terminal/progress.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <stdlib.h>
#include <sys/ioctl.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <optional>
#include <stdexcept>
#include <string>
#include <thread>

namespace mray::app {
namespace {

/// Sets or (nullptr) unsets an environment variable for the life of the object.
class Variable {
public:
    Variable(const char* name, const char* value) : name_(name) {
        if (const char* before = ::getenv(name)) before_ = before;
        set(value);
    }
    ~Variable() { set(before_ ? before_->c_str() : nullptr); }

private:
    void set(const char* value) {
        if (value == nullptr) {
            ::unsetenv(name_);
        } else {
            ::setenv(name_, value, 1);
        }
    }
    const char* name_;
    std::optional<std::string> before_;
};

/// A terminal of 60 columns and what was written to it.
class Terminal {
public:
    Terminal() : master_(::posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK)) {
        if (master_ < 0 || ::grantpt(master_) != 0 || ::unlockpt(master_) != 0) {
            throw std::runtime_error("no pseudo-terminal");
        }
        slave_ = ::open(::ptsname(master_), O_RDWR | O_NOCTTY);
        winsize size = {};
        size.ws_col = 60;
        ::ioctl(slave_, TIOCSWINSZ, &size);
    }
    ~Terminal() {
        ::close(slave_);
        ::close(master_);
    }
    int fd() const { return slave_; }
    std::string read_all() {
        std::string text;
        char buffer[4096];
        for (ssize_t n = 0; (n = ::read(master_, buffer, sizeof buffer)) > 0;) {
            text.append(buffer, static_cast<std::size_t>(n));
        }
        return text;
    }

private:
    int master_;
    int slave_ = -1;
};

TEST(ProgressMode, IsOffWithoutATerminal) {
    const Variable term("TERM", "xterm");
    EXPECT_EQ(progress_mode(false, ::open("/dev/null", O_WRONLY)), ProgressMode::kOff);
    EXPECT_EQ(progress_mode(false, 987), ProgressMode::kOff);
}

TEST(ProgressMode, FollowsQuietTermAndNoColor) {
    const Terminal terminal;
    const Variable colour("NO_COLOR", nullptr);
    {
        const Variable term("TERM", "xterm");
        EXPECT_EQ(progress_mode(false, terminal.fd()), ProgressMode::kColour);
        EXPECT_EQ(progress_mode(true, terminal.fd()), ProgressMode::kOff);
        const Variable empty("NO_COLOR", "");
        EXPECT_EQ(progress_mode(false, terminal.fd()), ProgressMode::kColour);
        const Variable no_color("NO_COLOR", "1");
        EXPECT_EQ(progress_mode(false, terminal.fd()), ProgressMode::kPlain);
    }
    for (const char* dumb : {"dumb", "", static_cast<const char*>(nullptr)}) {
        const Variable term("TERM", dumb);
        EXPECT_EQ(progress_mode(false, terminal.fd()), ProgressMode::kOff);
    }
}

/// 5 of 10 frames after 12 s, and 30 % of another one.
ProgressState some_state() {
    return {.label = "render",
            .unit = "frame",
            .done = 5,
            .total = 10,
            .elapsed_s = 13,
            .counted_s = 12,
            .step = "frame 12",
            .part = 0.3f,
            .counts_part = StepPart::kCounted};
}

TEST(ProgressLine, HasNoTimeLeftBeforeAnythingIsDoneAndAfterTheLastUnit) {
    for (const std::uint64_t done : {0, 10, 11}) {
        ProgressState state = some_state();
        state.done = done;
        state.part = -1;
        const std::string line = progress_line(state, 60, ProgressMode::kPlain);
        EXPECT_EQ(line.find("left"), std::string::npos) << line;
    }
}

TEST(ProgressLine, IsNeverLongerThanTheTerminal) {
    for (int columns = -1; columns < 120; ++columns) {
        for (const std::uint64_t total : {0u, 10u, 1000u}) {
            for (const float part : {-1.0f, 0.5f, 1.0f, 2.0f}) {
                ProgressState state = some_state();
                state.total = total;
                state.part = part;
                const std::string line = progress_line(state, columns, ProgressMode::kPlain);
                EXPECT_LE(line.size(), static_cast<std::size_t>(std::max(columns, 0)));
            }
        }
    }
}

TEST(Progress, WritesNothingIfOffOrFinishedAtOnce) {
    Terminal terminal;
    {
        Progress off("off", "", 10, ProgressMode::kOff, terminal.fd());
        std::this_thread::sleep_for(std::chrono::milliseconds(250));
        off.update(5);
        Progress early("early", "", 10, ProgressMode::kPlain, terminal.fd());
        early.update(5);
    }
    EXPECT_EQ(terminal.read_all(), "");
}

TEST(Progress, IsDrawnAtMostTenTimesASecondAndClearedAtTheEnd) {
    Terminal terminal;
    const auto begin = std::chrono::steady_clock::now();
    double elapsed_s = 0;
    {
        Progress progress("frames", "", 1000, ProgressMode::kPlain, terminal.fd());
        for (std::uint64_t i = 0; i < 500; ++i) {
            progress.update(i);
            std::this_thread::sleep_for(std::chrono::milliseconds(1));
        }
        elapsed_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    }
    const std::string text = terminal.read_all();
    int drawn = 0;
    for (std::size_t at = 0; (at = text.find("frames", at)) != std::string::npos; ++at) ++drawn;
    EXPECT_GE(drawn, 1);
    EXPECT_LE(drawn, 1 + static_cast<int>(10 * elapsed_s));
    EXPECT_TRUE(text.ends_with("\r\x1b[K")) << text;
    EXPECT_EQ(text.find('\n'), std::string::npos);
}

/// A pipe that Progress writes to.
class Pipe {
public:
    Pipe() {
        if (::pipe2(fds_, O_NONBLOCK) != 0) throw std::runtime_error("no pipe");
    }
    ~Pipe() {
        ::close(fds_[0]);
        ::close(fds_[1]);
    }
    int fd() const { return fds_[1]; }
    std::string read_all() {
        std::string text;
        char buffer[4096];
        for (ssize_t n = 0; (n = ::read(fds_[0], buffer, sizeof buffer)) > 0;)
            text.append(buffer, static_cast<std::size_t>(n));
        return text;
    }

private:
    int fds_[2] = {};
};

TEST(ProgressMode, FollowsTheOptionWhateverElse) {
    const Variable term("TERM", nullptr);
    Options options;
    EXPECT_EQ(progress_mode(options), ProgressMode::kOff);
    for (const bool quiet : {false, true}) {
        options.quiet = quiet;
        options.progress = ProgressChoice::kPlain;
        EXPECT_EQ(progress_mode(options), ProgressMode::kLines);
        options.progress = ProgressChoice::kJson;
        EXPECT_EQ(progress_mode(options), ProgressMode::kJson);
        options.progress = ProgressChoice::kOff;
        EXPECT_EQ(progress_mode(options), ProgressMode::kOff);
    }
}

TEST(Progress, WritesTheFirstAndTheLastLine) {
    Pipe pipe;
    {
        Progress json("x", "", 3, ProgressMode::kJson, pipe.fd());
        json.update(1);
        json.update(3);
        json.finish();
        json.update(3);
    }
    const std::string text = pipe.read_all();
    EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 2) << text;
    EXPECT_NE(text.find("\"done\": 0"), std::string::npos) << text;
    EXPECT_NE(text.find("\"done\": 3"), std::string::npos) << text;
    {
        Progress lines("x", "", 3, ProgressMode::kLines, pipe.fd());
        lines.update(1);
        lines.finish();
    }
    EXPECT_EQ(pipe.read_all(), "x 3/3\n");
    { const Progress ended_early("x", "", 3, ProgressMode::kLines, pipe.fd()); }
    EXPECT_EQ(pipe.read_all(), "");
}

TEST(Progress, MovesWhileOneStepIsWorkedOn) {
    Terminal terminal;
    std::string text;
    const auto wait_for = [&](const char* part) {
        while (text.find(part) == std::string::npos) {
            text += terminal.read_all();
            std::this_thread::sleep_for(std::chrono::milliseconds(5));
        }
    };
    {
        Progress progress("frames", "frame", 2, ProgressMode::kPlain, terminal.fd());
        progress.prepare("tree");
        command_watch().set_done(1, 4);
        wait_for("0/2  tree 25.0 %");
        progress.begin("frame 7");
        wait_for("0/2  frame 7\r");
        command_watch().set_done(1, 2);
        wait_for("] 0/2  frame 7 50.0 %");
        progress.update(1);
        wait_for("] 1/2  frame 7 50.0 %");
        // Text that is written meanwhile has a line of its own.
        {
            const ProgressPause pause;
            text += terminal.read_all();
            EXPECT_TRUE(text.ends_with("\r\x1b[K")) << text;
        }
        text.clear();
        wait_for("] 1/2");
        progress.finish();
        text += terminal.read_all();
        EXPECT_TRUE(text.ends_with("\r\x1b[K")) << text;
    }
    EXPECT_EQ(terminal.read_all(), "");
}

}  // namespace
}  // namespace mray::app
