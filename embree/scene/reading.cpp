#include "embree/scene/reading.h"

#include <linux/membarrier.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <memory>
#include <mutex>
#include <thread>
#include <vector>

#include "embree/scene/scene.h"
#include "embree/thread_owned.h"

namespace mray::embree {
namespace {

// A query notes what it reads and then looks whether the scene still hands it out; a commit takes
// it back and then looks for notes. Of two such threads one sees the other if neither processor
// delays its store behind its load. Commits are rare, so the kernel orders the loads and stores of
// all threads for them, and a query pays nothing; where the kernel does not, both pay for a fence.
bool register_barrier() {
    return syscall(SYS_membarrier, MEMBARRIER_CMD_REGISTER_PRIVATE_EXPEDITED, 0) == 0;
}
const bool has_barrier = register_barrier();

void order_query() {
    if (has_barrier) {
        std::atomic_signal_fence(std::memory_order_seq_cst);
    } else {
        std::atomic_thread_fence(std::memory_order_seq_cst);
    }
}

void order_commit() {
    std::atomic_thread_fence(std::memory_order_seq_cst);
    if (has_barrier) syscall(SYS_membarrier, MEMBARRIER_CMD_PRIVATE_EXPEDITED, 0);
}

/// The threads that have asked queries. Those of threads that have ended are taken by later ones.
class Threads {
public:
    ReadingThread* take() {
        const std::scoped_lock lock(mutex_);
        if (free_.empty()) {
            all_.push_back(std::make_unique<ReadingThread>());
            return all_.back().get();
        }
        ReadingThread* const taken = free_.back();
        free_.pop_back();
        return taken;
    }
    void give(ReadingThread* thread) {
        const std::scoped_lock lock(mutex_);
        free_.push_back(thread);
    }
    bool is_read(const Committed& committed) {
        const std::scoped_lock lock(mutex_);
        for (const auto& thread : all_)
            for (const auto& read : thread->reads)
                if (read.load(std::memory_order_acquire) == &committed) return true;
        return false;
    }

private:
    std::mutex mutex_;
    std::vector<std::unique_ptr<ReadingThread>> all_;
    std::vector<ReadingThread*> free_;
};

/// Never destroyed: threads may end after the program's objects.
Threads& threads() {
    static auto* const made = new Threads;
    return *made;
}

struct FromThreads {
    static ReadingThread* make() { return threads().take(); }
    static void drop(ReadingThread* thread) { threads().give(thread); }
};

ReadingThread& this_thread() { return ThreadOwned<ReadingThread, FromThreads>::get(); }

}  // namespace

Reading::Reading(const SceneObject& scene) : thread_(this_thread()) {
    if (thread_.depth == ReadingThread::kMostNested)
        fail_operation("more than 16 queries are nested");
    std::atomic<const Committed*>& read = thread_.reads[thread_.depth];
    do {
        committed_ = scene.current();
        read.store(committed_, std::memory_order_relaxed);
        order_query();
    } while (scene.current() != committed_);
    if (committed_ == nullptr) fail_operation("the scene is not committed");
    ++thread_.depth;
}

bool wait_for_queries(const Committed& committed) {
    order_commit();
    for (const auto& read : this_thread().reads)
        if (read.load(std::memory_order_relaxed) == &committed) return false;
    // Some 0.1 s. Two filters that commit the scenes of each other would wait for ever.
    constexpr int kMostYields = 100000;
    for (int i = 0; i < kMostYields; ++i) {
        if (!threads().is_read(committed)) return true;
        std::this_thread::yield();
    }
    return false;
}

}  // namespace mray::embree
