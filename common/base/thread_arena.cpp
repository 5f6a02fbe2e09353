#include "common/base/thread_arena.h"

#include <map>
#include <mutex>
#include <utility>

namespace mray {
namespace {

/// Arenas that no ThreadArena uses, by their size. They are at most as many as were in use at once.
struct IdleArenas {
    std::mutex mutex;
    std::multimap<int, std::unique_ptr<tbb::task_arena>> arenas;
};

/// Is never destroyed: scenes of other static objects may be destroyed later.
IdleArenas& idle_arenas() {
    static auto* const idle = new IdleArenas;
    return *idle;
}

std::unique_ptr<tbb::task_arena> take_arena(int size) {
    const std::scoped_lock lock(idle_arenas().mutex);
    auto found = idle_arenas().arenas.extract(size);
    return found.empty() ? std::make_unique<tbb::task_arena>(size) : std::move(found.mapped());
}

}  // namespace

ThreadArena::ThreadArena(int threads)
    : size_(threads > 0 ? threads : tbb::task_arena::automatic), arena_(take_arena(size_)) {
    using tbb::global_control;
    const auto cores = global_control::active_value(global_control::max_allowed_parallelism);
    const auto wanted = static_cast<std::size_t>(arena_->max_concurrency());
    if (wanted > cores) allow_.emplace(global_control::max_allowed_parallelism, wanted);
}

ThreadArena::~ThreadArena() {
    allow_.reset();
    const std::scoped_lock lock(idle_arenas().mutex);
    idle_arenas().arenas.emplace(size_, std::move(arena_));
}

}  // namespace mray
