#include "common/report/guarded_run.h"

#include <fmt/format.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "common/base/errors.h"

namespace mray {
namespace {

[[noreturn]] void fail(const char* what) {
    throw Error(ErrorKind::kLimit, fmt::format("no {}: {}; end other programs or raise the limit",
                                               what, std::strerror(errno)));
}

[[noreturn]] void work_alone(const std::function<void()>& work, unsigned limit_s) {
    // The kernel sends SIGXCPU at the limit, and nothing else does.
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
    // Skip destructors and exit handlers, which belong to the calling process.
    _exit(0);
}

}  // namespace

SharedMemory::SharedMemory(std::size_t bytes) : bytes_(std::max<std::size_t>(1, bytes)) {
    start_ = mmap(nullptr, bytes_, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    if (start_ == MAP_FAILED) fail("shared memory");
}

SharedMemory::~SharedMemory() { munmap(start_, bytes_); }

RunEnd run_guarded(const std::function<void()>& work, unsigned limit_s) {
    const pid_t process = fork();
    if (process < 0) fail("new process");
    if (process == 0) work_alone(work, limit_s);
    int status = 0;
    while (waitpid(process, &status, 0) < 0 && errno == EINTR) {
    }
    if (WIFEXITED(status) && WEXITSTATUS(status) == 0) return RunEnd::kDone;
    const bool ran_out = WIFSIGNALED(status) && WTERMSIG(status) == SIGXCPU;
    return ran_out ? RunEnd::kNoEnd : RunEnd::kCrashed;
}

}  // namespace mray
