#include "lab/accuracy/chart_scene.h"

#include <cmath>
#include <cstring>
#include <glm/geometric.hpp>
#include <numbers>

#include "common/bvh/builder/bvh_builder.h"
#include "common/scene/camera_setup.h"
#include "cpu/reference/scalar_tracer.h"
#include "lab/methods/random.h"
#include "scenes/procedural/surfaces.h"

namespace mray::lab {
namespace {

/// A point that both spaces have exactly.
vec3 shared_point(const SceneSpace& space, vec3 scene) {
    return space.point_to_scene(space.to_world(scene), "a ray's origin");
}

/// A turn around the scene that never comes back to the same place.
constexpr double kGoldenAngle = 2.399963229728653;

/// The pixels of a square image; its eye and light are points of both spaces.
RaySet camera_rays(const ChartScene& scene, std::size_t chunk, std::uint32_t side) {
    ViewSpec view;
    view.width = view.height = side;
    view.fov = kChartFov;
    const ResolvedView first = resolve_view(view, scene.bounds);
    const dvec3 target = to_dvec3(first.target);
    const dvec3 way = to_dvec3(first.eye) - target;
    const double angle = kGoldenAngle * static_cast<double>(chunk);
    view.target = first.target;
    view.eye = to_point(target + dvec3(std::cos(angle) * way.x + std::sin(angle) * way.z, way.y,
                                       std::cos(angle) * way.z - std::sin(angle) * way.x));
    ImageParams params = make_image_params(view, scene.bounds, scene.space);
    view.eye = to_point(dvec3(scene.space.to_world(params.camera.org)));
    view.light = to_point(dvec3(scene.space.to_world(params.light)));
    params = make_image_params(view, scene.bounds, scene.space);
    return make_primary_rays(params);
}

/// Where the rays of a grid go: pixel (x, y) to forward + (x - 31.5) right + (y - 31.5) down.
struct RayGrid {
    dvec3 org, right, down, forward;

