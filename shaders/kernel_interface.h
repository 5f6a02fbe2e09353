// The interface of host and kernels: binding numbers, sizes, arguments, and the records that
// kernels pass on; tests/shaders/spirv_test.cpp compares its offsets with those in the SPIR-V.
#ifndef SHADERS_KERNEL_INTERFACE_H
#define SHADERS_KERNEL_INTERFACE_H

#include "common/interop/bvh_layout.h"
#include "common/interop/camera.h"
#include "common/interop/ray.h"

SHARED_BEGIN

// Binding numbers; a kernel's SPIR-V tells the host which of them it uses, and as what. Floats
// travel as integers, so that no device may change their bits. Every device supports four storage
// texel buffers and four storage buffers (kernel.glsl); a kernel of storage buffers uses up to 10.
SHARED_CONST uint kBindNodes = 0u;            // uvec4, in place
SHARED_CONST uint kBindLeaves = 1u;           // uvec4, in place
SHARED_CONST uint kBindPositions = 2u;        // uvec4, the last word 0; or three words each
SHARED_CONST uint kBindTriangles = 3u;        // uvec4, three vertices and the albedo
SHARED_CONST uint kBindLeafVertices = 4u;     // uint, 16 a leaf
SHARED_CONST uint kBindLeafParents = 5u;      // uint
SHARED_CONST uint kBindNodeParents = 6u;      // uint
SHARED_CONST uint kBindRays = 7u;             // uvec4, two a ray
SHARED_CONST uint kBindVisiblePixels = 8u;    // uint, indices of pixels whose camera ray hit
SHARED_CONST uint kBindFoundHits = 9u;        // uvec4, the memory of kBindHits
SHARED_CONST uint kBindFoundOcclusion = 10u;  // uint, the memory of kBindOcclusion
SHARED_CONST uint kBindRepeated = 11u;        // uint, two a triangle of Bvh::repeated
// Words of nodes and leaves, which the refit writes: storage texels or a storage buffer.
SHARED_CONST uint kBindNodeWords = 12u;  // uint
SHARED_CONST uint kBindLeafWords = 13u;  // uint
// Boxes that a device has beside the shared layout, and their words, which the refit writes.
SHARED_CONST uint kBindQuarters = 20u;      // uvec4 in place, kQuarterVec4s a node
SHARED_CONST uint kBindGroups = 21u;        // uvec4 in place, kQuarterVec4s a leaf
SHARED_CONST uint kBindQuarterWords = 22u;  // uint
SHARED_CONST uint kBindGroupWords = 23u;    // uint
// Storage buffers.
SHARED_CONST uint kBindHits = 14u;
SHARED_CONST uint kBindOcclusion = 15u;
SHARED_CONST uint kBindPixels = 16u;
SHARED_CONST uint kBindWork = 17u;
SHARED_CONST uint kBindStates = 18u;
SHARED_CONST uint kBindVisiblePixelsOut = 19u;
// Bodies that a matrix moves. kBindMovedPositions is the memory of kBindPositions, written.
SHARED_CONST uint kBindMovedPositions = 24u;  // uvec4 texels, or three words each
SHARED_CONST uint kBindRestPositions = 25u;   // as kBindPositions
SHARED_CONST uint kBindBodies = 26u;          // uvec4, kBodyVec4s each
SHARED_CONST uint kBindPackedHits = 27u;      // uint, the host's copy of hits, a storage buffer
// Lit images. kBindSurfaces is the memory of kBindRays, written.
SHARED_CONST uint kBindSurfaces = 28u;   // uvec4, a unit normal towards the eye and a depth each
SHARED_CONST uint kBindNormals = 29u;    // as kBindPositions, normals that corners share
SHARED_CONST uint kBindNormalIds = 30u;  // as kBindPositions, for the corners of each triangle
SHARED_CONST uint kBindLinear = 31u;     // float, three a pixel, a storage buffer
SHARED_CONST uint kBindingCount = 32u;

// Every kernel runs in workgroups of 64 lanes; images in tiles of 8x8 pixels.
SHARED_CONST uint kGroupSize = 64u;
SHARED_CONST uint kTileSize = 8u;
// The boxes of the four quarters of a node (slots 0 to 3, ...), and of the four groups of a leaf's
// triangles: lower x of the four, upper x, lower y, ... The refit makes each contain the padded
// boxes of its contents. A ray tests them first, and then only the contents of those that it meets.
SHARED_CONST uint kQuarterVec4s = 6u;

