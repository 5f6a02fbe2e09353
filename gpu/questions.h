// Questions about all triangles of a scene on the device.
#pragma once

#include <cstdint>
#include <functional>
#include <span>

#include "common/scene_queries.h"
#include "gpu/kernels.h"
#include "gpu/ray_passes.h"
#include "gpu/scene_buffers.h"
#include "gpu/vulkan/transfer.h"

namespace mray::gpu {

/// Answers one call at a time. All arguments of the constructor must outlive it; `start` is called
/// before each question, brings the tree to its pose, and takes ray buffers.
class Questions final : public SceneQueries {
public:
    Questions(Transfer& transfer, Kernels& kernels, RayPasses& passes, const SceneBuffers& scene,
              std::function<RayPasses::Use()> start)
        : transfer_(transfer),
          kernels_(kernels),
          passes_(passes),
          scene_(scene),
          start_(std::move(start)) {}

    void count(std::span<const Ray> rays, Crossing crossing,
               std::span<std::uint64_t> counts) const override;
    void list(std::span<const Ray> rays, Crossing crossing, std::uint32_t most,
              HitLists& lists) const override;
    void intersect_after(std::span<const Ray> rays, std::span<const HitCursor> after,
                         Crossing crossing, std::span<Hit> hits) const override;
    void wind(std::span<const vec3> points, std::span<FloatWinding> windings,
              std::vector<UncertainCrossing>& uncertain) const override;
    void closest(std::span<const vec3> points, float most_d2,
                 std::span<ClosestTriangle> closest) const override;

private:
    /// The pairs that the pixels have room for.
    std::uint32_t pair_room() const { return passes_.size().rays() / 2; }
    std::uint32_t ask(const char* what, Kernel& kernel, std::uint32_t flags,
                      std::span<uvec4> answers) const;
    void wind_part(std::span<const vec3> points, std::size_t first, std::size_t size,
                   std::span<FloatWinding> windings,
                   std::vector<UncertainCrossing>& uncertain) const;

    Transfer& transfer_;
    Kernels& kernels_;
    RayPasses& passes_;
    const SceneBuffers& scene_;
    std::function<RayPasses::Use()> start_;
};

}  // namespace mray::gpu
