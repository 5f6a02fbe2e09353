#include "app/chart/guarded_run.h"

#include <fmt/format.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <thread>

#include "app/interrupt.h"
#include "common/error.h"
#include "common/stopwatch.h"

namespace morphray::app {
namespace {

constexpr auto kLookEvery = std::chrono::milliseconds(2);

[[noreturn]] void fail(const char* what) {
    throw Error(ExitCode::kLimit, fmt::format("chart: no {}: {}", what, std::strerror(errno)));
}

[[noreturn]] void work_alone(const std::function<void()>& work) {
    try {
        work();
    } catch (...) {
        _exit(1);
    }
    // Without what the program does at its end: that is the caller's.
    _exit(0);
}

/// Ends the process and forgets it.
void end(pid_t process) {
    kill(process, SIGKILL);
    waitpid(process, nullptr, 0);
}

}  // namespace

SharedMemory::SharedMemory(std::size_t bytes) : bytes_(std::max<std::size_t>(1, bytes)) {
    start_ = mmap(nullptr, bytes_, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    if (start_ == MAP_FAILED) fail("memory");
}

SharedMemory::~SharedMemory() { munmap(start_, bytes_); }

RunEnd run_guarded(const std::function<void()>& work, double limit_s) {
    const Stopwatch watch;
    const pid_t process = fork();
    if (process < 0) fail("process");
    if (process == 0) work_alone(work);
    for (;;) {
        int status = 0;
        if (waitpid(process, &status, WNOHANG) == process) {
            return WIFEXITED(status) && WEXITSTATUS(status) == 0 ? RunEnd::kDone : RunEnd::kCrashed;
        }
        if (watch.ms() > 1e3 * limit_s) {
            end(process);
            return RunEnd::kNoEnd;
        }
        try {
            throw_if_interrupted();
        } catch (...) {
            end(process);
            throw;
        }
        std::this_thread::sleep_for(kLookEvery);
    }
}

}  // namespace morphray::app
