// An image from any tracer, one rectangle of pixels at a time.
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "common/base/watch.h"
#include "common/image/frame.h"
#include "common/interop/camera.h"
#include "common/interop/shading.h"
#include "common/scene/stored_rays.h"
#include "cpu/image/pixel_shader.h"
#include "cpu/packet/light/light_packet.h"
#include "cpu/tile.h"

namespace mray::cpu {

/// Makes a tracer of batches of a tracer of single rays.
template <class Tracer>
class OneByOne {
public:
    explicit OneByOne(const Tracer& tracer) : tracer_(tracer) {}

    void intersect(std::span<const Ray> rays, std::span<Hit> hits) const {
        for (std::size_t i = 0; i < rays.size(); ++i) hits[i] = tracer_.intersect(rays[i]);
    }
    void occluded(std::span<const Ray> rays, std::span<std::uint8_t> occluded) const {
        for (std::size_t i = 0; i < rays.size(); ++i) occluded[i] = tracer_.occluded(rays[i]);
    }

private:
    Tracer tracer_;
};

/// Traces those of the rays from org that have these indices.
template <class Tracer>
void occluded_among(const Tracer& tracer, vec3 org, std::span<const SharedOriginRays> rays,
                    std::span<const std::uint16_t> indices, std::span<std::uint8_t> occluded) {
    std::vector<Ray> batch;
    batch.reserve(indices.size());
    for (const std::uint16_t i : indices)
        batch.push_back(rays[i / kBlockRays].ray(org, i % kBlockRays));
    std::vector<std::uint8_t> answers(batch.size());
    tracer.occluded(batch, answers);
    for (std::size_t i = 0; i < indices.size(); ++i) occluded[indices[i]] = answers[i];
}

/// Makes a tracer of tiles of a tracer of batches.
template <class Tracer>
class BatchTiles {
public:
    explicit BatchTiles(const Tracer& tracer) : tracer_(tracer) {}

    void intersect_camera(const ImageParams& params, const Tile& tile, Hit* hits,
                          std::size_t stride, const Watch& watch = {}) const {
        std::vector<Ray> rays(tile.x1 - tile.x0);
        for (std::uint32_t y = tile.y0; y < tile.y1; ++y, hits += stride) {
            watch.throw_if_cancelled();
            for (std::uint32_t x = tile.x0; x < tile.x1; ++x) {
                rays[x - tile.x0] = camera_ray(params.camera, x, y);
            }
            tracer_.intersect(rays, std::span<Hit>(hits, rays.size()));
        }
    }

    /// Sets occluded[i] to 0 if there is a ray i from org and it hits nothing, else to 1; indices
    /// as by light_packet_ray().
    void occluded_shared_origin(vec3 org, std::span<const SharedOriginRays> rays,
                                std::span<std::uint8_t> occluded) const {
        std::fill(occluded.begin(), occluded.end(), std::uint8_t{1});
        std::vector<std::uint16_t> all(occluded.size());
        all.resize(list_rays(rays.first(occluded.size() / kBlockRays), all.data()));
        occluded_among(tracer_, org, rays, all, occluded);
    }

    /// These tracers have no packets.
    bool intersect_stored(const StoredRayTile&, Hit*) const { return false; }

    void intersect(std::span<const Ray> rays, std::span<Hit> hits) const {
        tracer_.intersect(rays, hits);
    }
    void occluded(std::span<const Ray> rays, std::span<std::uint8_t> occluded) const {
        tracer_.occluded(rays, occluded);
    }

private:
    Tracer tracer_;
};

/// Makes occlusion and colours of the hits of a tile of at most 64 x 64 pixels.
template <class Tracer>
class TileImage {
public:
    TileImage(const Tracer& tracer, const ShadedMesh& mesh, const ImageParams& params,
              const Tile& tile, Frame& frame, const Watch& watch)
        : tracer_(tracer),
          mesh_(mesh),
          params_(params),
          tile_(tile),
          frame_(frame),
          watch_(watch),
          count_(light_packet_squares(tile.x1 - tile.x0, tile.y1 - tile.y0) * kSquareRays),
          rays_(count_),
          surfaces_(count_) {}

    void trace() {
        find_surfaces();
        watch_.throw_if_cancelled();
        if (params_.rays == kRaysShadow) trace_shadow();
        for (std::uint32_t y = tile_.y0; y < tile_.y1; ++y) {
            if (params_.rays == kRaysAo) trace_ao_row(y);
            for (std::uint32_t x = tile_.x0; x < tile_.x1; ++x) finish(x, y);
        }
    }

private:
    std::size_t pixel(std::uint32_t x, std::uint32_t y) const {
        return std::size_t{y} * params_.width + x;
    }
    std::uint32_t local(std::uint32_t x, std::uint32_t y) const {
        return light_packet_ray(x - tile_.x0, y - tile_.y0);
    }
    bool is_hit(std::uint32_t x, std::uint32_t y) const {
        return frame_.hits[pixel(x, y)].prim_id != kNoPrim;
    }

