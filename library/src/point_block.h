// Points of a call in scene space, in the order in which they are asked about.
#pragma once

#include "library/src/query_plan.h"

namespace morphray::detail {

inline mray::vec3 to_vector(const Vec3& p) { return {p.x, p.y, p.z}; }

/// Points that are converted and ordered together, which cannot be cancelled.
class PointBlock {
public:
    /// The points [first, first + count) of a call. All arguments must outlive it.
    PointBlock(SceneImpl& scene, std::span<const Vec3> all, std::size_t first, std::size_t count,
               QueryFilter& filter);

    /// Chooses the order; before, it is the one given. A few points keep it.
    void sort(PointOrder by);
    /// Calls work(part), which asks queries of this type, for a PointPart at a time, in many
    /// threads if that pays. Throws mray::Error(kCancelled).
    template <class Query, class Work>
    void for_parts(Work work) const;

private:
    friend class PointPart;

    SceneImpl& scene_;
    std::span<const Vec3> world_;
    std::size_t first_;
    QueryFilter& filter_;
    /// Those that are not finite have is_finite_ 0 and some place.
    std::vector<mray::vec3> points_;
    /// Before they were rounded, or brought nearer.
    std::vector<mray::dvec3> exact_;
    std::vector<std::uint8_t> is_finite_;
    /// Empty for the order given.
    std::vector<std::uint32_t> order_;
};

/// Points of a block, of which neighbours are alike.
class PointPart {
public:
    /// Point i of the part is point places[i] of the block, which must outlive it.
    PointPart(const PointBlock& block, std::vector<std::uint32_t> places);

    std::size_t size() const { return places_.size(); }
    SceneImpl& scene() const { return block_.scene_; }
    mray::Watch watch() const { return block_.filter_.watch(); }
    std::span<const mray::vec3> points() const { return points_; }
    const mray::dvec3& exact(std::size_t i) const { return block_.exact_[places_[i]]; }
    bool is_finite(std::size_t i) const { return block_.is_finite_[places_[i]] != 0; }
    const Vec3& world(std::size_t i) const { return block_.world_[places_[i]]; }
    /// That of the point in the call.
    std::size_t number(std::size_t i) const { return block_.first_ + places_[i]; }
    /// These points of the part.
    PointPart only(std::span<const std::size_t> chosen) const;

    /// Asks a query about points().
    template <class Query>
    void ask(const Query& query) const {
        block_.filter_.ask(query, [this](std::size_t i) { return number(i); });
    }

private:
    const PointBlock& block_;
    std::vector<std::uint32_t> places_;
    std::vector<mray::vec3> points_;
};

template <class Query, class Work>
void PointBlock::for_parts(Work work) const {
    const auto work_on = [&](std::size_t begin, std::size_t size) {
        std::vector<std::uint32_t> places(size);
        for (std::size_t i = 0; i < size; ++i)
            places[i] = order_.empty() ? static_cast<std::uint32_t>(begin + i) : order_[begin + i];
        work(PointPart(*this, std::move(places)));
    };
    for_query_parts<Query>(scene_, points_.size(), filter_, work_on);
}

/// Calls work(block) for blocks of points. Throws Error for wrong options, and
/// mray::Error(kCancelled).
template <class Work>
void for_point_blocks(SceneImpl& scene, std::span<const Vec3> points, std::size_t answer_count,
                      const QueryOptions& options, Work work) {
    constexpr std::size_t kMost = std::size_t{1} << 20;
    require_room(points.size(), "points", answer_count);
    QueryFilter filter(scene, points.size(), "points", options);
    const auto work_on = [&](std::size_t first, std::size_t count) {
        PointBlock block(scene, points, first, count, filter);
        work(block);
    };
    mray::for_watched_runs(0, points.size(), filter.watch(), kMost, 0, work_on);
    filter.watch().throw_if_cancelled();
}

}  // namespace morphray::detail
