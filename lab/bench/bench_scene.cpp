#include "lab/bench/bench_scene.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "common/bvh/builder/bvh_builder.h"
#include "common/interop/camera.h"
#include "cpu/reference/scalar_tracer.h"

namespace mray::lab {
namespace {

// Fine enough that the smallest window still has a thousand pixels to judge by.
constexpr std::uint32_t kProbeSide = 256;

/// Counts of a camera's hits in rectangles (F. C. Crow. Summed-area tables for texture mapping.
/// 1984).
class HitCounts {
public:
    HitCounts(const Camera& camera, const Bvh& bvh) : sums_(kPitch * kPitch) {
        const cpu::ScalarTracer tracer(bvh);
        tbb::parallel_for(std::uint32_t{0}, kProbeSide, [&](std::uint32_t y) {
            for (std::uint32_t x = 0; x < kProbeSide; ++x) {
                const bool is_hit = tracer.occluded(camera_ray(camera, x, y));
                sums_[at(x + 1, y + 1)] = sums_[at(x, y + 1)] + (is_hit ? 1 : 0);
            }
        });
        for (std::size_t i = kPitch; i < sums_.size(); ++i) sums_[i] += sums_[i - kPitch];
    }

    std::uint32_t count(std::uint32_t x, std::uint32_t y, std::uint32_t side) const {
        return sums_[at(x + side, y + side)] - sums_[at(x, y + side)] - sums_[at(x + side, y)] +
               sums_[at(x, y)];
    }

private:
    static constexpr std::size_t kPitch = kProbeSide + 1;

    static std::size_t at(std::uint32_t x, std::uint32_t y) { return y * kPitch + x; }

    std::vector<std::uint32_t> sums_;
};

struct Window {
    std::uint32_t x;
    std::uint32_t y;
    std::uint32_t side;
    /// The share of its pixels that are hits, from 0 to 1.
    double hit_share;
};

/// Twice the distance from the middle, along x and y together.
std::uint32_t off_middle(const Window& window) {
    const auto off = [&](std::uint32_t begin) {
        return std::abs(static_cast<std::int64_t>(2 * begin + window.side) - kProbeSide);
    };
    return static_cast<std::uint32_t>(off(window.x) + off(window.y));
}

/// The largest full window, of these the nearest to the middle; or the one of the greatest share.
Window find_full_window(const HitCounts& hits) {
    std::optional<Window> fullest;
    for (std::uint32_t size = kProbeSide; size >= kProbeSide / kMaxZoom; --size) {
        std::optional<Window> full;
        for (std::uint32_t y = 0; y + size <= kProbeSide; ++y) {
            for (std::uint32_t x = 0; x + size <= kProbeSide; ++x) {
                const double share = double(hits.count(x, y, size)) / (double(size) * size);
                const Window window{x, y, size, share};
                if (!fullest || share > fullest->hit_share) fullest = window;
                if (share < kFullShare) continue;
                if (!full || off_middle(window) < off_middle(*full)) full = window;
            }
        }
        if (full) return *full;
    }
    return *fullest;
}

std::vector<vec3> nudged(std::vector<vec3> positions) {
    for (vec3& p : positions) {
        for (int axis = 0; axis < 3; ++axis) p[axis] = std::nextafter(p[axis], 0.0f);
    }
    return positions;
}

/// The extent of all whole frames, since a benchmark traces several of them from one camera.
PoseExtent extent_of_frames(const Animation& animation) {
    PoseExtent all;
    std::vector<vec3> positions(animation.topology().vertex_count);
    for (double frame = animation.first_frame(); frame <= animation.last_frame(); ++frame) {
        animation.positions(frame, positions);
        all.add(positions);
    }
    return all;
}

/// The field of view of views from inside, in degrees.
constexpr double kInsideFov = 70;

}  // namespace

ViewSpec fill_view(const ViewSpec& whole, const WorldBounds& bounds, const SceneSpace& space,
                   const Bvh& bvh) {
    ViewSpec coarse = whole;
    coarse.width = coarse.height = kProbeSide;
    const Camera camera = make_image_params(coarse, bounds, space).camera;
    const Window window = find_full_window(HitCounts(camera, bvh));

    // Scene space differs from world space in scale and origin only, so directions are the same.
    const double middle_x = window.x + window.side / 2.0;
    const double middle_y = window.y + window.side / 2.0;
    const ResolvedView resolved = resolve_view(coarse, bounds);
    const glm::dvec3 forward = glm::dvec3(camera.corner) + glm::dvec3(camera.du) * middle_x +
                               glm::dvec3(camera.dv) * middle_y;
    const double half_height =
        std::tan(whole.fov * (std::numbers::pi / 360)) * window.side / kProbeSide;
    const double depth = std::hypot(forward.x, forward.y, forward.z);

    ViewSpec fill = whole;
    fill.eye = resolved.eye;
    fill.light = resolved.light;
    fill.fov = std::atan(half_height / depth) * (360 / std::numbers::pi);
    const glm::dvec3 eye = to_dvec3(resolved.eye);
    const glm::dvec3 to_target = to_dvec3(resolved.target) - eye;
    const double reach = std::hypot(to_target.x, to_target.y, to_target.z);
    fill.target = to_point(eye + reach / depth * forward);
    return fill;
}

std::vector<vec3> positions_at(const BenchScene& scene, double frame) {
    std::vector<vec3> positions(scene.topology().vertex_count);
    scene.animation->positions(frame, positions);
    scene.space.to_scene(positions, positions);
    return positions;
}

BenchScene open_bench_scene(const std::string& spec, const ViewSpec& view) {
    BenchScene scene;
    scene.name = spec;
    AnimationOptions lenient;
    lenient.lenient = true;
    scene.animation = open_scene(spec, lenient);
    const Animation& animation = *scene.animation;
    scene.space = space_of_pose(animation.bounds(), extent_of_frames(animation));
    const double middle = std::floor((animation.first_frame() + animation.last_frame()) / 2);
    scene.positions = positions_at(scene, middle);
    scene.moved = animation.last_frame() > animation.first_frame()
                      ? positions_at(scene, std::min(middle + 1, animation.last_frame()))
                      : nudged(scene.positions);
    scene.bvh = build_bvh(animation.topology(), scene.positions);
    if (const std::optional<InsideView> inside = animation.inside_view()) {
        scene.view = view;
        scene.view.eye = inside->eye;
        scene.view.target = inside->target;
        scene.view.light = inside->light;
        scene.view.fov = kInsideFov;
    } else {
        scene.view = fill_view(view, animation.bounds(), scene.space, scene.bvh);
    }
    scene.params = make_image_params(scene.view, animation.bounds(), scene.space);
    return scene;
}

SceneRays::SceneRays(const BenchScene& scene)
    : scene_(scene),
      primary_(make_primary_rays(scene.params)),
      hits_(trace_all(reference_tracer(scene.bvh, primary_), primary_).hits) {}

RaySet SceneRays::rays(RayKind kind) const {
    // As many rays in all as an image has pixels, so that each kind takes about as long.
    constexpr std::uint32_t kAoSamples = 4;
    if (kind == RayKind::kPrimary) return primary_;
    if (kind == RayKind::kOneRay) return make_row_rays(scene_.params);
    return make_secondary_rays(primary_, hits_, scene_.mesh(), kind, kAoSamples,
                               primary_.rays.size());
}

}  // namespace mray::lab
