// An image from any tracer, one rectangle of pixels at a time.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/frame.h"
#include "common/interop/camera.h"
#include "common/interop/shade.h"
#include "common/mesh.h"

namespace morphray::cpu {

/// Pixels [x0, x1) x [y0, y1).
struct Tile {
    std::uint32_t x0, y0, x1, y1;
};

/// What shading needs besides hits.
struct ShadedMesh {
    const Topology* topology;
    std::span<const vec3> positions;

    Surface surface(const Ray& ray, const Hit& hit) const {
        const uvec3 t = topology->triangles[hit.prim_id];
        return surface_at(ray, hit, positions[t.x], positions[t.y], positions[t.z]);
    }
};

/// A tracer of single rays, taken as one of batches.
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

/// The secondary rays of some pixels, traced as one batch.
class SecondaryRays {
public:
    void clear() { rays_.clear(); }
    std::size_t size() const { return rays_.size(); }

    /// Adds those of pixel (x, y). A light behind the surface needs none.
    void add(const ImageParams& params, const Surface& surface, std::uint32_t x, std::uint32_t y) {
        if (params.rays == kRaysShadow && faces_light(surface, params.light)) {
            rays_.push_back(shadow_ray(surface, params.light));
        }
        if (params.rays != kRaysAo) return;
        for (std::uint32_t i = 0; i < params.ao_count; ++i) {
            rays_.push_back(ao_ray(surface, x, y, i, params.ao_tfar));
        }
    }

    template <class Tracer>
    void trace(const Tracer& tracer) {
        occluded_.resize(rays_.size());
        tracer.occluded(rays_, occluded_);
    }

    /// How many of rays [begin, end) are occluded; a shadow ray that was not needed counts as one.
    std::uint32_t count_occluded(const ImageParams& params, std::size_t begin,
                                 std::size_t end) const {
        if (params.rays == kRaysShadow && begin == end) return 1;
        std::uint32_t count = 0;
        for (std::size_t i = begin; i < end; ++i) count += occluded_[i];
        return count;
    }

private:
    std::vector<Ray> rays_;
    std::vector<std::uint8_t> occluded_;
};

/// Fills hits, occlusion and pixels of the tile with any tracer that has intersect(rays, hits) and
/// occluded(rays, flags). Tiles of one frame may be traced by several threads.
template <class Tracer>
void trace_tile(const Tracer& tracer, const ShadedMesh& mesh, const ImageParams& params, Tile tile,
                Frame& frame) {
    const std::uint32_t width = tile.x1 - tile.x0;
    std::vector<Ray> rays(width);
    std::vector<Surface> surfaces(width);
    std::vector<std::size_t> first_secondary(width + 1);
    SecondaryRays secondary;
    // A row at a time keeps the batch of secondary rays in the cache.
    for (std::uint32_t y = tile.y0; y < tile.y1; ++y) {
        const std::size_t row = std::size_t{y} * params.width + tile.x0;
        const std::span<Hit> hits(frame.hits.data() + row, width);
        for (std::uint32_t i = 0; i < width; ++i) {
            rays[i] = camera_ray(params.camera, tile.x0 + i, y);
        }
        tracer.intersect(rays, hits);
        secondary.clear();
        for (std::uint32_t i = 0; i < width; ++i) {
            first_secondary[i] = secondary.size();
            if (hits[i].prim_id == kNoPrim) continue;
            surfaces[i] = mesh.surface(rays[i], hits[i]);
            secondary.add(params, surfaces[i], tile.x0 + i, y);
        }
        first_secondary[width] = secondary.size();
        secondary.trace(tracer);
        for (std::uint32_t i = 0; i < width; ++i) {
            const bool missed = hits[i].prim_id == kNoPrim;
            const std::uint32_t occluded =
                missed
                    ? 0
                    : secondary.count_occluded(params, first_secondary[i], first_secondary[i + 1]);
            frame.occlusion[row + i] = occluded;
            frame.pixels[row + i] = missed
                                        ? background(y, params.height)
                                        : shade(params, rays[i], surfaces[i],
                                                mesh.topology->albedo[hits[i].prim_id], occluded);
        }
    }
}

}  // namespace morphray::cpu
