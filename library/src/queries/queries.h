// Queries of rays in world space.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>

#include "common/scene_queries.h"
#include "morphray/geometry.hpp"
#include "morphray/queries.hpp"

namespace morphray::detail {

/// Answers rays of the caller at the current pose of a scene, as the members of Scene of these
/// names, and reports their cost. Threads may call at the same time. The spans of a call have one
/// size; `cancel` may be null.
class Queries {
public:
    virtual ~Queries() = default;

    virtual void intersect(std::span<const Ray> rays, std::span<Hit> hits, Coherence coherence,
                           Threads threads, const std::atomic<bool>* cancel) const = 0;
    virtual Hit intersect(const Ray& ray) const = 0;
    virtual void occluded(std::span<const Ray> rays, std::span<std::uint8_t> occluded,
                          Coherence coherence, Threads threads,
                          const std::atomic<bool>* cancel) const = 0;
    virtual bool occluded(const Ray& ray) const = 0;
    /// Whether questions about rays whose neighbours are alike take less time, by more than
    /// ordering them takes.
    virtual bool prefers_order() const = 0;

    /// Asks about the questions [0, total) in parts: calls ask(queries, first, count), in many
    /// threads or in this one, where `queries` are those of the scene. Parts have at most
    /// kMaxBatch questions. Throws Error(kCancelled).
    static constexpr std::size_t kMaxBatch = std::size_t{1} << 16;
    using Ask = std::function<void(const mray::SceneQueries&, std::size_t, std::size_t)>;
    virtual void ask(std::size_t total, const std::atomic<bool>* cancel, const Ask& ask) const = 0;
};

}  // namespace morphray::detail
