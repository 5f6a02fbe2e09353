#include "tests/fuzz/run/workers.h"

#include <fmt/format.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <new>

#include "app/base/exit_code.h"
#include "common/base/errors.h"
#include "tools/process/guarded_run.h"
#ifdef MORPHRAY_HAS_VULKAN
#include "gpu/vulkan_backend.h"
#endif

namespace mray::fuzz {
namespace {

constexpr std::array kWidths = {128, 256, 512};
constexpr std::size_t kMostWorkers = 64;

struct Shared {
    std::atomic<std::uint64_t> failures = 0;
    std::array<WorkerState, kMostWorkers> workers = {};
};
static_assert(std::atomic<std::uint64_t>::is_always_lock_free);  // required between processes

void set_width(int width) { setenv("LP_NATIVE_VECTOR_WIDTH", std::to_string(width).c_str(), 1); }

/// Whether lavapipe is refused for the width of its vectors. A process has one width.
bool is_refused([[maybe_unused]] int width) {
#ifdef MORPHRAY_HAS_VULKAN
    const pid_t child = fork();
    if (child == 0) {
        set_width(width);
        bool is_so = false;
        try {
            const std::string why = gpu::list_devices().front().unusable;
            is_so = why.find("LP_NATIVE_VECTOR_WIDTH") != std::string::npos;
        } catch (const Error&) {
            // The worker will say it.
        }
        _exit(is_so ? 1 : 0);
    }
    int status = 0;
    return child > 0 && waitpid(child, &status, 0) == child && WIFEXITED(status) &&
           WEXITSTATUS(status) == 1;
#else
    return false;
#endif
}

[[noreturn]] void work_in_child(const Worker& worker, Shared& shared, const WorkerTask& work) {
    if (worker.width != 0) set_width(worker.width);
    const WorkerState& state = shared.workers[worker.index];
    const auto complain = [&](const char* what) {
        std::fprintf(stderr, "fuzz: %s, case %llu: %s\n", worker.name().c_str(),
                     static_cast<unsigned long long>(state.current), what);
    };
    int code = static_cast<int>(app::ExitCode::kInternal);
    try {
        code = work(worker, shared.workers[worker.index], shared.failures);
    } catch (const Error& error) {
        complain(error.what());
        code = static_cast<int>(app::exit_code_of(error.kind()));
    } catch (const std::exception& error) {
        complain(error.what());
    }
    std::fflush(nullptr);
    // Skips destructors, which would wait for threads and drivers.
    _exit(code);
}

}  // namespace

std::string Worker::name() const {
    if (!vulkan) return "cpu";
    return width == 0 ? "vulkan" : fmt::format("vulkan-{}", width);
}

std::vector<Worker> make_workers(bool vulkan, std::uint32_t jobs) {
    std::vector<Worker> workers;
    if (!vulkan) {
        for (std::uint32_t i = 0; i < jobs; ++i) workers.push_back({i, jobs, false, 0});
        return workers;
    }
    std::vector<int> widths(kWidths.begin(), kWidths.end());
    std::erase_if(widths, is_refused);
    const auto count = static_cast<std::uint32_t>(widths.size());
    for (std::uint32_t i = 0; i < count; ++i) workers.push_back({i, count, true, widths[i]});
    return workers;
}

WorkersResult run_workers(const std::vector<Worker>& workers, const WorkerTask& work) {
    const SharedMemory memory(sizeof(Shared));
    Shared& shared = *new (memory.as<Shared>(1).data()) Shared;
    std::fflush(nullptr);
    std::vector<pid_t> children;
    for (const Worker& worker : workers) {
        const pid_t child = fork();
        if (child == 0) work_in_child(worker, shared, work);
        children.push_back(child);
    }
    WorkersResult result;
    for (std::size_t i = 0; i < workers.size(); ++i) {
        int status = 0;
        const bool started = children[i] > 0 && waitpid(children[i], &status, 0) == children[i];
        const WorkerState& state = shared.workers[i];
        result.tally.add(state.tally);
        if (started && WIFEXITED(status)) {
            result.exit_code = std::max(result.exit_code, WEXITSTATUS(status));
        } else {
            result.accidents.push_back(fmt::format(
                "{}: {} in case {}", workers[i].name(),
                started ? fmt::format("crashed with signal {}", WTERMSIG(status)) : "did not start",
                state.current));
        }
    }
    return result;
}

}  // namespace mray::fuzz