// The parent of the root: kNoParent.
SHARED_CONST uint kNoNodeParent = 0xFFFFFFFFu;

// A body: the rows of its transform; centre and scale of scene space; the first and the end of its
// vertices, and its first workgroup. A workgroup moves kBodyGroupVertices of them.
SHARED_CONST uint kBodySpace = 3u;
SHARED_CONST uint kBodyRange = 4u;
SHARED_CONST uint kBodyVec4s = 5u;
SHARED_CONST uint kBodyGroupVertices = 1024u;

// The refit takes this many lanes for a leaf or a node.
SHARED_CONST uint kRefitLanes = 16u;
// Tiles of shading have four pixels a lane, as wide as possible, to read in sequence.
SHARED_CONST uint kShadedTilePixels = 256u;
SHARED_CONST uint kLeastShadedTileBits = 5u;
SHARED_CONST uint kMostShadedTileBits = 8u;

// Specialisation constant 0: the iterations before a lane suspends its ray, which `resume`
// continues. Lavapipe (Mesa 22.3 to 25.0) silently ends the loops of an invocation, at most 16
// lanes, after 65,535 iterations together, each of which at least one lane counts. A lane exceeds
// its budget by less than 400 (a leaf, a stack of pops). Saving and loading a suspended ray and
// drawing a direction take fewer than 1000 for all lanes: 16 * (3500 + 400) + 1000 < 65,535. For
// queries, a search among repeated triangles takes fewer than kRepeatsSteps, loading and saving a
// state some 490, and a lane exceeds its budget by less than 350:
// 16 * (3000 + 350 + 70 + 490) + 300 < 65,535. A GPU has far larger budgets.
SHARED_CONST uint kConstantStepBudget = 0u;
SHARED_CONST uint kStepBudget = 3500u;
SHARED_CONST uint kQueryStepBudget = 3000u;
SHARED_CONST uint kRepeatsSteps = 70u;

// Entries of a stack in the kernels that begin rays, which suspend a ray that may need more: fewer
// than kMaxStack, since a GPU keeps memory for all of them and all lanes. (25 was the most in use.)
SHARED_CONST uint kShortStack = 33u;
// Kernels of queries have their stack's entries from the host.
SHARED_CONST uint kConstantStackRoom = 1u;
// Triangles of a ray that such a kernel can leave open; and none.
SHARED_CONST uint kMostOpen = 7u;
SHARED_CONST uint kNoOpen = 0xFFFFFFFFu;

/// The start of the work buffer. The host sets it to 0 before a pass over rays.
struct WorkHeader {
    /// Rays that ran out of steps, as Suspended records after the header.
    uint suspended_count;
    /// Rays that a round of `resume` left unfinished.
    uint unfinished_count;
    /// Rays with open triangles, as Suspended records at the end of the buffer.
    uint open_count;
    /// Pixels that `compact` listed, or pairs that QueryArguments::pair_room is for.
    uint visible_count;
    /// Samples with a hit among those that `lit` shaded.
    uint shown_count;
    uint pad1;
    uint pad2;
    uint pad3;
};

/// A ray that `resume` or `decide` continues, the index of its answer, and its open triangles.
struct Suspended {
    Ray ray;
    uint answer_index;
    uint open[kMostOpen];
};

// A saved traversal, as uints (shaders/traversal.glsl): the next node or leaf; the size of the
// stack, and from bit 16 on the next triangle; the four words of the answer; the stack as (child,
// key) pairs.
SHARED_CONST uint kStateCurrent = 0u;
SHARED_CONST uint kStatePlaces = 1u;
SHARED_CONST uint kStateAnswer = 2u;
SHARED_CONST uint kStateStack = 6u;
SHARED_CONST uint kStateUints = 488u;  // kStateStack + 2 * kMaxStack

