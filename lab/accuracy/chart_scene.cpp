#include "lab/accuracy/chart_scene.h"

#include <array>
#include <cmath>
#include <numbers>
#include <random>

#include "common/bvh/box.h"
#include "common/bvh/builder/bvh_builder.h"
#include "common/scene/camera_setup.h"
#include "common/scene/scene_space.h"

namespace mray::lab {
namespace {

/// Numbers of a fixed sequence.
class Random {
public:
    explicit Random(std::uint64_t seed) : bits_(seed) {}

    std::size_t below(std::size_t count) { return bits_() % count; }
    double real(double lower, double upper) {
        return lower + (upper - lower) * static_cast<double>(bits_() >> 11) * 0x1p-53;
    }

private:
    std::mt19937_64 bits_;
};

/// The same tree over the positions in world space, with boxes of these floats.
Bvh tree_around(Bvh bvh, std::span<const vec3> positions) {
    std::vector<Box> leaf_boxes(bvh.leaves.size());
    for (std::size_t i = 0; i < bvh.leaves.size(); ++i) {
        for (std::uint32_t slot = 0; slot < kLeafVertices; ++slot) {
            const vec3 p = positions[bvh.leaf_vertices[i * kLeafVertices + slot]];
            LeafVertex& v = bvh.leaves[i].vertex[slot];
            v.x = p.x;
            v.y = p.y;
            v.z = p.z;
            if (std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z))
                leaf_boxes[i].extend(p);
        }
    }
    // Parents come before their children.
    std::vector<Box> node_boxes(bvh.nodes.size());
    for (std::size_t i = bvh.nodes.size(); i-- > 0;) {
        Node& node = bvh.nodes[i];
        for (std::uint32_t slot = 0; slot < kWidth && node.child[slot] != kEmptyChild; ++slot) {
            const std::uint32_t child = node.child[slot];
            const Box& box =
                (child & kLeafBit) != 0 ? leaf_boxes[child & ~kLeafBit] : node_boxes[child];
            set_slot_box(node, slot, box);
            node_boxes[i].extend(box);
        }
    }
    return bvh;
}

/// Camera rays from the same eye in both spaces.
void add_camera_rays(ChartScene& scene, ViewSpec view, const WorldBounds& bounds,
                     const SceneSpace& space) {
    const vec3 eye = space.to_world(make_image_params(view, bounds, space).camera.org);
    view.eye = Point{eye.x, eye.y, eye.z};
    ImageParams params = make_image_params(view, bounds, space);
    scene.scene_space.camera = make_primary_rays(params);
    params.camera.org = space.to_world(params.camera.org);
    scene.world_space.camera = make_primary_rays(params);
}

void add_aimed_rays(ChartScene& scene, const SceneSpace& space, std::size_t count) {
    const std::vector<vec3>& positions = scene.scene_space.positions;
    RaySet& ours = scene.scene_space.aimed;
    RaySet& theirs = scene.world_space.aimed;
    // They are as incoherent as diffuse rays.
    ours.kind = theirs.kind = RayKind::kDiffuse;
    if (scene.topology.triangles.empty()) return;
    const auto close_tiles = [&] {
        ours.close_tile({});
        theirs.close_tile({});
    };
    Random random(7);
    // One ray in this many runs along an axis.
    constexpr std::size_t kAlongAxis = 8;
    for (std::size_t i = 0; i < count; ++i) {
        const uvec3 t = scene.topology.triangles[random.below(scene.topology.triangles.size())];
        const std::array<vec3, 3> corner{positions[t.x], positions[t.y], positions[t.z]};
        // A corner, a point of an edge, a point of the triangle.
        const double u = i % 3 == 0 ? 0 : random.real(0, 1);
        const double v = i % 3 < 2 ? 0 : random.real(0, 1 - u);
        const double reach = i % 2 == 0 ? 3 * kSceneExtent : kSceneExtent;
        vec3 org;
        vec3 target;
        for (int axis = 0; axis < 3; ++axis) {
            org[axis] = static_cast<float>(random.real(-reach, reach));
            target[axis] = static_cast<float>(corner[0][axis] +
                                              u * (double{corner[1][axis]} - corner[0][axis]) +
                                              v * (double{corner[2][axis]} - corner[0][axis]));
        }
        const bool along = i % kAlongAxis == kAlongAxis - 1;
        const auto axis = static_cast<int>(i / kAlongAxis % 3);
        if (along) {
            const float start = org[axis];
            org = target;
            org[axis] = start;
        }
        // Floats of world space, and the same point in scene space.
        const vec3 world_org = space.to_world(org);
        org = space.point_to_scene(world_org, "a ray's origin");
        vec3 way = target - org;
        if (along) {
            way = vec3(0, 0, 0);
            way[axis] = target[axis] < org[axis] ? -1.0f : 1.0f;
        }
        const vec3 dir = canonical_direction(way);
        if (dir == vec3(0, 0, 0) || !is_finite_vertex(target)) continue;
        ours.rays.push_back({org, 0, dir, kInfiniteT});
        theirs.rays.push_back({world_org, 0, dir, kInfiniteT});
        if (ours.rays.size() % (kTileSize * kTileSize) == 0) close_tiles();
    }
    close_tiles();
}

constexpr double kTurn = 2 * std::numbers::pi;

class Builder {
public:
    std::uint32_t vertex(double x, double y, double z) {
        scene_.positions.emplace_back(static_cast<float>(x), static_cast<float>(y),
                                      static_cast<float>(z));
        return static_cast<std::uint32_t>(scene_.positions.size() - 1);
    }
    void triangle(std::uint32_t a, std::uint32_t b, std::uint32_t c) {
        scene_.topology.triangles.push_back({a, b, c});
    }
    void quad(std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d) {
        triangle(a, b, c);
        triangle(a, c, d);
    }
    ChartInput finish(std::string name) {
        scene_.name = std::move(name);
        scene_.topology.vertex_count = static_cast<std::uint32_t>(scene_.positions.size());
        scene_.topology.albedo.assign(scene_.topology.triangles.size(), kDefaultAlbedo);
        return std::move(scene_);
    }

private:
    ChartInput scene_;
};

/// A sphere of rings and sectors, closed, with two fans at its poles.
Builder sphere(double radius, const std::array<double, 3>& centre) {
    constexpr std::uint32_t kRings = 24;
    constexpr std::uint32_t kSectors = 32;
    Builder build;
    const auto at = [&](double polar, double around) {
        return build.vertex(centre[0] + radius * std::sin(polar) * std::cos(around),
                            centre[1] + radius * std::cos(polar),
                            centre[2] + radius * std::sin(polar) * std::sin(around));
    };
    const std::uint32_t top = at(0, 0);
    for (std::uint32_t i = 1; i < kRings; ++i) {
        for (std::uint32_t j = 0; j < kSectors; ++j)
            at(std::numbers::pi * i / kRings, kTurn * j / kSectors);
    }
    const std::uint32_t bottom = at(std::numbers::pi, 0);
    const auto id = [&](std::uint32_t ring, std::uint32_t sector) {
        return 1 + (ring - 1) * kSectors + sector % kSectors;
    };
    for (std::uint32_t j = 0; j < kSectors; ++j) {
        build.triangle(top, id(1, j), id(1, j + 1));
        for (std::uint32_t i = 1; i + 1 < kRings; ++i)
            build.quad(id(i, j), id(i + 1, j), id(i + 1, j + 1), id(i, j + 1));
        build.triangle(bottom, id(kRings - 1, j + 1), id(kRings - 1, j));
    }
    return build;
}

ChartInput needles() {
    Builder build;
    Random random(1);
    for (int i = 0; i < 400; ++i) {
        std::array<double, 3> base;
        for (double& x : base) x = random.real(-1, 1);
        // The tips point to the default camera.
        const double way = random.real(0.3, 0.6);
        const std::uint32_t a = build.vertex(base[0], base[1], base[2]);
        const std::uint32_t b = build.vertex(base[0] + 1e-4, base[1] + 1e-4, base[2]);
        const std::uint32_t c =
            build.vertex(base[0] + way * (2 - base[0]), base[1] + way * (2 - base[1]),
                         base[2] + way * (5 - base[2]));
        build.triangle(a, b, c);
    }
    return build.finish("needles");
}

/// Thin triangles around one vertex that all rays at it must hit.
ChartInput fan() {
    constexpr std::uint32_t kBlades = 2000;
    Builder build;
    const std::uint32_t middle = build.vertex(0.1, 0.2, 0.3);
    for (std::uint32_t i = 0; i < kBlades; ++i) {
        const double angle = kTurn * i / kBlades;
        build.vertex(std::cos(angle), std::sin(angle), 0.2 * std::sin(5 * angle));
    }
    for (std::uint32_t i = 0; i < kBlades; ++i)
        build.triangle(middle, 1 + i, 1 + (i + 1) % kBlades);
    return build.finish("fan");
}

/// A wavy sheet `copies` times in the same place, every second one turned around.
ChartInput sheets(const std::string& name, std::uint32_t copies, double apart) {
    constexpr std::uint32_t kCells = 24;
    Builder build;
    for (std::uint32_t copy = 0; copy < copies; ++copy) {
        const auto first = copy * (kCells + 1) * (kCells + 1);
        for (std::uint32_t i = 0; i <= kCells; ++i) {
            for (std::uint32_t j = 0; j <= kCells; ++j) {
                const double x = 2.0 * i / kCells - 1;
                const double y = 2.0 * j / kCells - 1;
                build.vertex(x, y, 0.2 * std::sin(3 * x + 2 * y) + apart * copy);
            }
        }
        const auto at = [&](std::uint32_t i, std::uint32_t j) {
            return first + i * (kCells + 1) + j;
        };
        for (std::uint32_t i = 0; i < kCells; ++i) {
            for (std::uint32_t j = 0; j < kCells; ++j) {
                if (copy % 2 == 0) {
                    build.quad(at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
                } else {
                    build.quad(at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j));
                }
            }
        }
    }
    return build.finish(name);
}

ChartInput detail() {
    Builder build = sphere(1, {1000, 1, 1000});
    const std::uint32_t a = build.vertex(-5e5, 0, -5e5);
    const std::uint32_t b = build.vertex(5e5, 0, -5e5);
    const std::uint32_t c = build.vertex(5e5, 0, 5e5);
    const std::uint32_t d = build.vertex(-5e5, 0, 5e5);
    build.quad(a, b, c, d);
    return build.finish("detail 1 in 1e6");
}

}  // namespace

