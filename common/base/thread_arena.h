// Runs tasks on a given number of threads.
#pragma once

#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include <optional>

namespace mray {

/// Runs tasks on `threads` threads; 0 means as many as there are cores. More threads than cores are
/// created if asked for; while several arenas of such sizes exist, the smallest size applies to
/// all.
class ThreadArena {
public:
    explicit ThreadArena(int threads) : arena_(threads > 0 ? threads : tbb::task_arena::automatic) {
        using tbb::global_control;
        const auto cores = global_control::active_value(global_control::max_allowed_parallelism);
        const auto wanted = static_cast<std::size_t>(arena_.max_concurrency());
        if (wanted > cores) allow_.emplace(global_control::max_allowed_parallelism, wanted);
    }

    template <class Work>
    auto execute(Work work) {
        return arena_.execute(work);
    }
    int threads() const { return arena_.max_concurrency(); }

private:
    std::optional<tbb::global_control> allow_;
    tbb::task_arena arena_;
};

}  // namespace mray
