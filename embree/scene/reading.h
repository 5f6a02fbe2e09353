// Queries that are under way: a commit that came between would take the scene from under them.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>

namespace mray::embree {

struct Committed;
class SceneObject;

/// The scenes that queries of a thread read, the outermost first: a filter may ask another query.
struct ReadingThread {
    static constexpr std::size_t kMostNested = 16;
    std::array<std::atomic<const Committed*>, kMostNested> reads = {};
    std::size_t depth = 0;
};

/// Keeps a scene as it was committed while a query reads it.
class Reading {
public:
    /// Throws Failure if the scene is not committed, or if too many queries are nested.
    explicit Reading(const SceneObject& scene);
    ~Reading() {
        --thread_.depth;
        thread_.reads[thread_.depth].store(nullptr, std::memory_order_release);
    }
    Reading(const Reading&) = delete;

    const Committed& committed() const { return *committed_; }

private:
    ReadingThread& thread_;
    const Committed* committed_;
};

/// Waits until no query reads `committed`, which the scene no longer hands out. Returns false if a
/// query of this thread reads it, or if one of another thread still does after some 0.1 s.
bool wait_for_queries(const Committed& committed);

}  // namespace mray::embree
