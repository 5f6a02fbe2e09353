#include "lab/bench/works/packet_sweep.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <memory>

#include "cpu/image/tile_tracer.h"
#include "cpu/single_ray/single_ray_tracer.h"

namespace mray::bench {
namespace {

static_assert(kTileSize == cpu::kSquareSide);
static_assert(std::all_of(std::begin(kPacketShapes), std::end(kPacketShapes), [](PacketShape s) {
    return cpu::kCameraSide % s.width == 0 && cpu::kCameraSide % s.height == 0;
}));

/// Whether a packet lies in a tile.
bool fits_a_tile(PacketShape shape) {
    return shape.width <= kTileSize && shape.height <= kTileSize;
}

using RayMask = std::array<std::uint8_t, cpu::kLightPacketRays>;

/// The pixels [x0, x1) x [y0, y1) of the packets of a tile.
std::vector<cpu::Tile> parts_of(const cpu::Tile& tile, PacketShape shape) {
    std::vector<cpu::Tile> parts;
    for (std::uint32_t y = tile.y0; y < tile.y1; y += shape.height) {
        for (std::uint32_t x = tile.x0; x < tile.x1; x += shape.width) {
            parts.push_back(
                {x, y, std::min(x + shape.width, tile.x1), std::min(y + shape.height, tile.y1)});
        }
    }
    return parts;
}

/// For each packet of a tile, or of a square if it does not fit one, 1 for the rays that are its
/// own.
std::vector<RayMask> masks_of(PacketShape shape) {
    std::vector<RayMask> masks;
    const std::uint32_t side = fits_a_tile(shape) ? kTileSize : kSquareSize;
    for (const cpu::Tile& part : parts_of({0, 0, side, side}, shape)) {
        RayMask& mask = masks.emplace_back();
        for (std::uint32_t y = part.y0; y < part.y1; ++y) {
            for (std::uint32_t x = part.x0; x < part.x1; ++x) mask[cpu::light_packet_ray(x, y)] = 1;
        }
    }
    return masks;
}

void intersect_image(const cpu::TileTracer& tracer, PacketShape shape, const TraceWork& work,
                     const WorkPart& part, TraceAnswers& answers) {
    const std::size_t width = work.params.width;
    tbb::parallel_for(part.first_square, part.end_square, [&](std::size_t i) {
        for (const cpu::Tile& packet : parts_of(work.squares[i].tile, shape)) {
            tracer.intersect_camera(work.params, packet,
                                    &answers.hits[packet.y0 * width + packet.x0], width);
        }
    });
}

/// A tile's rays, or a square's.
void occlude_tile(const cpu::TileTracer& tracer, std::span<const RayMask> masks,
                  const TraceWork& work, const TileRays& rays, TraceAnswers& answers) {
    const std::span<const cpu::SharedOriginRays> all = shadows_of(work, rays);
    const std::span<std::uint8_t> occluded =
        std::span(answers.occluded).subspan(rays.begin, rays.end - rays.begin);
    if (masks.size() == 1) return tracer.occluded_shared_origin(work.params.light, all, occluded);
    for (const RayMask& mask : masks) {
        std::vector<cpu::SharedOriginRays> own(all.size(), cpu::SharedOriginRays::none());
        bool any = false;
        for (std::size_t i = 0; i < occluded.size(); ++i) {
            if (mask[i] == 0 || work.active[rays.begin + i] == 0) continue;
            own[i / kPacketSize].set(i % kPacketSize, work.rays[rays.begin + i]);
            any = true;
        }
        if (!any) continue;
        RayMask own_occluded;
        tracer.occluded_shared_origin(work.params.light, own,
                                      std::span(own_occluded).first(occluded.size()));
        for (std::size_t i = 0; i < occluded.size(); ++i) {
            if (mask[i] != 0) occluded[i] = own_occluded[i];
        }
    }
}

}  // namespace

std::vector<OurTracer> packets_of_each_shape(const Bvh& bvh, const SimdTarget& target) {
    const auto tracer =
        std::make_shared<const cpu::TileTracer>(bvh, target, cpu::PacketUse::kAlways);
    std::vector<OurTracer> tracers;
    for (const PacketShape shape : kPacketShapes) {
        const auto trace = [tracer, shape, masks = masks_of(shape)](
                               const TraceWork& work, const WorkPart& part, TraceAnswers& answers) {
            if (!work.any_hit()) return intersect_image(*tracer, shape, work, part, answers);
            const auto occlude = [&](const TileRays& rays) {
                occlude_tile(*tracer, masks, work, rays, answers);
            };
            if (fits_a_tile(shape)) return for_each_tile(work, part, occlude);
            tbb::parallel_for(part.first_square, part.end_square,
                              [&](std::size_t i) { occlude(work.squares[i]); });
        };
        tracers.push_back({fmt::format("packet {}x{}", shape.width, shape.height),
                           target.name,
                           RaysAtOnce::kPacket,
                           {WorkKind::kPrimary, WorkKind::kShadow},
                           trace,
                           true});
    }
    return tracers;
}

std::vector<OurTracer> batches_of_each_size(const Bvh& bvh, const SimdTarget& target) {
    const cpu::SingleRayTracer tracer(bvh, target);
    std::vector<OurTracer> tracers;
    for (const std::size_t size : kBatchSizes) {
        const auto trace = [tracer, size](const TraceWork& work, const WorkPart& part,
                                          TraceAnswers& answers) {
            for_each_tile(work, part, [&](const TileRays& tile) {
                for_each_active_run(work, tile, [&](std::size_t begin, std::size_t end) {
                    for (; begin < end; begin += size) {
                        const std::size_t count = std::min(size, end - begin);
                        tracer.occluded(std::span(work.rays).subspan(begin, count),
                                        std::span(answers.occluded).subspan(begin, count));
                    }
                });
            });
        };
        tracers.push_back({fmt::format("stream {}", size),
                           target.name,
                           RaysAtOnce::kStream,
                           {WorkKind::kAo},
                           trace});
    }
    return tracers;
}

}  // namespace mray::bench
