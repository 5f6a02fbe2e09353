// Rays to trace, the same for all methods, and the tracers of morphray.
#pragma once

#include <tbb/parallel_for.h>

#include <memory>
#include <optional>
#include <utility>

#include "common/base/aligned_vector.h"
#include "common/bvh/bvh.h"
#include "common/interop/camera.h"
#include "common/interop/ray.h"
#include "common/scene/scene_space.h"
#include "common/simd/simd_target.h"
#include "cpu/image/tile_tracer.h"

namespace mray::lab {

inline constexpr std::uint32_t kTileSize = 64;
inline constexpr std::uint32_t kBlockSize = 4;
inline constexpr std::size_t kPacketSize = 16;

/// Rays of the camera; from the light to what the camera sees; one diffuse ray from each point that
/// it sees; short ones there; those of the camera row by row, for one call a ray; and tiles of rays
/// that share an origin, lie nearly on a grid and aim at places of the scene.
enum class RayKind { kPrimary, kShadow, kDiffuse, kAo, kOneRay, kAimed };
inline constexpr RayKind kAllKinds[] = {RayKind::kPrimary, RayKind::kShadow, RayKind::kDiffuse,
                                        RayKind::kAo, RayKind::kOneRay};
/// "primary", "shadow", "diffuse", "ao", "one-ray" or "aimed".
const char* name_of(RayKind kind);

/// A tile of the image and its rays, which are consecutive.
struct TileRays {
    cpu::Tile tile;
    std::size_t begin;
    std::size_t end;
};

/// Tiles of a set of rays, by index.
struct TileRange {
    std::size_t begin;
    std::size_t end;
};

/// The rays of an image, tile after tile. Within a tile they come in packets of 16: for primary and
/// shadow rays 4x4 blocks in Morton order, for diffuse rays and ambient occlusion the samples of
/// one pixel after the other. Single rays have rows of pixels as tiles. Tiles of aimed rays have
/// the order of primary ones. Slots without a ray are inactive: without a surface, facing away from
/// the light, and the rest of a last packet.
struct RaySet {
    RayKind kind = RayKind::kPrimary;
    /// params.rays says how an image is traced: for primary rays and for others.
    ImageParams params;
    std::vector<Ray> rays;
    /// 1 if rays[i] is active, else 0.
    std::vector<std::uint8_t> active;
    /// In the layout of packets: rays[i] is ray i % kPacketSize of shadows[i / kPacketSize].
    std::vector<cpu::SharedOriginRays> shadows;
    /// Aimed rays as their packets take them: tile after tile, row by row.
    std::vector<StoredRay> stored;
    std::vector<TileRays> tiles;
    std::size_t active_count = 0;

    bool any_hit() const { return kind == RayKind::kShadow || kind == RayKind::kAo; }
    /// Whether tiles are packets of rays with a common origin.
    bool in_packets() const {
        return kind == RayKind::kPrimary || kind == RayKind::kShadow || kind == RayKind::kAimed;
    }

    TileRange whole() const { return {0, tiles.size()}; }
    /// `count` ranges of as many tiles each as possible, or fewer if it has fewer tiles.
    std::vector<TileRange> ranges(std::size_t count) const;
    /// Adds a tile whose rays are those since the last one, filled up to whole packets.
    void close_tile(const cpu::Tile& tile);
};

/// params.width and height must be multiples of kTileSize. kOneRay: row by row.
RaySet make_primary_rays(const ImageParams& params, RayKind kind = RayKind::kPrimary);

/// Rays from the `hits` of `primary`: shadow rays, diffuse ones (one a pixel) or ambient occlusion
/// (`samples` a pixel). Only every n-th tile has rays, for the least n with no more rays than
/// pixels.
RaySet make_secondary_rays(const RaySet& primary, std::span<const Hit> hits,
                           const cpu::ShadedMesh& mesh, RayKind kind, std::uint32_t samples = 1);

/// hits[i] or occluded[i] (0 or 1) answers ray i; the other array is empty.
struct TraceAnswers {
    AlignedVector<Hit> hits;
    std::vector<std::uint8_t> occluded;

