#include "app/terminal/interrupt.h"

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <functional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

namespace mray::app {
namespace {

/// The status of a child that runs `body`, as from waitpid; the child exits with body's result.
int status_of_child(const std::function<int()>& body) {
    const pid_t child = ::fork();
    if (child == 0) ::_exit(body());
    int status = -1;
    ::waitpid(child, &status, 0);
    return status;
}

int exit_code_when_interrupted() {
    try {
        throw_if_interrupted();
    } catch (const Error& error) {
        // In a child process an EXPECT would be lost.
        if (error.kind() != ErrorKind::kCancelled) return 2;
        return static_cast<int>(interrupt_exit_code());
    }
    return 0;
}

TEST(Interrupt, IsNotSetAtFirst) {
    const InterruptGuard guard;
    EXPECT_FALSE(interrupted());
    EXPECT_NO_THROW(throw_if_interrupted());
}

TEST(Interrupt, FirstSignalOnlySetsTheStateAndTheExitCode) {
    for (const auto& [signal, code] : {std::pair{SIGINT, 130}, {SIGTERM, 143}, {SIGHUP, 129}}) {
        const int status = status_of_child([signal = signal] {
            const InterruptGuard guard;
            ::raise(signal);
            return interrupted() ? exit_code_when_interrupted() : 1;
        });
        ASSERT_TRUE(WIFEXITED(status));
        EXPECT_EQ(WEXITSTATUS(status), code);
    }
}

TEST(Interrupt, SecondSignalEndsTheProcessAtOnce) {
    for (const int first : {SIGINT, SIGTERM}) {
        for (const int second : {SIGINT, SIGTERM}) {
            const int status = status_of_child([=] {
                const InterruptGuard guard;
                ::raise(first);
                ::raise(second);
                return 0;
            });
            ASSERT_TRUE(WIFSIGNALED(status));
            EXPECT_EQ(WTERMSIG(status), second);
        }
    }
}

TEST(Interrupt, EndsTheProcessThatDoesNotNoticeIt) {
    for (const auto& [signal, code] : {std::pair{SIGINT, 130}, {SIGTERM, 143}, {SIGHUP, 129}}) {
        int ends[2];
        ASSERT_EQ(::pipe(ends), 0);
        const int status = status_of_child([&, signal = signal] {
            const InterruptGuard guard;
            tell_results("2 of 3 frames are done (0,1)", "a/folder");
            ::dup2(ends[1], STDERR_FILENO);
            ::raise(signal);
            for (;;) ::pause();
            return 0;
        });
        ::close(ends[1]);
        char line[200];
        const ssize_t size = ::read(ends[0], line, sizeof line);
        ::close(ends[0]);
        ASSERT_TRUE(WIFEXITED(status));
        EXPECT_EQ(WEXITSTATUS(status), code);
        ASSERT_GT(size, 0);
        EXPECT_NE(std::string(line, static_cast<std::size_t>(size))
                      .find("; 2 of 3 frames are done (0,1); finished results are in a/folder\n"),
                  std::string::npos);
    }
}

TEST(Interrupt, SaysWhatIsFinished) {
    const InterruptGuard guard;
    EXPECT_TRUE(interrupt_message().ends_with("; finished results are kept"));
    const double frames[] = {0, 1, 2, 4.5};
    EXPECT_EQ(finished_text("frame", frames, 9), "4 of 9 frames are done (0..2,4.5)");
    EXPECT_EQ(finished_text("frame", {frames, 1}, 9), "1 of 9 frames is done (0)");
    EXPECT_EQ(finished_text("frame", {}, 9), "none of 9 frames is done");
    EXPECT_EQ(finished_text("frame", {}, 1), "the frame is not done");
    std::vector<double> halves;
    for (int i = 0; i < 100; ++i) halves.push_back(i + 0.5 * (i % 2));
    EXPECT_EQ(finished_text("frame", halves, 200), "100 of 200 frames are done");
    tell_results(finished_text("frame", {}, 1), "");
    EXPECT_TRUE(interrupt_message().ends_with("; the frame is not done"));
}

TEST(Interrupt, EndsTheProcessInAWaitForAThreadThatNoticesIt) {
    const int status = status_of_child([] {
        const InterruptGuard guard;
        ::raise(SIGTERM);
        if (exit_code_when_interrupted() != 143) return 1;
        const EndOfGrace end;
        {
            const EndOfGrace inner;
            std::thread([] { exit_code_when_interrupted(); }).join();
        }
        for (;;) ::pause();
        return 0;
    });
    ASSERT_TRUE(WIFEXITED(status));
    EXPECT_EQ(WEXITSTATUS(status), 143);
}

TEST(Interrupt, GoesOnAfterAShortWaitOnTheWayOut) {
    const int status = status_of_child([] {
        const InterruptGuard guard;
        ::raise(SIGTERM);
        if (exit_code_when_interrupted() != 143) return 1;
        {
            const EndOfGrace end;
            std::thread([] { exit_code_when_interrupted(); }).join();
        }
        // Longer than the grace, which is over.
        std::this_thread::sleep_for(std::chrono::milliseconds(3 * InterruptGuard::kGraceMs));
        return 7;
    });
    ASSERT_TRUE(WIFEXITED(status));
    EXPECT_EQ(WEXITSTATUS(status), 7);
}

TEST(Interrupt, EndsTheProcessInAWaitOnTheWayOut) {
    const int status = status_of_child([] {
        const InterruptGuard guard;
        ::raise(SIGTERM);
        if (exit_code_when_interrupted() != 143) return 1;
        const EndOfGrace end;
        for (;;) ::pause();
        return 0;
    });
    ASSERT_TRUE(WIFEXITED(status));
    EXPECT_EQ(WEXITSTATUS(status), 143);
}

TEST(Interrupt, LeavesAnIgnoredSignalIgnored) {
    const int status = status_of_child([] {
        ::signal(SIGINT, SIG_IGN);
        const InterruptGuard guard;
        ::raise(SIGINT);
        ::raise(SIGINT);
        return interrupted() ? 1 : 0;
    });
    ASSERT_TRUE(WIFEXITED(status));
    EXPECT_EQ(WEXITSTATUS(status), 0);
}

TEST(Interrupt, WriteToAClosedPipeFailsWithoutASignal) {
    const int status = status_of_child([] {
        const InterruptGuard guard;
        int ends[2];
        if (::pipe(ends) != 0) return 1;
        ::close(ends[0]);
        return ::write(ends[1], "x", 1) < 0 && errno == EPIPE ? 0 : 2;
    });
    ASSERT_TRUE(WIFEXITED(status));
    EXPECT_EQ(WEXITSTATUS(status), 0);
}

TEST(Interrupt, GuardRestoresTheHandlers) {
    for (const int signal : {SIGINT, SIGTERM, SIGPIPE}) {
        const int status = status_of_child([=] {
            { const InterruptGuard guard; }
            ::raise(signal);
            return 0;
        });
        ASSERT_TRUE(WIFSIGNALED(status));
        EXPECT_EQ(WTERMSIG(status), signal);
    }
}

}  // namespace
}  // namespace mray::app