/// Push constants of `primary`, `compact`, `shade`. Answers are row by row within the region.
struct RegionArguments {
    ImageParams params;
    uint x;
    uint y;
    uint width;
    uint height;
    uint tile_columns;
    uint tile_count;
    /// For `shade`: tiles are 2^tile_bits pixels wide.
    uint tile_bits;
    /// For `primary` and `shade`: the index of the first answer. For `compact`: how far the counts
    /// of occluded rays move up; 0: they are cleared.
    uint first;
};

/// Push constants of `occlusion`. Rays are numbered in the order of the list of visible pixels that
/// `compact` made of a region; those beyond the list's end are left out.
struct OcclusionArguments {
    ImageParams params;
    uint x;
    uint y;
    uint width;
    uint ray_first;
    uint ray_end;
};

// Bits of `flags` in LitArguments.
SHARED_CONST uint kLitSmooth = 1u;    // there are normals
SHARED_CONST uint kLitLinear = 2u;    // linear colours are wanted
SHARED_CONST uint kLitLeft = 4u;      // the first column is that of neighbours
SHARED_CONST uint kLitAbove = 8u;     // the first row is that of neighbours
SHARED_CONST uint kLitBetween = 16u;  // for `flat_shadows`: the second rays
// In normal ids: a corner that has the normal of its triangle.
SHARED_CONST uint kNoNormal = 0xFFFFFFFFu;
// Where a sample has both, its shadow stands above the count of its ambient occlusion.
SHARED_CONST uint kShadowShift = 16u;

/// Push constants of `find_surfaces`, `flat_shadows` and `lit`: a region of samples and what its
/// pixels show. Neighbours of its pixels' samples may surround them.
struct LitArguments {
    /// Camera, and what LitView has; `kind` is a constant of shading.h.
    vec3 org;
    uint kind;
    vec3 corner;
    uint side_bits;
    vec3 du;
    uint rays;
    vec3 dv;
    uint ao_count;
    vec3 light;
    float near;
    vec3 up;
    float per_depth;
    uint image_height;
    uint flags;
    uint x;
    uint y;
    uint width;
    uint height;
    /// Pixels.
    uint columns;
    uint rows;
};

/// Push constants of `rays` and `move_bodies`: the number of rays or bodies.
struct CountArguments {
    uint count;
};

/// Push constants of `pack_hits`: the words of the first `count` hits, as bits.
struct PackArguments {
    uint count;
    uint words;
};

// Values of QueryArguments.round.
SHARED_CONST uint kRoundAll = 0u;    // each query; those without an answer are listed
SHARED_CONST uint kRoundAgain = 1u;  // listed queries, from their saved states on
SHARED_CONST uint kRoundAnew = 2u;   // listed queries, from the root on
// Bits of QueryArguments.flags.
SHARED_CONST uint kQueryTieBreak = 1u;  // owns_hit()
SHARED_CONST uint kQueryCount = 2u;     // the number of hits
// In a number of hits: kTouchesBorder of common/scene_queries.h.
SHARED_CONST uint kCountTouches = 0x80000000u;

/// Push constants of the kernels of shaders/queries/.
struct QueryArguments {
    /// Of the listed queries.
    uint first;
    uint count;
    uint round;
    uint flags;
    uint repeated_count;
    /// The most pairs that can be listed.
    uint pair_room;
};

struct ResumeArguments {
    uint first;  // of the Suspended records
    uint count;
    uint fresh;    // 1: begin at the root; 0: continue from the saved states
    uint any_hit;  // 1: add the answer to occlusion; 0: write it to hits
};

struct DecideArguments {
    uint any_hit;  // 1: add the answer to occlusion; 0: write it to hits
};

/// Push constants of `refit_leaves` and `refit_nodes`: leaves or nodes [first, first + count).
struct RefitArguments {
    uint first;
    uint count;
};

SHARED_END

#ifdef __cplusplus
namespace mray {
static_assert(sizeof(WorkHeader) == 32 && sizeof(Suspended) == 64);
static_assert(kStateUints == kStateStack + 2 * kMaxStack);
static_assert(kRefitLanes == kWidth && kRefitLanes == kLeafVertices);
static_assert(sizeof(RegionArguments) <= 128, "the push constants that every device has");
static_assert(sizeof(LitArguments) <= 128);
}  // namespace mray
#endif

#endif  // SHADERS_KERNEL_INTERFACE_H