ChartScene make_chart_scene(const ChartInput& input, std::uint32_t side, std::size_t aimed) {
    ChartScene scene;
    scene.topology = input.topology;
    scene.world_space.positions = input.positions;
    const WorldBounds bounds = bounds_of(scene.world_space.positions);
    const SceneSpace space(bounds);
    scene.scene_space.positions.resize(input.positions.size());
    space.to_scene(scene.world_space.positions, scene.scene_space.positions);
    scene.scene_space.bvh = build_bvh(scene.topology, scene.scene_space.positions);
    scene.world_space.bvh = tree_around(scene.scene_space.bvh, scene.world_space.positions);
    ViewSpec view;
    view.width = view.height = side;
    view.fov = kChartFov;
    add_camera_rays(scene, view, bounds, space);
    add_aimed_rays(scene, space, aimed);
    return scene;
}

std::vector<ChartInput> failure_scenes() {
    std::vector<ChartInput> scenes;
    scenes.push_back(sphere(1, {0, 0, 0}).finish("sphere"));
    scenes.push_back(sphere(1, {1e3, 1e3, 1e3}).finish("offset 1e3"));
    scenes.push_back(sphere(1, {1e5, 1e5, 1e5}).finish("offset 1e5"));
    scenes.push_back(sphere(1e-20, {0, 0, 0}).finish("scale 1e-20"));
    scenes.push_back(sphere(1e30, {0, 0, 0}).finish("scale 1e30"));
    scenes.push_back(needles());
    scenes.push_back(fan());
    scenes.push_back(sheets("duplicates", 4, 0));
    scenes.push_back(sheets("nearly coplanar", 4, 1e-6));
    scenes.push_back(detail());
    return scenes;
}

}  // namespace mray::lab
