#include "lab/bench/bench_scene.h"

#include <numbers>

#include "common/bvh/box.h"
#include "common/bvh/builder/bvh_builder.h"
#include "cpu/reference/scalar_tracer.h"
#include "lab/methods/random.h"

namespace mray::lab {
namespace {

// Fine enough that the smallest window still has a thousand pixels to judge by.
constexpr std::uint32_t kProbeSide = 256;

struct Window {
    std::uint32_t x;
    std::uint32_t y;
    std::uint32_t side;
    /// The share of its pixels that are hits, at most kFullShare.
    double hit_share;
};

/// The largest full window of an image, of these the nearest to the middle; or the one of the
/// greatest share.
Window find_full_window(const Camera& camera, const Bvh& bvh) {
    // Hits in rectangles (F. C. Crow. Summed-area tables for texture mapping. 1984).
    constexpr std::size_t kPitch = kProbeSide + 1;
    std::vector<std::uint32_t> sums(kPitch * kPitch);
    const auto sum = [&](std::size_t x, std::size_t y) -> std::uint32_t& {
        return sums[y * kPitch + x];
    };
    const cpu::ScalarTracer tracer(bvh);
    tbb::parallel_for(std::uint32_t{0}, kProbeSide, [&](std::uint32_t y) {
        for (std::uint32_t x = 0; x < kProbeSide; ++x) {
            const bool is_hit = tracer.occluded(camera_ray(camera, x, y));
            sum(x + 1, y + 1) = sum(x, y + 1) + (is_hit ? 1 : 0);
        }
    });
    for (std::size_t i = kPitch; i < sums.size(); ++i) sums[i] += sums[i - kPitch];
    // Twice the distance from the middle, along x and y together.
    const auto off_middle = [](const Window& window) {
        const auto off = [&](std::uint32_t begin) {
            return std::abs(static_cast<std::int64_t>(2 * begin + window.side) - kProbeSide);
        };
        return off(window.x) + off(window.y);
    };
    Window best{0, 0, kProbeSide, 0};
    for (std::uint32_t size = kProbeSide; size >= kProbeSide / kMaxZoom; --size) {
        for (std::uint32_t y = 0; y + size <= kProbeSide; ++y) {
            for (std::uint32_t x = 0; x + size <= kProbeSide; ++x) {
                const std::uint32_t hits =
                    sum(x + size, y + size) - sum(x, y + size) - sum(x + size, y) + sum(x, y);
                const double share = std::min(hits / (double(size) * size), kFullShare);
                const Window window{x, y, size, share};
                if (share > best.hit_share ||
                    (share == kFullShare && off_middle(window) < off_middle(best)))
                    best = window;
            }
        }
        if (best.hit_share == kFullShare) break;
    }
    return best;
}

constexpr double kInsideFov = 70;

Box box_of_vertices(const BenchScene& scene) {
    Box box;
    for (const vec3& p : scene.positions)
        if (is_finite_vertex(p)) box.extend(p);
    return box;
}

vec3 point_in(const Box& box, Random& random) {
    return box.lower + (box.upper - box.lower) * (vec3(random.point(0.5)) + vec3(0.5f));
}

}  // namespace

ViewSpec fill_view(const ViewSpec& whole, const WorldBounds& bounds, const SceneSpace& space,
                   const Bvh& bvh) {
    ViewSpec coarse = whole;
    coarse.width = coarse.height = kProbeSide;
    const Camera camera = make_image_params(coarse, bounds, space).camera;
    const Window window = find_full_window(camera, bvh);

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

BenchScene open_bench_scene(const std::string& spec, std::uint32_t size, double distance) {
    BenchScene scene;
    scene.name = spec;
    AnimationOptions lenient;
    lenient.lenient = true;
    scene.animation = open_scene(spec, lenient);
    const Animation& animation = *scene.animation;
    // Several frames are traced from one camera.
    PoseExtent extent;
    std::vector<vec3> positions(animation.topology().vertex_count);
    for (double frame = animation.first_frame(); frame <= animation.last_frame(); ++frame) {
        animation.positions(frame, positions);
        extent.add(positions);
    }
    scene.space = space_of_pose(animation.bounds(), extent);
    const double middle = std::floor((animation.first_frame() + animation.last_frame()) / 2);
    scene.positions = positions_at(scene, middle);
    scene.moved = positions_at(scene, std::min(middle + 1, animation.last_frame()));
    if (animation.last_frame() == animation.first_frame()) {
        for (vec3& p : scene.moved)
            for (int axis = 0; axis < 3; ++axis) p[axis] = std::nextafter(p[axis], 0.0f);
    }
    scene.bvh = build_bvh(animation.topology(), scene.positions);
    ViewSpec view;
    view.width = view.height = size;
    if (distance > 0) {
        view.width = 1920;
        view.height = 1088;
        const ResolvedView whole = resolve_view(view, animation.bounds());
        const glm::dvec3 target = to_dvec3(whole.target);
        view.target = whole.target;
        view.eye = to_point(target + distance * (to_dvec3(whole.eye) - target));
    } else if (const std::optional<InsideView> inside = animation.inside_view()) {
        view.eye = inside->eye;
        view.target = inside->target;
        view.light = inside->light;
        view.fov = kInsideFov;
    } else {
        view = fill_view(view, animation.bounds(), scene.space, scene.bvh);
    }
    scene.params = make_image_params(view, animation.bounds(), scene.space);
    scene.primary = make_primary_rays(scene.params);
    scene.hits = trace_all(reference_tracer(scene.bvh, scene.primary), scene.primary).hits;
    return scene;
}

RaySet BenchScene::rays(RayKind kind) const {
    constexpr std::uint32_t kAoSamples = 4;
    if (kind == RayKind::kPrimary) return primary;
    if (kind == RayKind::kOneRay) return make_primary_rays(params, kind);
    return make_secondary_rays(primary, hits, {&topology(), positions}, kind, kAoSamples);
}

std::vector<vec3> points_in_box(const BenchScene& scene, std::size_t count) {
    const Box box = box_of_vertices(scene);
    Random random(1);
    std::vector<vec3> points(count);
    for (vec3& p : points) p = point_in(box, random);
    return points;
}

std::vector<vec3> points_near_surface(const BenchScene& scene, std::size_t count) {
    const std::vector<uvec3>& triangles = scene.topology().triangles;
    const Box box = box_of_vertices(scene);
    const vec3 sides = box.upper - box.lower;
    const double reach = 0.01 * std::max({sides.x, sides.y, sides.z});
    Random random(1);
    std::vector<vec3> points(count);
    for (vec3& point : points) {
        const uvec3 t = triangles[random.below(triangles.size())];
        const vec3 a = scene.positions[t.x];
        const vec3 b = scene.positions[t.y];
        const vec3 c = scene.positions[t.z];
        // Uniform over the triangle.
        const double v = 1 - std::sqrt(random.real(0, 1));
        const double u = random.real(0, 1 - v);
        const bool finite = is_finite_vertex(a) && is_finite_vertex(b) && is_finite_vertex(c);
        const vec3 place = finite ? a + float(u) * (b - a) + float(v) * (c - a) : vec3(0);
        point = place + vec3(random.point(reach));
    }
    return points;
}

std::vector<Ray> random_rays(const BenchScene& scene, std::size_t count) {
    const Box box = box_of_vertices(scene);
    Random random(1);
    std::vector<Ray> rays(count);
    for (Ray& ray : rays) {
        const vec3 org = point_in(box, random);
        vec3 dir(random.point(1));
        while (glm::dot(dir, dir) > 1 || glm::dot(dir, dir) < 0.01f) dir = vec3(random.point(1));
        ray = {org, 0, dir, kInfiniteT};
    }
    return rays;
}

}  // namespace mray::lab
