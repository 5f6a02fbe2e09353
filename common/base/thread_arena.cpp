#include "common/base/thread_arena.h"

#include <pthread.h>

#include <cstdlib>
#include <latch>
#include <map>
#include <mutex>
#include <system_error>
#include <utility>
#include <vector>

namespace mray {
namespace {

/// Throws std::system_error if the system has no room for so many threads, one of them the caller.
/// oneTBB would end the process: its threads start each other, where no caller can catch what they
/// throw. So that many are started here once, with stacks of oneTBB's size.
void require_threads(int count) {
    static std::mutex mutex;
    static int most = 1;
    const std::scoped_lock lock(mutex);
    if (count <= most) return;
    std::vector<pthread_t> threads;
    threads.reserve(static_cast<std::size_t>(count));
    pthread_attr_t attributes;
    pthread_attr_init(&attributes);
    pthread_attr_setstacksize(
        &attributes, tbb::global_control::active_value(tbb::global_control::thread_stack_size));
    std::latch end(1);
    int error = 0;
    for (int i = 1; i < count && error == 0; ++i) {
        pthread_t thread;
        const auto wait = [](void* latch) -> void* {
            // The C library reserves address space for a thread that allocates, and keeps it.
            void* volatile memory = std::malloc(1);
            std::free(memory);
            static_cast<std::latch*>(latch)->wait();
            return nullptr;
        };
        error = pthread_create(&thread, &attributes, wait, &end);
        if (error == 0) threads.push_back(thread);
    }
    end.count_down();
    for (const pthread_t thread : threads) pthread_join(thread, nullptr);
    pthread_attr_destroy(&attributes);
    if (error != 0) throw std::system_error(error, std::generic_category(), "pthread_create");
    most = count;
}

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
    require_threads(arena_->max_concurrency());
    const auto wanted = static_cast<std::size_t>(arena_->max_concurrency());
    if (wanted > cores) allow_.emplace(global_control::max_allowed_parallelism, wanted);
}

ThreadArena::~ThreadArena() {
    allow_.reset();
    idle_arenas().give_back(size_, std::move(arena_));
}

}  // namespace mray
