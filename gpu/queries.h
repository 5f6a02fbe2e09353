// Queries about all triangles of a scene on the device.
#pragma once

#include <cstdint>
#include <span>

#include "common/scene_queries.h"
#include "gpu/kernels.h"
#include "gpu/ray_passes.h"
#include "gpu/scene_buffers.h"

namespace mray::gpu {

/// Answers one call at a time, with the tree at its pose and ray buffers in use.
class Queries {
public:
    Queries(Transfer& transfer, Kernels& kernels, RayPasses& passes, const SceneBuffers& scene)
        : transfer_(transfer), kernels_(kernels), passes_(passes), scene_(scene) {}

    void answer(const CountQuery& query) const;
    void answer(const ListQuery& query) const;
    void answer(const NextQuery& query) const;
    void answer(const WindingQuery& query) const;
    void answer(const ClosestQuery& query) const;

private:
    /// The pairs that the pixels have room for.
    std::uint32_t pair_room() const { return passes_.size().rays() / 2; }
    std::uint32_t run(const char* what, Kernel& kernel, std::uint32_t flags,
                      std::span<uvec4> answers) const;
    void wind_part(const WindingQuery& query, std::size_t first, std::size_t size) const;

    Transfer& transfer_;
    Kernels& kernels_;
    RayPasses& passes_;
    const SceneBuffers& scene_;
};

}  // namespace mray::gpu
