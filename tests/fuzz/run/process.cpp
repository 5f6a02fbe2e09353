#include "tests/fuzz/run/process.h"

#include <fmt/format.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <exception>

#include "app/terminal/failure.h"
#include "common/base/errors.h"
#include "common/report/guarded_run.h"
#ifdef MORPHRAY_HAS_VULKAN
#include "gpu/vulkan_backend.h"
#endif

namespace mray::fuzz {
namespace {

/// Runs the work in a process of this width; returns its id.
pid_t start(int width, const std::function<int()>& work) {
    std::fflush(nullptr);
    const pid_t child = fork();
    if (child != 0) return child;
    if (width != 0) setenv("LP_NATIVE_VECTOR_WIDTH", std::to_string(width).c_str(), 1);
    int code = static_cast<int>(app::ExitCode::kInternal);
    try {
        code = work();
    } catch (const Error& error) {
        fmt::print(stderr, "fuzz: {}\n", error.what());
        code = static_cast<int>(app::exit_code_of(error.kind()));
    } catch (const std::exception& error) {
        fmt::print(stderr, "fuzz: internal error: {}\n", error.what());
    }
    std::fflush(nullptr);
    // Skips destructors, which would wait for threads and drivers.
    _exit(code);
}

/// The exit code of a process; -1 if it crashed or did not start.
int wait_for(pid_t child) {
    int status = 0;
    const bool is_done = child > 0 && waitpid(child, &status, 0) == child;
    return is_done && WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

/// Whether lavapipe is refused for the width of its vectors.
bool is_refused([[maybe_unused]] int width) {
#ifdef MORPHRAY_HAS_VULKAN
    return wait_for(start(width, [] {
               try {
                   const std::string why = gpu::list_devices().front().unusable;
                   return why.find("LP_NATIVE_VECTOR_WIDTH") != std::string::npos ? 1 : 0;
               } catch (const Error&) {
                   // The process that traces says it.
                   return 0;
               }
           })) == 1;
#else
    return false;
#endif
}

}  // namespace

std::string Process::name() const {
    return vulkan ? fmt::format("vulkan-{}", width) : std::string("cpu");
}

int run_processes(bool vulkan, const std::function<int(const Process&)>& work) {
    std::vector<int> widths = {0};
    if (vulkan) {
        widths = {128, 256, 512};
        std::erase_if(widths, is_refused);
    }
    const SharedMemory memory(widths.size() * sizeof(std::uint64_t));
    const auto current = memory.as<std::uint64_t>(widths.size());
    const auto count = static_cast<std::uint32_t>(widths.size());
    std::vector<pid_t> children;
    for (std::uint32_t i = 0; i < count; ++i) {
        const Process process{vulkan, widths[i], i, count, &current[i]};
        children.push_back(start(widths[i], [&] { return work(process); }));
    }
    int worst = 0;
    for (std::uint32_t i = 0; i < count; ++i) {
        const int code = wait_for(children[i]);
        if (code > static_cast<int>(app::ExitCode::kCheckFailed) || code < 0)
            fmt::print("{} of {} in case {}\n", code < 0 ? "CRASH" : "error",
                       Process{vulkan, widths[i]}.name(), current[i]);
        worst = std::max(worst, code < 0 ? static_cast<int>(app::ExitCode::kCheckFailed) : code);
    }
    return worst;
}

}  // namespace mray::fuzz
