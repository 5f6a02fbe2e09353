#include "common/base/thread_arena.h"

#include <unistd.h>

#include <atomic>
#include <mutex>
#include <utility>

#include "common/base/errors.h"

namespace mray {
namespace {

/// Calls in all arenas, and the process that counts them.
std::atomic<int> calls = 0;
std::atomic<::pid_t> process = 0;

/// Arenas that no ThreadArena uses, by their size. They are at most as many as were in use at once.
struct IdleArenas {
    std::mutex mutex;
    ThreadArenas arenas;
};

/// Is never destroyed: scenes of other static objects may be destroyed later.
IdleArenas& idle_arenas() {
    static auto* const idle = new IdleArenas;
    return *idle;
}

ThreadArenas::node_type take_arena(int size) {
    const std::scoped_lock lock(idle_arenas().mutex);
    ThreadArenas& arenas = idle_arenas().arenas;
    auto found = arenas.extract(size);
    return found.empty() ? arenas.extract(arenas.emplace(size, size)) : std::move(found);
}

}  // namespace

ThreadArena::ThreadArena(int threads)
    : arena_(take_arena(threads > 0 ? threads : tbb::task_arena::automatic)) {
    using tbb::global_control;
    const auto cores = global_control::active_value(global_control::max_allowed_parallelism);
    const auto wanted = static_cast<std::size_t>(this->threads());
    if (wanted > cores) allow_.emplace(global_control::max_allowed_parallelism, wanted);
}

ThreadArena::Call::Call() {
    if (calls == 0) process = ::getpid();
    if (process != ::getpid()) {
        throw Error(ErrorKind::kUnavailable,
                    "threads were at work when this process was forked; start it by spawn or exec");
    }
    ++calls;
}

ThreadArena::Call::~Call() { --calls; }

ThreadArena::~ThreadArena() {
    allow_.reset();
    const std::scoped_lock lock(idle_arenas().mutex);
    idle_arenas().arenas.insert(std::move(arena_));
}

}  // namespace mray
