// Runs tasks on a given number of threads.
#pragma once

#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include <map>
#include <optional>

namespace mray {

/// Arenas by their size.
using ThreadArenas = std::multimap<int, tbb::task_arena>;

/// Runs tasks on `threads` threads; 0 means as many as there are cores. While several arenas with
/// more threads than cores exist, the smallest size applies to all.
///
/// Arenas of oneTBB are used again by later objects of their size: oneTBB frees an arena only when
/// a worker visits it after the caller has left, which on a busy machine may never happen.
class ThreadArena {
public:
    explicit ThreadArena(int threads);
    ~ThreadArena();
    ThreadArena(const ThreadArena&) = delete;
    ThreadArena& operator=(const ThreadArena&) = delete;

    template <class Work>
    auto execute(Work work) {
        const Call call;
        return arena_.mapped().execute(work);
    }
    int threads() const { return arena_.mapped().max_concurrency(); }

private:
    /// Throws Error(kUnavailable) if this process was forked during calls, whose locks it holds.
    struct Call {
        Call();
        ~Call();
    };

    /// The destructor hands it back without taking memory.
    ThreadArenas::node_type arena_;
    std::optional<tbb::global_control> allow_;
};

}  // namespace mray
