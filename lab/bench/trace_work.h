// Rays to trace, the same for all methods, and the tracers of morphray that are measured.
#pragma once

#include <tbb/parallel_for.h>

#include <cstdint>
#include <functional>
#include <limits>
#include <span>
#include <string>
#include <vector>

#include "common/base/aligned_vector.h"
#include "common/bvh/bvh.h"
#include "common/interop/params.h"
#include "common/interop/ray.h"
#include "common/simd/simd_target.h"
#include "cpu/image/pixel_shader.h"
#include "lab/bench/bench_scene.h"

namespace mray::bench {

inline constexpr std::uint32_t kTileSize = 64;
inline constexpr std::uint32_t kBlockSize = 4;
inline constexpr std::size_t kPacketSize = 16;

/// Rays of the camera; from the light to what the camera sees; one diffuse ray from each point that
/// it sees; short ones there; and those of the camera row by row, for one call a ray.
enum class WorkKind { kPrimary, kShadow, kDiffuse, kAo, kOneRay };
inline constexpr WorkKind kAllWorks[] = {WorkKind::kPrimary, WorkKind::kShadow, WorkKind::kDiffuse,
                                         WorkKind::kAo, WorkKind::kOneRay};
/// "primary", "shadow", "diffuse", "ao" or "one-ray".
const char* name_of(WorkKind kind);

/// A tile of the image and its rays, which are consecutive.
struct TileRays {
    cpu::Tile tile;
    std::size_t begin;
    std::size_t end;
};

struct WorkPart {
    std::size_t begin;
    std::size_t end;
};

/// The rays of an image, tile after tile. Within a tile they come in packets of 16: for primary and
/// shadow rays 4x4 blocks in Morton order, for diffuse rays and ambient occlusion the samples of
/// one pixel after the other. A work of single rays has rows as tiles. Slots without a ray are
/// inactive: without a surface, facing away from the light, and the rest of a last packet.
struct TraceWork {
    WorkKind kind = WorkKind::kPrimary;
    /// params.rays says how an image is traced: for primary rays and for others.
    ImageParams params;
    std::vector<Ray> rays;
    /// 1 if rays[i] is active, else 0.
    std::vector<std::uint8_t> active;
    /// In the layout of packets: rays[i] is ray i % kPacketSize of shadows[i / kPacketSize].
    std::vector<cpu::SharedOriginRays> shadows;
    std::vector<TileRays> tiles;
    std::size_t active_count = 0;

    bool any_hit() const { return kind == WorkKind::kShadow || kind == WorkKind::kAo; }

    WorkPart whole() const { return {0, tiles.size()}; }
    /// `count` parts of as many tiles each as possible, or fewer if it has fewer tiles.
    std::vector<WorkPart> parts(std::size_t count) const;
};

/// hits[i] or occluded[i] (0 or 1) answers ray i; the other array is empty.
struct TraceAnswers {
    AlignedVector<Hit> hits;
    std::vector<std::uint8_t> occluded;

    explicit TraceAnswers(const TraceWork& work)
        : hits(work.any_hit() ? 0 : work.rays.size()),
          occluded(work.any_hit() ? work.rays.size() : 0) {}
};

enum class RaysAtOnce {
    /// A tile's or a packet's.
    kPacket,
    /// A tile's, whatever they are.
    kStream,
    /// One a call.
    kOne,
};

/// A way to trace a work, which outlives it.
struct Tracer {
    std::string name;
    /// Of the tracers of a group the fastest makes a row.
    std::string group = {};
    RaysAtOnce at_once = RaysAtOnce::kPacket;
    /// Runs in the calling thread's arena. This is timed.
    std::function<void(const WorkPart&)> trace;
    /// Of the last trace of each part. Records that tracers have in common hold the last one.
    std::function<TraceAnswers()> answers;
};

/// In float, t errs by some ulp of the origin's distance; larger differences are errors.
inline constexpr float kMaxRelativeT = 1e-4f;

/// Active rays that differ in hit or miss, in the triangle (mostly ties), or in t by kMaxRelativeT.
std::uint64_t count_mismatches(const TraceWork& work, const TraceAnswers& a, const TraceAnswers& b);
std::uint64_t count_mismatches(const TraceWork& work, std::span<const Hit> a,
                               std::span<const Hit> b);

/// The offset of a tile's block from its corner; blocks come in Morton order.
struct BlockOffset {
    std::uint32_t x, y;
};
constexpr BlockOffset block_offset(std::uint32_t block) {
    static_assert(kTileSize == 16 * kBlockSize);
    BlockOffset offset{0, 0};
    for (std::uint32_t bit = 0; bit < 4; ++bit) {
        offset.x += (block >> 2 * bit & 1) * (kBlockSize << bit);
        offset.y += (block >> (2 * bit + 1) & 1) * (kBlockSize << bit);
    }
    return offset;
}

/// Calls visit(x, y) for the pixels of a tile in the order of their rays.
template <class Visit>
void for_each_pixel(const cpu::Tile& tile, Visit visit) {
    for (std::uint32_t i = 0; i < kTileSize * kTileSize / kPacketSize; ++i) {
        const std::uint32_t block_x = tile.x0 + block_offset(i).x;
        const std::uint32_t block_y = tile.y0 + block_offset(i).y;
        for (std::uint32_t y = block_y; y < block_y + kBlockSize; ++y) {
            for (std::uint32_t x = block_x; x < block_x + kBlockSize; ++x) visit(x, y);
        }
    }
}

/// Calls visit(begin, end) for the longest runs of active rays of a tile.
template <class Visit>
void for_each_active_run(const TraceWork& work, const TileRays& tile, Visit visit) {
    for (std::size_t i = tile.begin; i < tile.end;) {
        if (work.active[i] == 0) {
            ++i;
            continue;
        }
        const std::size_t begin = i;
        while (i < tile.end && work.active[i] != 0) ++i;
        visit(begin, i);
    }
}

/// Calls visit(tile) for the tiles of a part, in the calling thread's arena.
template <class Visit>
void for_each_tile(const TraceWork& work, const WorkPart& part, Visit visit) {
    tbb::parallel_for(part.begin, part.end, [&](std::size_t i) { visit(work.tiles[i]); });
}

/// params.width and height must be multiples of kTileSize.
TraceWork make_primary_work(const ImageParams& params);

/// The camera's rays row by row: a work of single rays.
TraceWork make_row_work(const ImageParams& params);

/// Rays from the `hits` of `primary`: shadow rays, diffuse ones (one a pixel) or ambient occlusion
/// (`samples` a pixel). If they could be more than `most_rays`, only every n-th tile has rays, for
/// the least n.
TraceWork make_secondary_work(const TraceWork& primary, std::span<const Hit> hits,
                              const cpu::ShadedMesh& mesh, WorkKind kind, std::uint32_t samples = 1,
                              std::size_t most_rays = std::numeric_limits<std::size_t>::max());

/// Makes the rays of all works of a scene, which outlives it.
class SceneRays {
public:
    explicit SceneRays(const BenchScene& scene);

    const TraceWork& primary() const { return primary_; }
    TraceWork work(WorkKind kind) const;

private:
    const BenchScene& scene_;
    TraceWork primary_;
    AlignedVector<Hit> hits_;
};

/// "packet"; "stream", a tile's rays by one call; "single", a call a ray. The tree outlives them.
std::vector<Tracer> our_tracers(const Bvh& bvh, const SimdTarget& target, const TraceWork& work);

/// The closest hits of a work by the scalar reference, in the calling thread's arena.
AlignedVector<Hit> reference_hits(const Bvh& bvh, const TraceWork& work);

}  // namespace mray::bench
