#include "common/base/thread_arena.h"

#include <map>
#include <mutex>
#include <utility>

namespace mray {
namespace {

/// Arenas that no ThreadArena uses, by their size. There are at most as many as were in use at the
/// same time.
class IdleArenas {
public:
    std::unique_ptr<tbb::task_arena> take(int size) {
        const std::scoped_lock lock(mutex_);
        const auto found = arenas_.find(size);
        if (found == arenas_.end()) return std::make_unique<tbb::task_arena>(size);
        std::unique_ptr<tbb::task_arena> arena = std::move(found->second);
        arenas_.erase(found);
        return arena;
    }
    /// Destroys the arena if there is no memory to keep it.
    void give_back(int size, std::unique_ptr<tbb::task_arena> arena) noexcept {
        try {
            const std::scoped_lock lock(mutex_);
            arenas_.emplace(size, std::move(arena));
        } catch (const std::bad_alloc&) {
        }
    }

private:
    std::mutex mutex_;
    std::multimap<int, std::unique_ptr<tbb::task_arena>> arenas_;
};

/// Is never destroyed: scenes of other static objects may be destroyed later.
IdleArenas& idle_arenas() {
    static auto* const arenas = new IdleArenas;
    return *arenas;
}

}  // namespace

ThreadArena::ThreadArena(int threads)
    : size_(threads > 0 ? threads : tbb::task_arena::automatic), arena_(idle_arenas().take(size_)) {
    using tbb::global_control;
    const auto cores = global_control::active_value(global_control::max_allowed_parallelism);
    const auto wanted = static_cast<std::size_t>(arena_->max_concurrency());
    if (wanted > cores) allow_.emplace(global_control::max_allowed_parallelism, wanted);
}

ThreadArena::~ThreadArena() {
    allow_.reset();
    idle_arenas().give_back(size_, std::move(arena_));
}

}  // namespace mray
