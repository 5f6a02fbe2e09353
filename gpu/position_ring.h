// Positions on their way to the device while it may still read those before.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/update/refit_plan.h"
#include "gpu/vulkan/buffer.h"

namespace morphray::gpu {

/// Two slots of host memory that stay mapped, for all positions of a scene each: one is written
/// while what reads the other is under way.
class PositionRing {
public:
    PositionRing() = default;
    /// The slots are allocated when they are first of use.
    explicit PositionRing(std::uint32_t vertex_count) : vertex_count_(vertex_count) {}

    /// Writes ranges of the positions to the slot that was written longest ago. Returns what copies
    /// them to `to`, each followed by a word of 0, and makes them visible to kernels.
    Record write(Context& context, std::span<const vec3> positions,
                 std::span<const IndexRange> ranges, const Buffer& to);

private:
    std::uint32_t vertex_count_ = 0;
    Buffer slots_[2];
    std::uint32_t next_ = 0;
};

}  // namespace morphray::gpu
