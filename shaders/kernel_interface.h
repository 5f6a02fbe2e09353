// What host and kernels agree on besides the scene's layout: binding numbers, sizes, arguments,
// and the records that kernels pass on. tests/shaders/layout_test.cpp reads the offsets back from
// the compiled SPIR-V.
#ifndef SHADERS_KERNEL_INTERFACE_H
#define SHADERS_KERNEL_INTERFACE_H

#include "common/interop/bvh_layout.h"
#include "common/interop/params.h"
#include "common/interop/ray.h"

SHARED_BEGIN

// Floats travel as integers, so that no device may touch their bits.
//
// Storage texel buffers that are only read, no more than the four that every device has: lavapipe
// fetches from uniform ones by a call, from these in place.
SHARED_CONST uint kBindNodes = 0u;      // RGBA32UI
SHARED_CONST uint kBindLeaves = 1u;     // RGBA32UI
SHARED_CONST uint kBindPositions = 2u;  // RGBA32UI, the last word 0
SHARED_CONST uint kBindTriangles = 3u;  // RGBA32UI, three vertices and the albedo
// Uniform texel buffers.
SHARED_CONST uint kBindLeafVertices = 4u;  // RGBA32UI, four a leaf
SHARED_CONST uint kBindLeafParents = 5u;   // R32UI
SHARED_CONST uint kBindNodeParents = 6u;   // R32UI
SHARED_CONST uint kBindRays = 7u;          // RGBA32UI, two a ray
SHARED_CONST uint kBindSeen = 8u;          // R32UI: pixels that show something
// Likewise, over the same memory as kBindHits and kBindOcclusion: what earlier passes found.
SHARED_CONST uint kBindFoundHits = 9u;        // RGBA32UI
SHARED_CONST uint kBindFoundOcclusion = 10u;  // R32UI
SHARED_CONST uint kBindKeyframes = 11u;       // RGBA32UI, two keyframes as kBindPositions
// Over the same memory as 0 and 2, for a refit, which is a quarter slower with these in place.
SHARED_CONST uint kBindRefittedNodes = 12u;  // RGBA32UI
SHARED_CONST uint kBindPose = 13u;           // RGBA32UI
// Storage texel buffers, over the same memory as 0, 1 and 2.
SHARED_CONST uint kBindNodesOut = 14u;      // R32UI
SHARED_CONST uint kBindLeavesOut = 15u;     // R32UI
SHARED_CONST uint kBindPositionsOut = 16u;  // R32UI
// Storage buffers; no kernel uses more than the four that every device has.
SHARED_CONST uint kBindHits = 17u;
SHARED_CONST uint kBindOcclusion = 18u;
SHARED_CONST uint kBindPixels = 19u;
SHARED_CONST uint kBindWork = 20u;
SHARED_CONST uint kBindStates = 21u;
SHARED_CONST uint kBindSeenOut = 22u;
SHARED_CONST uint kBindingCount = 23u;

// Every kernel runs in workgroups of 64 lanes; images in tiles of 8x8 pixels.
SHARED_CONST uint kGroupSize = 64u;
SHARED_CONST uint kTileSize = 8u;
// Shading has tiles of four pixels a lane, as wide as the region allows: memory is read on and on.
SHARED_CONST uint kShadedTilePixels = 256u;
SHARED_CONST uint kLeastShadedTileBits = 5u;
SHARED_CONST uint kMostShadedTileBits = 8u;

// Specialisation constant 0: the loop iterations that a lane counts before it suspends its ray.
// Lavapipe stops all loops of one invocation together, silently, at 65,535 iterations; an
// invocation there is a vector of at most 16 lanes, and each iteration is counted by at least one
// of them. A lane passes its budget by less than 400 (a leaf, a stack's worth of pops, and all
// triangles uncertain), saving and loading a suspended ray and drawing a direction take fewer than
// 1000 for all lanes together: 16 * (3500 + 400) + 1000 < 65,535.
SHARED_CONST uint kConstantStepBudget = 0u;
SHARED_CONST uint kStepBudget = 3500u;

