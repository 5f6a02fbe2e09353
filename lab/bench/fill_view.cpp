#include "lab/bench/fill_view.h"

#include <tbb/parallel_for.h>

#include <cassert>
#include <cmath>
#include <cstdlib>
#include <numbers>
#include <optional>
#include <vector>

#include "common/interop/camera.h"
#include "cpu/reference/scalar_tracer.h"

namespace mray::bench {
namespace {

// Fine enough that the smallest window still has a thousand pixels to judge by.
constexpr std::uint32_t kProbeSide = 256;

std::vector<std::uint8_t> probe(const Camera& camera, const Bvh& bvh) {
    const cpu::ScalarTracer tracer(bvh);
    std::vector<std::uint8_t> hits(std::size_t{kProbeSide} * kProbeSide);
    tbb::parallel_for(std::uint32_t{0}, kProbeSide, [&](std::uint32_t y) {
        for (std::uint32_t x = 0; x < kProbeSide; ++x) {
            hits[std::size_t{y} * kProbeSide + x] = tracer.occluded(camera_ray(camera, x, y));
        }
    });
    return hits;
}

/// Counts of hits in rectangles (F. C. Crow. Summed-area tables for texture mapping. 1984).
class SummedHits {
public:
    SummedHits(std::span<const std::uint8_t> hits, std::uint32_t side)
        : pitch_(side + 1), sums_(std::size_t{pitch_} * pitch_) {
        for (std::uint32_t y = 0; y < side; ++y) {
            std::uint32_t row = 0;
            for (std::uint32_t x = 0; x < side; ++x) {
                row += hits[std::size_t{y} * side + x];
                sum(x + 1, y + 1) = sum(x + 1, y) + row;
            }
        }
    }

    std::uint32_t count(std::uint32_t x, std::uint32_t y, std::uint32_t side) const {
        return sum(x + side, y + side) - sum(x, y + side) - sum(x + side, y) + sum(x, y);
    }

private:
    std::uint32_t& sum(std::uint32_t x, std::uint32_t y) {
        return sums_[std::size_t{y} * pitch_ + x];
    }
    std::uint32_t sum(std::uint32_t x, std::uint32_t y) const {
        return sums_[std::size_t{y} * pitch_ + x];
    }

    std::size_t pitch_;
    std::vector<std::uint32_t> sums_;
};

/// Twice the distance from the middle, along x and y together.
std::uint32_t off_middle(const Window& window, std::uint32_t side) {
    const auto off = [&](std::uint32_t begin) {
        return std::abs(static_cast<std::int64_t>(2 * begin + window.side) - side);
    };
    return static_cast<std::uint32_t>(off(window.x) + off(window.y));
}

}  // namespace

ViewSpec fill_view(const ViewSpec& whole, const WorldBounds& bounds, const SceneSpace& space,
                   const Bvh& bvh) {
    ViewSpec coarse = whole;
    coarse.width = coarse.height = kProbeSide;
    const Camera camera = make_image_params(coarse, bounds, space).camera;
    const Window window = find_full_window(probe(camera, bvh), kProbeSide);

    // Scene space differs from world space in scale and origin only, so directions are the same.
    const double middle_x = window.x + window.side / 2.0;
    const double middle_y = window.y + window.side / 2.0;
    const ResolvedView resolved = resolve_view(coarse, bounds);
    Point forward;
    for (int axis = 0; axis < 3; ++axis) {
        forward[axis] =
            camera.corner[axis] + camera.du[axis] * middle_x + camera.dv[axis] * middle_y;
    }
    const double half_height =
        std::tan(whole.fov * (std::numbers::pi / 360)) * window.side / kProbeSide;
    const double depth = std::hypot(forward[0], forward[1], forward[2]);

    ViewSpec fill = whole;
    fill.eye = resolved.eye;
    fill.light = resolved.light;
    fill.fov = std::atan(half_height / depth) * (360 / std::numbers::pi);
    const double reach =
        std::hypot(resolved.target[0] - resolved.eye[0], resolved.target[1] - resolved.eye[1],
                   resolved.target[2] - resolved.eye[2]);
    fill.target = resolved.eye;
    for (int axis = 0; axis < 3; ++axis) (*fill.target)[axis] += reach / depth * forward[axis];
    return fill;
}

Window find_full_window(std::span<const std::uint8_t> hits, std::uint32_t side) {
    assert(side >= kMaxZoom && hits.size() == std::size_t{side} * side);
    const SummedHits summed(hits, side);
    std::optional<Window> fullest;
    for (std::uint32_t size = side; size >= side / kMaxZoom; --size) {
        std::optional<Window> full;
        for (std::uint32_t y = 0; y + size <= side; ++y) {
            for (std::uint32_t x = 0; x + size <= side; ++x) {
                const double share = double(summed.count(x, y, size)) / (double(size) * size);
                const Window window{x, y, size, share};
                if (!fullest || share > fullest->hit_share) fullest = window;
                if (share < kFullShare) continue;
                if (!full || off_middle(window, side) < off_middle(*full, side)) full = window;
            }
        }
        if (full) return *full;
    }
    return *fullest;
}

}  // namespace mray::bench