    void find_surfaces() {
        for (std::uint32_t y = tile_.y0; y < tile_.y1; ++y) {
            for (std::uint32_t x = tile_.x0; x < tile_.x1; ++x) {
                frame_.occlusion[pixel(x, y)] = 0;
                if (!is_hit(x, y)) continue;
                const std::uint32_t i = local(x, y);
                rays_[i] = camera_ray(params_.camera, x, y);
                surfaces_[i] = mesh_.surface(rays_[i], frame_.hits[pixel(x, y)]);
            }
        }
    }

    /// Pixels whose surfaces face away from the light are occluded without a ray.
    void trace_shadow() {
        std::vector<SharedOriginRays> shadows(count_ / kBlockRays, SharedOriginRays::none());
        std::vector<std::uint8_t> occluded(count_, 1);
        bool any = false;
        for (std::uint32_t y = tile_.y0; y < tile_.y1; ++y) {
            for (std::uint32_t x = tile_.x0; x < tile_.x1; ++x) {
                const std::uint32_t i = local(x, y);
                if (!is_hit(x, y) || !faces_light(surfaces_[i], params_.light)) continue;
                shadows[i / kBlockRays].set(i % kBlockRays,
                                            shadow_ray(surfaces_[i], params_.light));
                any = true;
            }
        }
        if (any) tracer_.occluded_shared_origin(params_.light, shadows, occluded);
        for (std::uint32_t y = tile_.y0; y < tile_.y1; ++y) {
            for (std::uint32_t x = tile_.x0; x < tile_.x1; ++x) {
                if (is_hit(x, y)) frame_.occlusion[pixel(x, y)] = occluded[local(x, y)];
            }
        }
    }

    /// A row at a time keeps the batch in the cache.
    void trace_ao_row(std::uint32_t y) {
        watch_.throw_if_cancelled();
        batch_.clear();
        for (std::uint32_t x = tile_.x0; x < tile_.x1; ++x) {
            if (!is_hit(x, y)) continue;
            for (std::uint32_t i = 0; i < params_.ao_count; ++i) {
                batch_.push_back(ao_ray(surfaces_[local(x, y)], x, y, i, params_.ao_tfar));
            }
        }
        answers_.resize(batch_.size());
        tracer_.occluded(batch_, answers_);
        auto answer = answers_.begin();
        for (std::uint32_t x = tile_.x0; x < tile_.x1; ++x) {
            if (!is_hit(x, y)) continue;
            std::uint32_t& count = frame_.occlusion[pixel(x, y)];
            for (std::uint32_t i = 0; i < params_.ao_count; ++i) count += *answer++;
        }
    }

    void finish(std::uint32_t x, std::uint32_t y) {
        if (!frame_.with_pixels) return;
        const std::size_t at = pixel(x, y);
        const std::uint32_t i = local(x, y);
        frame_.pixels[at] = is_hit(x, y) ? shade(params_, rays_[i], surfaces_[i],
                                                 mesh_.topology->albedo[frame_.hits[at].prim_id],
                                                 frame_.occlusion[at])
                                         : background(y, params_.height);
    }

    const Tracer& tracer_;
    const ShadedMesh& mesh_;
    const ImageParams& params_;
    const Tile& tile_;
    Frame& frame_;
    const Watch& watch_;
    std::size_t count_;
    std::vector<Ray> rays_;
    std::vector<Surface> surfaces_;
    std::vector<Ray> batch_;
    std::vector<std::uint8_t> answers_;
};

/// Fills hits, occlusion and pixels of a tile of at most 64 x 64 pixels, with any tracer of tiles
/// (cpu/image/tile_tracer.h has the one for packets). Threads may trace tiles of the same frame.
/// Throws Error(kCancelled), leaving anything in the tile, soon after the watch asks for it:
/// between rows of pixels.
template <class Tracer>
void trace_tile(const Tracer& tracer, const ShadedMesh& mesh, const ImageParams& params,
                const Tile& tile, Frame& frame, const Watch& watch = {}) {
    tracer.intersect_camera(params, tile,
                            &frame.hits[std::size_t{tile.y0} * params.width + tile.x0],
                            params.width, watch);
    // The surfaces and rays of a smaller part stay in the cache.
    const std::uint32_t side = params.rays == kRaysShadow ? kLightPacketSide : kSquareSide;
    for (std::uint32_t y = tile.y0; y < tile.y1; y += side) {
        for (std::uint32_t x = tile.x0; x < tile.x1; x += side) {
            const Tile part{x, y, std::min(x + side, tile.x1), std::min(y + side, tile.y1)};
            TileImage<Tracer>(tracer, mesh, params, part, frame, watch).trace();
        }
    }
}

}  // namespace mray::cpu
