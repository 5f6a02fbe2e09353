#include "app/base/messages.h"

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <functional>

namespace mray::app {
namespace {

/// The exit code of a child that runs `body`; the child exits with body's result.
int code_of_child(const std::function<int()>& body) {
    const pid_t child = ::fork();
    if (child == 0) ::_exit(body());
    int status = -1;
    ::waitpid(child, &status, 0);
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

TEST(Interrupt, FirstSignalIsNotedAndTheSecondOneEndsTheProcess) {
    EXPECT_EQ(code_of_child([] {
                  handle_signals();
                  ::raise(SIGTERM);
                  return interrupted() ? 128 + interrupt_signal() : 1;
              }),
              143);
    EXPECT_EQ(code_of_child([] {
                  handle_signals();
                  ::raise(SIGTERM);
                  ::raise(SIGINT);
                  return 1;
              }),
              130);
}

TEST(Interrupt, LeavesAnIgnoredSignalIgnored) {
    EXPECT_EQ(code_of_child([] {
                  ::signal(SIGHUP, SIG_IGN);
                  handle_signals();
                  ::raise(SIGHUP);
                  return interrupted() ? 1 : 0;
              }),
              0);
}

}  // namespace
}  // namespace mray::app
