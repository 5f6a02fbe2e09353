#include "tests/fuzz/case/lanes.h"

#include <fmt/format.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <new>

#include "app/cli/exit_code.h"
#include "common/base/errors.h"
#include "common/process/guarded_run.h"

namespace morphray::fuzz {
namespace {

constexpr std::array kWidths = {128, 256, 512};
constexpr std::size_t kMostLanes = 64;

struct Shared {
    std::atomic<std::uint64_t> failures = 0;
    std::array<LaneState, kMostLanes> lanes = {};
};
static_assert(std::atomic<std::uint64_t>::is_always_lock_free);  // or it could not be shared

[[noreturn]] void work_in_child(const Lane& lane, Shared& shared, const LaneWork& work) {
    if (lane.width != 0) setenv("LP_NATIVE_VECTOR_WIDTH", std::to_string(lane.width).c_str(), 1);
    const LaneState& state = shared.lanes[lane.index];
    const auto complain = [&](const char* what) {
        std::fprintf(stderr, "fuzz: %s, case %llu: %s\n", lane.name().c_str(),
                     static_cast<unsigned long long>(state.current), what);
    };
    int code = static_cast<int>(app::ExitCode::kInternal);
    try {
        code = work(lane, shared.lanes[lane.index], shared.failures);
    } catch (const Error& error) {
        complain(error.what());
        code = static_cast<int>(app::exit_code_of(error.kind()));
    } catch (const std::exception& error) {
        complain(error.what());
    }
    std::fflush(nullptr);
    // Without destructors, which would wait for threads and drivers.
    _exit(code);
}

}  // namespace

std::string Lane::name() const {
    if (!vulkan) return "cpu";
    return width == 0 ? "vulkan" : fmt::format("vulkan-{}", width);
}

std::vector<Lane> make_lanes(bool vulkan, std::uint32_t jobs) {
    std::vector<Lane> lanes;
    if (!vulkan) {
        for (std::uint32_t i = 0; i < jobs; ++i) lanes.push_back({i, jobs, false, 0});
        return lanes;
    }
    for (const int width : kWidths) {
        const auto index = static_cast<std::uint32_t>(lanes.size());
        lanes.push_back({index, static_cast<std::uint32_t>(kWidths.size()), true, width});
    }
    return lanes;
}

LanesResult run_lanes(const std::vector<Lane>& lanes, const LaneWork& work) {
    const SharedMemory memory(sizeof(Shared));
    Shared& shared = *new (memory.as<Shared>(1).data()) Shared;
    std::fflush(nullptr);
    std::vector<pid_t> children;
    for (const Lane& lane : lanes) {
        const pid_t child = fork();
        if (child == 0) work_in_child(lane, shared, work);
        children.push_back(child);
    }
    LanesResult result;
    for (std::size_t i = 0; i < lanes.size(); ++i) {
        int status = 0;
        const bool started = children[i] > 0 && waitpid(children[i], &status, 0) == children[i];
        const LaneState& state = shared.lanes[i];
        result.tally.add(state.tally);
        if (started && WIFEXITED(status)) {
            result.exit_code = std::max(result.exit_code, WEXITSTATUS(status));
        } else {
            result.accidents.push_back(fmt::format(
                "{}: {} in case {}", lanes[i].name(),
                started ? fmt::format("crashed with signal {}", WTERMSIG(status)) : "did not start",
                state.current));
        }
    }
    return result;
}

}  // namespace morphray::fuzz
