// Queries that the processors of this machine answer.
#pragma once

#include "common/backend.h"
#include "common/base/thread_arena.h"
#include "common/ray_queries.h"
#include "library/src/queries/queries.h"
#include "library/src/queries/query_cost.h"
#include "library/src/queries/ray_order.h"
#include "library/src/queries/ray_space.h"

namespace morphray::detail {

/// All arguments of the constructor must outlive it.
class HostQueries final : public Queries {
public:
    HostQueries(const mray::RayQueries& scene, const mray::Backend& backend, const RaySpace& space,
                mray::ThreadArena& arena, QueryCost& cost)
        : scene_(scene), backend_(backend), space_(space), arena_(arena), cost_(cost) {}

    void intersect(std::span<const Ray> rays, std::span<Hit> hits, Coherence coherence,
                   Threads threads, const std::atomic<bool>* cancel) const override;
    Hit intersect(const Ray& ray) const override;
    void occluded(std::span<const Ray> rays, std::span<std::uint8_t> occluded, Coherence coherence,
                  Threads threads, const std::atomic<bool>* cancel) const override;
    bool occluded(const Ray& ray) const override;
    bool prefers_order() const override { return true; }
    void ask(std::size_t total, const std::atomic<bool>* cancel, const Ask& ask) const override;

private:
    void intersect_run(std::span<const Ray> rays, std::span<Hit> hits) const;
    void occlude_run(std::span<const Ray> rays, std::span<std::uint8_t> occluded) const;
    template <class Answer, class AnswerOf>
    bool trace_tile(std::span<const Ray> rays, std::span<Answer> answers, std::size_t row,
                    std::size_t width, std::size_t height, AnswerOf answer_of) const;
    template <class Answer, class AnswerOf, class Run>
    std::size_t trace_image(std::span<const Ray> rays, std::span<Answer> answers, std::size_t row,
                            AnswerOf answer_of, Run run, mray::ThreadArena* arena,
                            const std::atomic<bool>* cancel) const;
    template <class Answer, class Run>
    bool trace_sorted(std::span<const Ray> rays, std::span<Answer> answers, Run run,
                      mray::ThreadArena* arena, const std::atomic<bool>* cancel) const;
    template <class Answer, class AnswerOf, class Run>
    void trace_all(std::span<const Ray> rays, std::span<Answer> answers, AnswerOf answer_of,
                   Run run, Coherence coherence, Threads threads,
                   const std::atomic<bool>* cancel) const;

    const mray::RayQueries& scene_;
    const mray::Backend& backend_;
    const RaySpace& space_;
    mray::ThreadArena& arena_;
    QueryCost& cost_;
    mutable RaySorterStore sorters_;
};

}  // namespace morphray::detail
