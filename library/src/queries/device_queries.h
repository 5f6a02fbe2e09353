// Queries that a device answers, one batch at a time.
#pragma once

#include <mutex>

#include "common/backend.h"
#include "common/base/thread_arena.h"
#include "library/src/queries/queries.h"
#include "library/src/queries/query_cost.h"
#include "library/src/queries/ray_space.h"

namespace morphray::detail {

/// All arguments of the constructor must outlive it; `mutex` guards the backend.
class DeviceQueries final : public Queries {
public:
    DeviceQueries(mray::Backend& backend, std::mutex& mutex, const RaySpace& space,
                  mray::ThreadArena& arena, QueryCost& cost)
        : backend_(backend), mutex_(mutex), space_(space), arena_(arena), cost_(cost) {}

    void intersect(std::span<const Ray> rays, std::span<Hit> hits, Coherence coherence,
                   Threads threads, const std::atomic<bool>* cancel) const override;
    Hit intersect(const Ray& ray) const override;
    void occluded(std::span<const Ray> rays, std::span<std::uint8_t> occluded, Coherence coherence,
                  Threads threads, const std::atomic<bool>* cancel) const override;
    bool occluded(const Ray& ray) const override;
    bool prefers_order() const override { return backend_.info().is_on_processor; }
    void ask(std::size_t total, const std::atomic<bool>* cancel, const Ask& ask) const override;

private:
    double trace(std::span<const mray::Ray> rays, std::span<mray::Hit> hits) const;

    mray::Backend& backend_;
    std::mutex& mutex_;
    const RaySpace& space_;
    mray::ThreadArena& arena_;
    QueryCost& cost_;
};

}  // namespace morphray::detail