    vec3 dir(double x, double y) const {
        const double middle = 0.5 * kTileSize - 0.5;
        return canonical_direction(vec3(forward + (x - middle) * right + (y - middle) * down));
    }
    /// The place of a point in front of the grid, in pixels.
    dvec3 place(const dvec3& p) const {
        const dvec3 way = p - org;
        const double z = glm::dot(way, forward);
        const double scale = z * glm::dot(right, right);
        const double middle = 0.5 * kTileSize - 0.5;
        return {glm::dot(way, right) / scale + middle, glm::dot(way, down) / scale + middle, z};
    }
};

/// The farthest that an aimed ray is from its place on the grid, in pixels.
constexpr double kMostTurn = 0.4;

/// The ray of pixel (x, y), which hits a triangle, turned to its nearest corner or edge.
vec3 aimed_direction(const RayGrid& grid, double x, double y, const std::array<dvec3, 3>& corner) {
    std::array<dvec3, 3> place;
    for (std::size_t i = 0; i < 3; ++i) {
        place[i] = grid.place(corner[i]);
        if (!(place[i].z > 0)) return grid.dir(x, y);
    }
    const auto distance = [&](const dvec3& p) {
        return std::max(std::abs(p.x - x), std::abs(p.y - y));
    };
    const auto toward = [&](const dvec3& p) { return canonical_direction(vec3(p - grid.org)); };
    for (std::size_t i = 0; i < 3; ++i)
        if (distance(place[i]) <= kMostTurn) return toward(corner[i]);
    for (std::size_t i = 0; i < 3; ++i) {
        const dvec3& p = corner[i];
        const dvec3 edge = corner[(i + 1) % 3] - p;
        // The edge's nearest point to the ray's line.
        const dvec3 d(grid.dir(x, y));
        const dvec3 across = edge - glm::dot(edge, d) / glm::dot(d, d) * d;
        const double length2 = glm::dot(across, across);
        if (!(length2 > 0)) continue;
        const dvec3 nearest =
            p + std::clamp(glm::dot(grid.org - p, across) / length2, 0.0, 1.0) * edge;
        if (distance(grid.place(nearest)) <= kMostTurn) return toward(nearest);
    }
    return grid.dir(x, y);
}

/// An origin near to a target, around the scene, far away or inside, and axes towards the target.
RayGrid make_grid(const ChartScene& scene, Random& random, std::size_t number) {
    constexpr std::array kReach = {0.02, 1.0, 3.0, 0.3};
    const std::vector<vec3>& positions = scene.scene_space.positions;
    const uvec3 t = scene.targets[random.below(scene.targets.size())];
    const dvec3 target =
        (dvec3(positions[t.x]) + dvec3(positions[t.y]) + dvec3(positions[t.z])) / 3.0;
    const double reach = kReach[number % 4] * kSceneExtent;
    const dvec3 around = number % 4 == 0 ? target : dvec3(0, 0, 0);
    const dvec3 org(shared_point(scene.space, vec3(around + random.point(reach))));
    const dvec3 forward = direction_of(target - org);
    // Pixels of the size of a triangle, half or a quarter of it.
    const double size = glm::length(dvec3(positions[t.y]) - dvec3(positions[t.x])) /
                        std::max(glm::length(target - org), 1e-30);
    const double step = std::clamp(size * std::array{0.25, 0.5, 1.0}[number / 4 % 3], 1e-7, 0.02);
    const dvec3 up = std::abs(forward.y) < 0.9 ? dvec3(0, 1, 0) : dvec3(1, 0, 0);
    const dvec3 right = direction_of(glm::cross(forward, up));
    return {org, step * right, step * glm::cross(forward, right), forward};
}

RaySet aimed_tiles(const ChartScene& scene, std::size_t chunk, std::size_t tiles) {
    RaySet set;
    set.kind = RayKind::kAimed;
    const cpu::Tile tile{0, 0, kTileSize, kTileSize};
    constexpr std::size_t kTileRays = std::size_t{kTileSize} * kTileSize;
    set.rays.resize(tiles * kTileRays);
    set.stored.resize(set.rays.size());
    const cpu::ScalarTracer tracer(scene.bvh);
    tbb::parallel_for(std::size_t{0}, tiles, [&](std::size_t number) {
        Random random(1000003 * chunk + number);
        const RayGrid grid = make_grid(scene, random, number);
        std::size_t at = number * kTileRays;
        for_each_pixel(tile, [&](std::uint32_t x, std::uint32_t y) {
            Ray& ray = set.rays[at++];
            ray = {vec3(grid.org), 0, grid.dir(x, y), kInfiniteT};
            const Hit hit = tracer.intersect(ray);
            // The grid is fitted to the rays at its corners.
            const bool is_corner = (x == 0 || x == kTileSize - 1) && (y == 0 || y == kTileSize - 1);
            if (hit.prim_id != kNoPrim && !is_corner) {
                const uvec3 t = scene.topology.triangles[hit.prim_id];
                const std::vector<vec3>& p = scene.scene_space.positions;
                ray.dir =
                    aimed_direction(grid, x, y, {dvec3(p[t.x]), dvec3(p[t.y]), dvec3(p[t.z])});
            }
            StoredRay& stored = set.stored[number * kTileRays + y * kTileSize + x];
            std::memcpy(&stored, &ray, sizeof stored);
            stored.tfar = std::numeric_limits<float>::infinity();
        });
    });
    set.active.assign(set.rays.size(), 1);
    set.active_count = set.rays.size();
    for (std::size_t i = 0; i < tiles; ++i)
        set.tiles.push_back({tile, i * kTileRays, (i + 1) * kTileRays});
    return set;
}

RaySet rays_in_any_order(const ChartScene& scene, std::size_t chunk, std::size_t count) {
    const std::vector<vec3>& positions = scene.scene_space.positions;
    RaySet set;
    // They are as incoherent as diffuse rays.
    set.kind = RayKind::kDiffuse;
    Random random(7 + chunk);
    // One ray in this many runs along an axis.
    constexpr std::size_t kAlongAxis = 8;
    for (std::size_t i = 0; i < count; ++i) {
        const uvec3 t = scene.targets[random.below(scene.targets.size())];
        const dvec3 corner(positions[t.x]);
        // A corner, a point of an edge, a point of the triangle.
        const double u = i % 3 == 0 ? 0 : random.real(0, 1);
        const double v = i % 3 < 2 ? 0 : random.real(0, 1 - u);
        const double reach = i % 2 == 0 ? 3 * kSceneExtent : kSceneExtent;
        const vec3 target(corner + u * (dvec3(positions[t.y]) - corner) +
                          v * (dvec3(positions[t.z]) - corner));
        vec3 org(random.point(reach));
        const bool along = i % kAlongAxis == kAlongAxis - 1;
        const auto axis = static_cast<int>(i / kAlongAxis % 3);
        if (along) {
            const float start = org[axis];
            org = target;
            org[axis] = start;
        }
        org = shared_point(scene.space, org);
        vec3 way = target - org;
        if (along) {
            way = vec3(0, 0, 0);
            way[axis] = target[axis] < org[axis] ? -1.0f : 1.0f;
        }
        const vec3 dir = canonical_direction(way);
        if (dir == vec3(0, 0, 0)) continue;
        set.rays.push_back({org, 0, dir, kInfiniteT});
        if (set.rays.size() % (kTileSize * kTileSize) == 0) set.close_tile({});
    }
    set.close_tile({});
    return set;
}

Albedo plain(std::uint32_t, std::uint32_t) { return kDefaultAlbedo; }

ChartInput sphere(std::string name, double radius, const dvec3& centre) {
    const Sphere shape(1500);
    ChartInput made{std::move(name), {}, {}};
    shape.append_to(made.topology, plain);
    for (std::uint32_t i = 0; i < shape.vertex_count(); ++i)
        made.positions.push_back(round_to_float(centre + radius * shape.direction(i)));
    return made;
}

ChartInput needles() {
    ChartInput made{"needles", {}, {}};
    Random random(1);
    for (std::uint32_t i = 0; i < 400; ++i) {
        const dvec3 base = random.point(1);
        // The tips point to the default camera.
        const dvec3 tip = base + random.real(0.3, 0.6) * (dvec3(2, 2, 5) - base);
        for (const dvec3& p : {base, base + dvec3(1e-4, 1e-4, 0), tip})
            made.positions.push_back(round_to_float(p));
        append_triangle(made.topology, 3 * i, 3 * i + 1, 3 * i + 2, kDefaultAlbedo);
    }
    made.topology.vertex_count = 3 * 400;
    return made;
}

/// Thin triangles around one vertex that all rays at it must hit.
ChartInput fan() {
    constexpr std::uint32_t kBlades = 2000;
    ChartInput made{"fan", {}, {{0.1f, 0.2f, 0.3f}}};
    for (std::uint32_t i = 0; i < kBlades; ++i) {
        const double angle = 2 * std::numbers::pi * i / kBlades;
        made.positions.push_back(
            round_to_float({std::cos(angle), std::sin(angle), 0.2 * std::sin(5 * angle)}));
        append_triangle(made.topology, 0, 1 + i, 1 + (i + 1) % kBlades, kDefaultAlbedo);
    }
    made.topology.vertex_count = 1 + kBlades;
    return made;
}

/// A wavy sheet four times in the same place, every second one turned around.
ChartInput sheets(std::string name, double apart) {
    const Sheet sheet(1152);
    const auto [rows, columns] = sheet.grid();
    ChartInput made{std::move(name), {}, {}};
    std::vector<uvec3>& triangles = made.topology.triangles;
    for (int copy = 0; copy < 4; ++copy) {
        sheet.append_to(made.topology, plain);
        if (copy % 2 == 1)
            for (uvec3& t : std::span(triangles).last(sheet.triangle_count())) std::swap(t.y, t.z);
        for (std::uint32_t i = 0; i < sheet.vertex_count(); ++i) {
            const double x = 2.0 * (i / (columns + 1)) / rows - 1;
            const double y = 2.0 * (i % (columns + 1)) / columns - 1;
            made.positions.push_back(
                round_to_float({x, y, 0.2 * std::sin(3 * x + 2 * y) + apart * copy}));
        }
    }
    return made;
}

void append_square(ChartInput& made, std::initializer_list<vec3> corners) {
    std::uint32_t& count = made.topology.vertex_count;
    append_triangle(made.topology, count, count + 1, count + 2, kDefaultAlbedo);
    append_triangle(made.topology, count, count + 2, count + 3, kDefaultAlbedo);
    made.positions.insert(made.positions.end(), corners);
    count += 4;
}

/// The square [x0, x1] x [-size, size] at a height that grows with x by `slope`.
struct Ground {
    float x0, x1, size, height, slope = 0;
};

ChartInput with_grounds(ChartInput made, std::initializer_list<Ground> grounds) {
    for (const auto& [x0, x1, size, height, slope] : grounds) {
        const float first = height + slope * x0, last = height + slope * x1;
        append_square(made,
                      {{x0, first, -size}, {x1, last, -size}, {x1, last, size}, {x0, first, size}});
    }
    return made;
}

/// A pebble and a needle on a ground with a crack.
ChartInput cracked_ground() {
    ChartInput made = with_grounds(sphere("ground of 100 km", 0.05, {0.5, 0.05, 0}),
                                   {{-1e5f, -0.01f, 1e5f, 0}, {0.01f, 1e5f, 1e5f, 0}});
    append_square(made, {{-0.5f, 0, 0}, {-0.499f, 0, 0}, {-0.499f, 2, 0}, {-0.5f, 2, 0}});
    return made;
}

}  // namespace

WorldBounds chart_bounds(const Topology& topology, std::span<const vec3> positions) {
    const PoseExtent pose(positions, used_vertices(topology));
    return pose.bounds(pose.limit());
}

ChartScene make_chart_scene(const Topology& topology, std::span<const vec3> positions,
                            const WorldBounds& bounds) {
    ChartScene scene;
    scene.topology = topology;
    scene.world_space.positions.assign(positions.begin(), positions.end());
    scene.bounds = bounds;
    scene.space = space_of_pose(bounds, PoseExtent(positions, used_vertices(topology)));
    scene.scene_space.positions.resize(positions.size());
    scene.space.to_scene(positions, scene.scene_space.positions);
    for (const uvec3& t : topology.triangles) {
        const auto keeps = [&](std::uint32_t vertex) {
            return scene.space.keeps(positions[vertex]);
        };
        if (keeps(t.x) && keeps(t.y) && keeps(t.z)) scene.targets.push_back(t);
    }
    scene.bvh = build_bvh(scene.topology, scene.scene_space.positions);
    scene.scene_space.tree = build_peer_tree(scene.topology, scene.scene_space.positions);
    scene.world_space.tree = scene.scene_space.tree;
    refit(scene.world_space.tree, scene.topology, scene.world_space.positions);
    return scene;
}

ChartScene make_chart_scene(const ChartInput& input) {
    return make_chart_scene(input.topology, input.positions,
                            chart_bounds(input.topology, input.positions));
}

RaySet make_chart_rays(const ChartScene& scene, RayKind kind, std::size_t chunk,
                       std::size_t count) {
    const std::size_t tiles = std::max<std::size_t>(1, count / (kTileSize * kTileSize));
    if (scene.targets.empty()) return {};
    if (kind == RayKind::kDiffuse) return rays_in_any_order(scene, chunk, count);
    if (kind == RayKind::kAimed) return aimed_tiles(scene, chunk, tiles);
    const auto side = static_cast<std::uint32_t>(std::lround(std::sqrt(tiles))) * kTileSize;
    RaySet camera = camera_rays(scene, chunk, side);
    if (kind == RayKind::kPrimary) return camera;
    const Tracer tracer = our_tracers(scene.bvh, best_simd_target(), camera).front();
    return make_secondary_rays(camera, trace_all(tracer, camera).hits,
                               {&scene.topology, scene.scene_space.positions}, kind);
}

RaySet to_world(RaySet rays, const SceneSpace& space) {
    for (Ray& ray : rays.rays) {
        ray.org = space.to_world(ray.org);
        if (ray.tfar < kInfiniteT)
            ray.tfar = std::min(static_cast<float>(space.length_to_world(ray.tfar)), kInfiniteT);
    }
    // Only the program's own packets take these.
    rays.stored.clear();
    for (std::size_t i = 0; i < rays.rays.size() && !rays.shadows.empty(); ++i)
        rays.shadows[i / kPacketSize].set(i % kPacketSize, rays.rays[i]);
    rays.params.camera.org = space.to_world(rays.params.camera.org);
    rays.params.light = space.to_world(rays.params.light);
    return rays;
}

std::vector<ChartInput> failure_scenes() {
    return {
        sphere("sphere", 1, {0, 0, 0}),
        sphere("offset 1e3", 1, {1e3, 1e3, 1e3}),
        sphere("offset 1e5", 1, {1e5, 1e5, 1e5}),
        sphere("scale 1e-20", 1e-20, {0, 0, 0}),
        sphere("scale 1e30", 1e30, {0, 0, 0}),
        needles(),
        fan(),
        sheets("duplicates", 0),
        sheets("nearly coplanar", 1e-6),
        with_grounds(sphere("detail 1 in 1e6", 1, {1000, 1, 1000}), {{-5e5f, 5e5f, 5e5f, 0}}),
        cracked_ground(),
        with_grounds(
            {"planes 1e-6 apart", {}, {}},
            {{-1, 1, 1, 0}, {-1, 1, 1, 10 * 1e-7f, 1e-7f}, {-1, 1, 1, 10 * -1e-7f, -1e-7f}}),
        with_grounds({"decal at 3 ulp", {}, {}}, {{-10, 10, 10, 1}, {-1, 1, 1, 1 + 3 * 0x1p-23f}})};
}

}  // namespace mray::lab
