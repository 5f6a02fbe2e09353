#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "common/base/aligned_vector.h"
#include "common/bvh/split.h"
#include "common/bvh/split_parts.h"

namespace morphray {
namespace {

// Sets of two chunks or more are bounded, binned and divided by chunks, each a task.
constexpr std::size_t kChunk = 8192;

// Bins an axis for large sets, which take little of the time, and for others: more of them than 16
// would make the build 7 % slower and the tree no better (docs/layout.md, "Building and
// refitting").
constexpr std::size_t kManyBins = 32;
constexpr std::size_t kFewBins = 16;

}  // namespace
}  // namespace morphray

// The same text for two kinds of registers. Attributes of functions and not options of a file, so
// that no function of a library is compiled for AVX2 and then taken by the linker for all.
#define SPLIT_NAMESPACE four_lanes
#define SPLIT_FUNCTION
#define SPLIT_EIGHT_LANES 0
#include "common/bvh/split_lanes-inl.h"
#undef SPLIT_NAMESPACE
#undef SPLIT_FUNCTION
#undef SPLIT_EIGHT_LANES

#ifdef __x86_64__
#define SPLIT_NAMESPACE eight_lanes
#define SPLIT_FUNCTION __attribute__((target("avx2")))
#define SPLIT_EIGHT_LANES 1
#include "common/bvh/split_lanes-inl.h"
#undef SPLIT_NAMESPACE
#undef SPLIT_FUNCTION
#undef SPLIT_EIGHT_LANES
#else
namespace morphray {
namespace {
namespace eight_lanes = four_lanes;
}
}  // namespace morphray
#endif

namespace morphray {

namespace {

bool has_eight_lanes() {
#ifdef __x86_64__
    static const bool has = __builtin_cpu_supports("avx2") != 0;
    return has;
#else
    return false;
#endif
}

}  // namespace

std::size_t split_binned(std::span<const PrimRef> refs, PrimRef* out) {
    return (has_eight_lanes() ? eight_lanes::split_binned : four_lanes::split_binned)(refs, out);
}

std::size_t split_few(std::span<const PrimRef> refs, PrimRef* out) {
    return (has_eight_lanes() ? eight_lanes::split_few : four_lanes::split_few)(refs, out);
}

std::size_t split_binned_in_four_lanes(std::span<const PrimRef> refs, PrimRef* out) {
    return four_lanes::split_binned(refs, out);
}

std::size_t split_few_in_four_lanes(std::span<const PrimRef> refs, PrimRef* out) {
    return four_lanes::split_few(refs, out);
}

}  // namespace morphray
