#include "common/process/guarded_run.h"

#include <fmt/format.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <thread>

#include "common/base/errors.h"
#include "common/base/stopwatch.h"

namespace morphray {
namespace {

constexpr auto kLookEvery = std::chrono::milliseconds(2);
// Of the limit, in which a busy machine lets a process have its time.
constexpr double kWaitFactor = 50;

[[noreturn]] void fail(const char* what) {
    throw Error(ErrorKind::kLimit, fmt::format("chart: no {}: {}", what, std::strerror(errno)));
}

[[noreturn]] void work_alone(const std::function<void()>& work, unsigned limit_s) {
    // At the limit comes SIGXCPU, and nobody else sends it.
    const rlimit limit{limit_s, limit_s + 1};
    setrlimit(RLIMIT_CPU, &limit);
    signal(SIGXCPU, SIG_DFL);
    const rlimit no_core{0, 0};
    setrlimit(RLIMIT_CORE, &no_core);
    try {
        work();
    } catch (...) {
        _exit(1);
    }
    // Without what the program does at its end: that is the caller's.
    _exit(0);
}

bool ran_out(int status) { return WIFSIGNALED(status) && WTERMSIG(status) == SIGXCPU; }

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

RunEnd run_guarded(const std::function<void()>& work, unsigned limit_s,
                   const std::function<void()>& check) {
    const Stopwatch watch;
    const pid_t process = fork();
    if (process < 0) fail("process");
    if (process == 0) work_alone(work, limit_s);
    for (;;) {
        int status = 0;
        if (waitpid(process, &status, WNOHANG) == process) {
            if (WIFEXITED(status) && WEXITSTATUS(status) == 0) return RunEnd::kDone;
            return ran_out(status) ? RunEnd::kNoEnd : RunEnd::kCrashed;
        }
        if (watch.ms() > 1e3 * kWaitFactor * limit_s) {
            end(process);
            return RunEnd::kNoEnd;
        }
        try {
            check();
        } catch (...) {
            end(process);
            throw;
        }
        std::this_thread::sleep_for(kLookEvery);
    }
}

}  // namespace morphray
