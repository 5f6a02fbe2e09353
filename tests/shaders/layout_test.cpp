// Host and kernels see the same bytes in the structs that they share.
#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>

#include "shaders/kernel_interface.h"
#include "tests/shaders/layout_spirv.h"
#include "tests/support/spirv.h"

namespace mray::test {
namespace {

using Offsets = std::map<std::string, std::uint32_t>;

Offsets in_kernel(const char* type) { return SpirvModule(k_layout_spirv).member_offsets(type); }

#define OFFSET(type, member) \
    { #member, static_cast < std::uint32_t>(offsetof(type, member)) }

TEST(SharedLayout, NodesAndLeavesAgree) {
    EXPECT_EQ(in_kernel("Node"),
              (Offsets{OFFSET(Node, lower_x), OFFSET(Node, upper_x), OFFSET(Node, lower_y),
                       OFFSET(Node, upper_y), OFFSET(Node, lower_z), OFFSET(Node, upper_z),
                       OFFSET(Node, child)}));
    EXPECT_EQ(in_kernel("Leaf"), (Offsets{OFFSET(Leaf, vertex), OFFSET(Leaf, prim_id)}));
    EXPECT_EQ(in_kernel("LeafVertex"),
              (Offsets{OFFSET(LeafVertex, x), OFFSET(LeafVertex, y), OFFSET(LeafVertex, z),
                       OFFSET(LeafVertex, corners)}));
}

TEST(SharedLayout, RaysAndHitsAgree) {
    EXPECT_EQ(in_kernel("Ray"),
              (Offsets{OFFSET(Ray, org), OFFSET(Ray, tnear), OFFSET(Ray, dir), OFFSET(Ray, tfar)}));
    EXPECT_EQ(in_kernel("Hit"),
              (Offsets{OFFSET(Hit, t), OFFSET(Hit, u), OFFSET(Hit, v), OFFSET(Hit, prim_id)}));
    EXPECT_EQ(in_kernel("Suspended"),
              (Offsets{OFFSET(Suspended, ray), OFFSET(Suspended, answer_index),
                       OFFSET(Suspended, pad0), OFFSET(Suspended, pad1), OFFSET(Suspended, pad2)}));
    EXPECT_EQ(in_kernel("WorkHeader"),
              (Offsets{OFFSET(WorkHeader, status), OFFSET(WorkHeader, suspended_count),
                       OFFSET(WorkHeader, unfinished_count), OFFSET(WorkHeader, visible_count)}));
}

TEST(SharedLayout, ArgumentsAgree) {
    EXPECT_EQ(in_kernel("Camera"),
              (Offsets{OFFSET(Camera, org), OFFSET(Camera, pad0), OFFSET(Camera, corner),
                       OFFSET(Camera, pad1), OFFSET(Camera, du), OFFSET(Camera, pad2),
                       OFFSET(Camera, dv), OFFSET(Camera, pad3)}));
    EXPECT_EQ(in_kernel("ImageParams"),
              (Offsets{OFFSET(ImageParams, camera), OFFSET(ImageParams, light),
                       OFFSET(ImageParams, ao_tfar), OFFSET(ImageParams, width),
                       OFFSET(ImageParams, height), OFFSET(ImageParams, rays),
                       OFFSET(ImageParams, ao_count)}));
    EXPECT_EQ(in_kernel("RegionArguments"),
              (Offsets{OFFSET(RegionArguments, params), OFFSET(RegionArguments, x),
                       OFFSET(RegionArguments, y), OFFSET(RegionArguments, width),
                       OFFSET(RegionArguments, height), OFFSET(RegionArguments, tile_columns),
                       OFFSET(RegionArguments, tile_count), OFFSET(RegionArguments, tile_bits)}));
    EXPECT_EQ(
        in_kernel("OcclusionArguments"),
        (Offsets{OFFSET(OcclusionArguments, params), OFFSET(OcclusionArguments, x),
                 OFFSET(OcclusionArguments, y), OFFSET(OcclusionArguments, width),
                 OFFSET(OcclusionArguments, ray_first), OFFSET(OcclusionArguments, ray_end)}));
    EXPECT_EQ(in_kernel("RaysArguments"), (Offsets{OFFSET(RaysArguments, ray_count)}));
    EXPECT_EQ(in_kernel("ResumeArguments"),
              (Offsets{OFFSET(ResumeArguments, first), OFFSET(ResumeArguments, count),
                       OFFSET(ResumeArguments, fresh), OFFSET(ResumeArguments, any_hit)}));
    EXPECT_EQ(in_kernel("RefitArguments"),
              (Offsets{OFFSET(RefitArguments, first), OFFSET(RefitArguments, count)}));
}

TEST(SharedLayout, ATypeThatTheKernelDoesNotHaveHasNoOffsets) {
    EXPECT_TRUE(in_kernel("Banana").empty());
}

}  // namespace
}  // namespace mray::test