    explicit TraceAnswers(const RaySet& set)
        : hits(set.any_hit() ? 0 : set.rays.size()),
          occluded(set.any_hit() ? set.rays.size() : 0) {}
};

enum class RaysAtOnce {
    kPacket,  // a tile's or a packet's
    kStream,  // a tile's, whatever they are
    kOne,     // one a call
};

/// A way to trace a set of rays, which outlives it.
struct Tracer {
    std::string name;
    /// Of the tracers of a group the fastest makes a row of the benchmark. In charts a family:
    /// "ours", "Vulkan", "GPU peer", "2007", "Embree fast", "Embree robust" or "rules".
    std::string group = {};
    RaysAtOnce at_once = RaysAtOnce::kPacket;
    /// Runs in the calling thread's arena. This is timed.
    std::function<void(const TileRange&)> trace;
    /// Of the last trace of each tile. Records that tracers have in common hold the last one.
    std::function<TraceAnswers()> answers;
    /// In charts, slow ones trace fewer rays than the others, or only these tiles.
    bool slow = false;
    std::optional<TileRange> tiles = {};
};

/// Active rays that differ in hit or miss, in the triangle (mostly ties), or in t by more than 1e-4
/// of it: in float, t errs by some ulp of the origin's distance.
std::uint64_t count_mismatches(const RaySet& set, const TraceAnswers& a, const TraceAnswers& b);

/// How many hits are of another triangle, or miss.
std::uint64_t count_other_triangles(std::span<const Hit> a, std::span<const Hit> b);

/// The offset of a tile's block from its corner; blocks come in Morton order.
constexpr std::array<std::uint32_t, 2> block_offset(std::uint32_t block) {
    static_assert(kTileSize == 16 * kBlockSize);
    std::array<std::uint32_t, 2> offset = {0, 0};
    for (std::uint32_t bit = 0; bit < 8; ++bit)
        offset[bit % 2] += (block >> bit & 1) * (kBlockSize << bit / 2);
    return offset;
}

/// Calls visit(x, y) for the pixels of a tile in the order of their rays.
template <class Visit>
void for_each_pixel(const cpu::Tile& tile, Visit visit) {
    for (std::uint32_t i = 0; i < kTileSize * kTileSize / kPacketSize; ++i) {
        const auto [block_x, block_y] = block_offset(i);
        for (std::uint32_t y = 0; y < kBlockSize; ++y)
            for (std::uint32_t x = 0; x < kBlockSize; ++x)
                visit(tile.x0 + block_x + x, tile.y0 + block_y + y);
    }
}

/// Calls visit(tile) for some tiles, in the calling thread's arena.
template <class Visit>
void for_each_tile(const RaySet& set, const TileRange& range, Visit visit) {
    tbb::parallel_for(range.begin, range.end, [&](std::size_t i) { visit(set.tiles[i]); });
}

/// For primary, shadow or aimed rays: by the tiles of any tracer. Tracers may have their answers in
/// common, which are then read after each trace.
Tracer tile_tracer(std::string name, std::shared_ptr<const cpu::ImageTracer> tracer,
                   const RaySet& set, std::shared_ptr<TraceAnswers> answers = nullptr);
/// "packet", tiles of 64 x 64, whose rays that have too little in common go to single rays;
/// "stream", the rays of a tile by one call; and "single", a call a ray: of these, in this order,
/// what suits the rays. The tree outlives these tracers.
std::vector<Tracer> our_tracers(const Bvh& bvh, const SimdTarget& target, const RaySet& set);
/// "reference": the scalar tracer.
Tracer reference_tracer(const Bvh& bvh, const RaySet& set);
/// By intersect(rays, hits) and occluded(rays, occluded) of any tracer, a ray or a tile's
/// consecutive active rays by one call.
template <class Traces>
Tracer batch_tracer(std::string name, RaysAtOnce at_once, std::shared_ptr<const Traces> tracer,
                    const RaySet& set, std::shared_ptr<TraceAnswers> answers = nullptr) {
    const std::size_t most =
        at_once == RaysAtOnce::kOne ? 1 : std::numeric_limits<std::size_t>::max();
    if (answers == nullptr) answers = std::make_shared<TraceAnswers>(set);
    const auto trace = [tracer, most, answers, &set](const TileRange& range) {
        for_each_tile(set, range, [&](const TileRays& tile) {
            for (std::size_t end = tile.begin; end < tile.end;) {
                const std::size_t begin = end;
                const std::size_t limit = begin + std::min(most, tile.end - begin);
                while (end < limit && set.active[end] != 0) ++end;
                const std::size_t count = end - begin;
                const auto rays = std::span(set.rays).subspan(begin, count);
                if (count == 0) {
                    ++end;
                } else if (set.any_hit()) {
                    tracer->occluded(rays, std::span(answers->occluded).subspan(begin, count));
                } else {
                    tracer->intersect(rays, std::span(answers->hits).subspan(begin, count));
                }
            }
        });
    };
    return {.name = std::move(name), .at_once = at_once, .trace = trace, .answers = [answers] {
                return *answers;
            }};
}

/// Traces all rays in the calling thread's arena.
TraceAnswers trace_all(const Tracer& tracer, const RaySet& set);

}  // namespace mray::lab