// A packet is traced by a cluster of lanes (specialisation constant 1: 4, 8 or 16). The clusters of
// a subgroup share the budget; what a cluster does not count are the loops over its vectors of
// rays, less than 400 a packet.
SHARED_CONST uint kConstantPacketLanes = 1u;
SHARED_CONST uint kPacketStepBudget = 40000u;
// How many packets a cluster traces, one after the other.
SHARED_CONST uint kConstantPacketRun = 2u;
SHARED_CONST uint kPacketWidth = 16u;
// Of camera rays (with 4 lanes 8: a bit for each vector of rays has to fit a word).
SHARED_CONST uint kCameraPacketHeight = 16u;
// Of shadow rays (specialisation constant 3): where triangles are small and where they are not
// (with 4 lanes always the former).
SHARED_CONST uint kConstantPacketHeight = 3u;
SHARED_CONST uint kShadowPacketHeight = 8u;
SHARED_CONST uint kTallShadowPacketHeight = 16u;

// Rays of a packet of `occlusion_packet`.
SHARED_CONST uint kPacketRays = 32u;

// Bits of WorkHeader.status.
SHARED_CONST uint kStatusStackOverflow = 1u;
// Some packets were given up; the hits of their rays are kUnfinishedPrim.
SHARED_CONST uint kStatusUnfinished = 2u;
SHARED_CONST uint kUnfinishedPrim = 0xFFFFFFFEu;

/// Begins the work buffer. A pass over rays starts with all of it 0.
struct WorkHeader {
    uint status;
    /// Rays that ran out of steps, as Suspended records behind the header.
    uint suspended_count;
    /// Rays that a round of `resume` left unfinished.
    uint unfinished_count;
    /// Pixels that `select` found to show something.
    uint seen_count;
};

/// A ray to be traced again in rounds, and where its answer goes.
struct Suspended {
    Ray ray;
    uint answer_index;
    uint pad0;
    uint pad1;
    uint pad2;
};

// A suspended traversal, as uints: these fields, then the stack as (child, t_enter) pairs.
SHARED_CONST uint kStateCurrent = 0u;
SHARED_CONST uint kStateStackSize = 1u;
SHARED_CONST uint kStateBestPrim = 2u;
SHARED_CONST uint kStateBestT = 3u;
SHARED_CONST uint kStateBestU = 4u;
SHARED_CONST uint kStateBestV = 5u;
SHARED_CONST uint kStateStack = 6u;
SHARED_CONST uint kStateUints = 488u;  // kStateStack + 2 * kMaxStack

/// Push constants of the kernels that work on a part of an image: `primary`, `select`, `shade`.
/// Answers are stored row by row within the region.
struct RegionArguments {
    ImageParams params;
    uint x;
    uint y;
    uint width;
    uint height;
    uint tile_columns;
    uint tile_count;
    /// 1: only what packets left unfinished.
    uint unfinished_only;
    /// `shade`: tiles are 2^tile_bits pixels wide.
    uint tile_bits;
};

/// Push constants of `occlusion` and `occlusion_packet`. Rays are numbered through, pixel after
/// pixel of the list that `select` made of a region.
struct OcclusionArguments {
    ImageParams params;
    uint x;
    uint y;
    uint width;
    uint ray_first;
    uint ray_end;
};

/// Push constants of `primary_packet`. The rows are those of the inverse of the matrix with columns
/// du, dv and corner, roughly: a direction's row_x / row_z and row_y / row_z are its pixel.
struct PacketArguments {
    Camera camera;
    uint x;
    uint y;
    uint width;
    uint height;
    uint tile_columns;
    uint tile_count;
    float row_x[3];
    float row_y[3];
    float row_z[3];
};

/// Push constants of `rays`.
struct RaysArguments {
    uint ray_count;
};

/// Push constants of `resume`.
struct ResumeArguments {
    uint first;  // of the Suspended records
    uint count;
    uint fresh;    // 1: begin at the root; 0: continue from the saved states
    uint any_hit;  // 1: add the answer to occlusion; 0: write it to hits
};

/// Push constants of `refit_leaves` and `refit_nodes`: leaves or nodes [first, first + count).
struct RefitArguments {
    uint first;
    uint count;
};

/// Push constants of `deform`: vertices [first, first + count), and the texels where two keyframes
/// begin.
struct DeformArguments {
    uint first;
    uint count;
    uint before;
    uint after;
    vec3 centre;
    float f;
};

SHARED_END

#ifdef __cplusplus
namespace morphray {
static_assert(sizeof(WorkHeader) == 16 && sizeof(Suspended) == 48);
static_assert(kStateUints == kStateStack + 2 * kMaxStack);
static_assert(sizeof(RegionArguments) <= 128, "the push constants that every device has");
static_assert(sizeof(PacketArguments) <= 128, "likewise");
}  // namespace morphray
#endif

#endif  // SHADERS_KERNEL_INTERFACE_H
