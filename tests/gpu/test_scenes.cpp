#include "tests/gpu/test_scenes.h"

#include <cmath>
#include <numbers>
#include <random>

#include "common/interop/arithmetic.h"
#include "cpu/refit/refit.h"

namespace mray::test {
namespace {

constexpr float kUnit = 65536.0f;

class Random {
public:
    explicit Random(std::uint32_t seed) : engine_(seed) {}
    float in(float low, float high) { return low + (high - low) * unit(engine_); }
    vec3 point(float size) { return {in(-size, size), in(-size, size), in(-size, size)}; }

private:
    std::mt19937 engine_;
    std::uniform_real_distribution<float> unit{0.0f, 1.0f};
};

void finish(DeviceScene& scene) {
    scene.topology.vertex_count = static_cast<std::uint32_t>(scene.positions.size());
    for (std::uint32_t i = 0; i < scene.topology.triangles.size(); ++i) {
        scene.topology.albedo.push_back(0x00404040 + (i * 2654435761u & 0x007F7F7F));
    }
    for (vec3& p : scene.positions) p = snap_point(p);
}

void add_triangle(DeviceScene& scene, vec3 a, vec3 b, vec3 c) {
    const auto base = static_cast<std::uint32_t>(scene.positions.size());
    scene.positions.insert(scene.positions.end(), {a, b, c});
    scene.topology.triangles.push_back({base, base + 1, base + 2});
}

}  // namespace

DeviceScene torus(std::uint32_t rings, std::uint32_t sides) {
    DeviceScene scene{.name = "torus", .topology = {}, .positions = {}};
    for (std::uint32_t r = 0; r < rings; ++r) {
        const double u = 2 * std::numbers::pi * r / rings;
        for (std::uint32_t s = 0; s < sides; ++s) {
            const double v = 2 * std::numbers::pi * s / sides;
            const double radius = 2 + std::cos(v);
            scene.positions.push_back(vec3(static_cast<float>(radius * std::cos(u)),
                                           static_cast<float>(std::sin(v)),
                                           static_cast<float>(radius * std::sin(u))) *
                                      kUnit);
        }
    }
    const auto index = [&](std::uint32_t r, std::uint32_t s) {
        return r % rings * sides + s % sides;
    };
    for (std::uint32_t r = 0; r < rings; ++r) {
        for (std::uint32_t s = 0; s < sides; ++s) {
            scene.topology.triangles.push_back({index(r, s), index(r + 1, s), index(r, s + 1)});
            scene.topology.triangles.push_back(
                {index(r + 1, s), index(r + 1, s + 1), index(r, s + 1)});
        }
    }
    finish(scene);
    return scene;
}

DeviceScene debris(std::uint32_t count, std::uint32_t seed) {
    DeviceScene scene{.name = "debris", .topology = {}, .positions = {}};
    Random random(seed);
    for (std::uint32_t i = 0; i < count; ++i) {
        const vec3 a = random.point(3) * kUnit;
        const float size = std::exp2(random.in(-20, 1)) * kUnit;
        vec3 b = a + random.point(1) * size;
        vec3 c = a + random.point(1) * size;
        switch (i % 8) {
            case 0:
                c = a;
                break;  // no area
            case 1:
                c = b + random.point(1) * (size / 1048576);
                break;  // needle
            case 2:
                b = vec3(0, 0, 8) * kUnit + random.point(1);
                break;  // towards the eye
            case 3:
                b.y = c.y = a.y;
                break;  // in an axis plane
            case 4:
                if (i % 32 == 4) b = vec3(kInvalidCoordinate);
                break;
            default:
                break;
        }
        add_triangle(scene, a, b, c);
    }
    finish(scene);
    return scene;
}

DeviceScene coincident(std::uint32_t count) {
    DeviceScene scene{.name = "coincident", .topology = {}, .positions = {}};
    scene.positions = {vec3(-3, -2, 0) * kUnit, vec3(3, -2, 0) * kUnit, vec3(0, 3, 0) * kUnit};
    scene.topology.triangles.assign(count, {0, 1, 2});
    finish(scene);
    return scene;
}

DeviceScene layers(std::uint32_t pairs, std::uint32_t seed) {
    DeviceScene scene{.name = "layers", .topology = {}, .positions = {}};
    Random random(seed);
    for (std::uint32_t i = 0; i < pairs; ++i) {
        const vec3 a = random.point(3) * kUnit;
        const float size = std::exp2(random.in(-6, 1)) * kUnit;
        const float steepness = std::exp2(random.in(-2, 8));
        const vec3 b = a + random.point(1) * vec3(size, size, steepness * size);
        const vec3 c = a + random.point(1) * vec3(size, size, steepness * size);
        const vec3 apart = random.point(1) * std::exp2(random.in(-24, -6)) * kUnit;
        add_triangle(scene, a, b, c);
        add_triangle(scene, b + apart, c + apart, a + apart);
    }
    finish(scene);
    return scene;
}

DeviceScene strips(std::uint32_t rows, std::uint32_t columns, std::uint32_t seed) {
    DeviceScene scene{.name = "strips", .topology = {}, .positions = {}};
    Random random(seed);
    add_triangle(scene, vec3(-9, -1, -9) * kUnit, vec3(9, -1, -9) * kUnit, vec3(0, -1, 9) * kUnit);
    const float width = 2.0f / static_cast<float>(rows);
    const float length = 6.0f / static_cast<float>(columns);
    for (std::uint32_t row = 0; row < rows; row += 2) {
        for (std::uint32_t column = 0; column < columns; ++column) {
            const auto corner = [&](float across, float along) {
                const float y = static_cast<float>(row) + across + random.in(-0.4f, 0.4f);
                const float z = static_cast<float>(column) + along;
                const vec3 p(random.in(0, width), width * y - 1, length * z - 3);
                scene.positions.push_back(p * kUnit);
            };
            corner(0, 0);
            corner(0, 0.9f);
            corner(1, 0);
            corner(1, 0.9f);
            const auto end = static_cast<std::uint32_t>(scene.positions.size());
            scene.topology.triangles.push_back({end - 4, end - 3, end - 2});
            scene.topology.triangles.push_back({end - 3, end - 2, end - 1});
        }
    }
    finish(scene);
    return scene;
}

DeviceScene beams(std::uint32_t count, std::uint32_t seed) {
    DeviceScene scene{.name = "beams", .topology = {}, .positions = {}};
    Random random(seed);
    add_triangle(scene, vec3(-9, -3, -9) * kUnit, vec3(9, -3, -9) * kUnit, vec3(0, -3, 9) * kUnit);
    const ImageParams params = view(1, 1, kRaysShadow);
    for (std::uint32_t i = 0; i < count; ++i) {
        const vec3 origin = i % 2 == 0 ? params.light : params.camera.org;
        const float gap = std::ldexp(kUnit, -static_cast<int>(i % 15));
        const vec3 near = origin + random.point(1) * gap;
        const vec3 along = random.point(3) * kUnit - near;
        const vec3 begin = near - along * random.in(0, 0.25f);
        const vec3 end = near + along * random.in(0.1f, 0.9f);
        add_triangle(scene, begin, end, end + random.point(0.3f) * gap);
    }
    finish(scene);
    return scene;
}

std::vector<DeviceScene> test_scenes() {
    std::vector<DeviceScene> scenes;
    scenes.push_back(torus(48, 24));
    scenes.push_back(debris(3000, 1));
    scenes.push_back(coincident(500));
    DeviceScene nothing{.name = "nothing", .topology = {}, .positions = {}};
    scenes.push_back(nothing);
    DeviceScene single{.name = "single", .topology = {}, .positions = {}};
    add_triangle(single, vec3(-3, -2, 0) * kUnit, vec3(3, -2, 1) * kUnit, vec3(0, 3, 0) * kUnit);
    finish(single);
    scenes.push_back(single);
    return scenes;
}

std::vector<vec3> swayed(const DeviceScene& scene, float time, float amount) {
    std::vector<vec3> positions = scene.positions;
    for (vec3& p : positions) {
        if (p.x > kSceneExtent) continue;
        const vec3 q = p / kUnit;
        p = snap_point(p +
                       vec3(std::sin(q.y + time), std::sin(q.z + 2 * time), std::cos(q.x - time)) *
                           (amount * kUnit));
    }
    return positions;
}

Bvh plain_tree(const DeviceScene& scene) {
    constexpr std::uint32_t kTrianglesPerLeaf = 5;
    const auto& triangles = scene.topology.triangles;
    Bvh bvh;
    bvh.triangle_count = static_cast<std::uint32_t>(triangles.size());
    for (std::uint32_t first = 0; first < triangles.size(); first += kTrianglesPerLeaf) {
        const std::uint32_t count = std::min<std::uint32_t>(
            kTrianglesPerLeaf, static_cast<std::uint32_t>(triangles.size()) - first);
        Leaf& leaf = bvh.leaves.emplace_back(Leaf{});
        for (std::uint32_t i = 0; i < kLeafTriangles; ++i) {
            const std::uint32_t t = std::min(i, count - 1);
            leaf.prim_id[i] = i < count ? first + i : kNoPrim;
            leaf.vertex[i].corners = pack_corners(3 * t, 3 * t + 1, 3 * t + 2, count);
        }
        for (std::uint32_t slot = 0; slot < kLeafVertices; ++slot) {
            const std::uint32_t used = slot < 3 * count ? slot : 0;
            bvh.leaf_vertices.push_back(triangles[first + used / 3][static_cast<int>(used % 3)]);
        }
    }
    // Sizes of the levels, root first.
    std::vector<std::uint32_t> sizes;
    auto below = static_cast<std::uint32_t>(bvh.leaves.size());
    do {
        below = std::max((below + kWidth - 1) / kWidth, 1u);
        sizes.insert(sizes.begin(), below);
    } while (below > 1);
    bvh.level_begin = {0};
    for (const std::uint32_t s : sizes) bvh.level_begin.push_back(bvh.level_begin.back() + s);
    bvh.nodes.resize(bvh.level_begin.back(), Node{});
    bvh.node_parents.assign(bvh.nodes.size(), kNoParent);
    bvh.leaf_parents.resize(bvh.leaves.size());
    for (std::size_t level = 0; level < sizes.size(); ++level) {
        const bool is_last = level + 1 == sizes.size();
        const std::uint32_t first_child = is_last ? 0 : bvh.level_begin[level + 1];
        const std::uint32_t child_count =
            is_last ? static_cast<std::uint32_t>(bvh.leaves.size()) : sizes[level + 1];
        for (std::uint32_t n = 0; n < sizes[level]; ++n) {
            const std::uint32_t node = bvh.level_begin[level] + n;
            for (std::uint32_t slot = 0; slot < kWidth; ++slot) {
                const std::uint32_t child = n * kWidth + slot;
                set_slot_box(bvh.nodes[node], slot, Box());
                bvh.nodes[node].child[slot] = kEmptyChild;
                if (child >= child_count) continue;
                bvh.nodes[node].child[slot] = is_last ? kLeafBit | child : first_child + child;
                (is_last ? bvh.leaf_parents[child] : bvh.node_parents[first_child + child]) =
                    node * kWidth + slot;
            }
        }
    }
    const cpu::RefitArrays tree(bvh);
    for (std::uint32_t i = 0; i < bvh.leaves.size(); ++i) cpu::refit_leaf(tree, i, scene.positions);
    for (auto i = static_cast<std::uint32_t>(bvh.nodes.size()); i-- > 0;) cpu::refit_node(tree, i);
    return bvh;
}

ImageParams view(std::uint32_t width, std::uint32_t height, std::uint32_t rays,
                 std::uint32_t ao_count) {
    ImageParams params = {};
    const float w = static_cast<float>(width);
    const float h = static_cast<float>(height);
    params.camera.org = vec3(0, 3, 8) * kUnit;
    params.camera.corner = vec3(-0.5f * w / h, 0.2f, -1);
    params.camera.du = vec3(1 / h, 0, 0);
    params.camera.dv = vec3(0, -1 / h, 0);
    params.light = vec3(-6, 8, 5) * kUnit;
    params.ao_tfar = 1.5f * kUnit;
    params.width = width;
    params.height = height;
    params.rays = rays;
    params.ao_count = ao_count;
    return params;
}

std::vector<Ray> scattered_rays(std::size_t count, std::uint32_t seed) {
    Random random(seed);
    std::vector<Ray> rays;
    for (std::size_t i = 0; i < count; ++i) {
        Ray ray = {};
        ray.org = snap_point(random.point(6) * kUnit);
        vec3 target = random.point(3) * kUnit;
        if (i % 11 == 0) target.y = ray.org.y;
        if (i % 13 == 0) target = ray.org + vec3(0, 0, -1);
        if (i % 101 == 0) target = ray.org;
        ray.dir = canonical_direction(target - ray.org);
        ray.tnear = i % 7 == 0 ? random.in(0, 3) * kUnit : 0;
        ray.tfar = i % 5 == 0 ? random.in(0, 9) * kUnit : kInfiniteT;
        rays.push_back(ray);
    }
    return rays;
}

}  // namespace mray::test
