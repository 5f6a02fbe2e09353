#include "tests/support/test_scene.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>

namespace mray::test {
namespace {

using Positions = std::vector<vec3>;
using Triangles = std::vector<uvec3>;

vec3 scaled(vec3 v, double s) {
    return vec3(static_cast<float>(v.x * s), static_cast<float>(v.y * s),
                static_cast<float>(v.z * s));
}

vec3 normalized(vec3 v) {
    const double x = v.x;
    const double y = v.y;
    const double z = v.z;
    return scaled(v, 1 / std::sqrt(x * x + y * y + z * z));
}

/// The unit icosphere.
void make_icosphere(int levels, Positions& positions, Triangles& triangles) {
    const float g = 1.61803398875f;
    positions = {{-1, g, 0},  {1, g, 0},  {-1, -g, 0}, {1, -g, 0}, {0, -1, g},  {0, 1, g},
                 {0, -1, -g}, {0, 1, -g}, {g, 0, -1},  {g, 0, 1},  {-g, 0, -1}, {-g, 0, 1}};
    for (vec3& p : positions) p = normalized(p);
    triangles = {{0, 11, 5}, {0, 5, 1},  {0, 1, 7},   {0, 7, 10}, {0, 10, 11},
                 {1, 5, 9},  {5, 11, 4}, {11, 10, 2}, {10, 7, 6}, {7, 1, 8},
                 {3, 9, 4},  {3, 4, 2},  {3, 2, 6},   {3, 6, 8},  {3, 8, 9},
                 {4, 9, 5},  {2, 4, 11}, {6, 2, 10},  {8, 6, 7},  {9, 8, 1}};
    for (int level = 0; level < levels; ++level) {
        std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
        const auto middle = [&](std::uint32_t a, std::uint32_t b) {
            const std::pair<std::uint32_t, std::uint32_t> key = std::minmax(a, b);
            const auto found = middles.find(key);
            if (found != middles.end()) return found->second;
            positions.push_back(normalized(positions[a] + positions[b]));
            return middles[key] = static_cast<std::uint32_t>(positions.size() - 1);
        };
        Triangles finer;
        for (const uvec3& t : triangles) {
            const std::uint32_t ab = middle(t.x, t.y);
            const std::uint32_t bc = middle(t.y, t.z);
            const std::uint32_t ca = middle(t.z, t.x);
            finer.insert(finer.end(), {{t.x, ab, ca}, {t.y, bc, ab}, {t.z, ca, bc}, {ab, bc, ca}});
        }
        triangles = std::move(finer);
    }
}

/// n triangles, each with vertices of its own.
template <class MakeTriangle>
TestScene separate_triangles(std::uint32_t n, MakeTriangle make) {
    Positions positions;
    Triangles triangles;
    for (std::uint32_t i = 0; i < n; ++i) {
        for (const vec3& p : make(i)) positions.push_back(p);
        triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
    }
    return {std::move(positions), std::move(triangles)};
}

using Corners = std::array<vec3, 3>;

TestScene with_broken_vertices() {
    Positions positions;
    Triangles triangles;
    make_icosphere(2, positions, triangles);
    const float nan = std::numeric_limits<float>::quiet_NaN();
    const float inf = std::numeric_limits<float>::infinity();
    positions[3].x = nan;
    positions[20].y = inf;
    positions[40].z = -inf;
    return {std::move(positions), std::move(triangles)};
}

TestScene nested_triangles() {
    return separate_triangles(300, [](std::uint32_t i) {
        const float s = 1.0f + static_cast<float>(i);
        return Corners{vec3(-s, -s, 0), vec3(s, -s, 0), vec3(0, 2 * s, 0)};
    });
}

TestScene coplanar_quads() {
    return separate_triangles(200, [](std::uint32_t i) {
        const float s = 1.0f - 0.004f * static_cast<float>(i / 2);
        const vec3 far = i % 2 == 0 ? vec3(s, -s, 0) : vec3(-s, s, 0);
        return Corners{vec3(-s, -s, 0), far, vec3(s, s, 0)};
    });
}

TestScene slivers() {
    Random random(11);
    return separate_triangles(400, [&](std::uint32_t) {
        const vec3 a = random.point();
        const vec3 b = random.point();
        return Corners{a, b, a + scaled(b - a, 0.5) + random.point(1e-6)};
    });
}

TestScene mixed_scales() {
    Positions positions;
    Triangles triangles;
    make_icosphere(2, positions, triangles);
    const std::size_t inner = positions.size();
    const std::size_t inner_triangles = triangles.size();
    for (std::size_t i = 0; i < inner; ++i) positions.push_back(scaled(positions[i], 1e5));
    for (std::size_t i = 0; i < inner; ++i) positions[i] = scaled(positions[i], 1e-5);
    const auto offset = static_cast<std::uint32_t>(inner);
    for (std::size_t i = 0; i < inner_triangles; ++i) {
        const uvec3 t = triangles[i];
        triangles.push_back({t.x + offset, t.y + offset, t.z + offset});
    }
    return {std::move(positions), std::move(triangles)};
}

/// Ever smaller triangles towards the origin: splits peel them off one at a time.
TestScene geometric_progression() {
    return separate_triangles(250, [](std::uint32_t i) {
        const double x = std::pow(2.0, -0.5 * i);
        const float f = static_cast<float>(x);
        const float h = static_cast<float>(0.2 * x);
        return Corners{vec3(f, 0, 0), vec3(f, h, 0), vec3(f, 0, h)};
    });
}

// Corners that are equal, or in all coordinates but one, or but for a unit in the last place, or
// but for the sign of a zero.
TestScene equal_corners() {
    Random random(9);
    return separate_triangles(400, [&](std::uint32_t i) {
        const vec3 p = i % 3 == 0 ? vec3(0, random.real(-1, 1), 0) : random.point();
        Corners c{p, p, i % 2 == 0 ? p : p + random.point(0.3)};
        const std::uint32_t axis = random.below(3);
        float& moved = c[1][axis];
        switch (i / 3 % 4) {
            case 0:
                moved = std::nextafter(moved, 2.0f);
                break;
            case 1:
                moved += 0.2f;
                break;
            case 2:
                moved = moved == 0 ? -moved : moved;
                break;
            default:
                break;
        }
        std::rotate(c.begin(), c.begin() + random.below(3), c.end());
        return c;
    });
}

/// The two halves of a folded quad, whose boxes are equal, again and again over its four vertices,
/// turned and mirrored.
TestScene repeated_halves() {
    const uvec3 halves[] = {{0, 1, 2}, {2, 3, 0}, {1, 2, 0}, {0, 2, 1}, {0, 2, 3}};
    Triangles triangles;
    for (std::uint32_t i = 0; i < 400; ++i) triangles.push_back(halves[i / 2 % std::size(halves)]);
    return {{{-1, -1, 0}, {1, -1, 0.25f}, {1, 1, 0}, {-1, 1, 0.25f}}, std::move(triangles)};
}

}  // namespace

TestScene::TestScene(std::vector<vec3> positions, std::vector<uvec3> triangles)
    : world_(std::move(positions)), space_(bounds_of(world_)), scene_(world_.size()) {
    topology_.triangles = std::move(triangles);
    topology_.albedo.assign(topology_.triangles.size(), kDefaultAlbedo);
    topology_.vertex_count = static_cast<std::uint32_t>(world_.size());
    space_.to_scene(world_, scene_);
}

TestScene icosphere(int levels, double radius, const vec3& centre) {
    Positions positions;
    Triangles triangles;
    make_icosphere(levels, positions, triangles);
    for (vec3& p : positions) p = centre + scaled(p, radius);
    return {std::move(positions), std::move(triangles)};
}

TestScene star(int levels, std::uint64_t seed) {
    Positions positions;
    Triangles triangles;
    make_icosphere(levels, positions, triangles);
    Random random(seed);
    for (vec3& p : positions) p = scaled(p, random.real(1, 6));
    return {std::move(positions), std::move(triangles)};
}

TestScene torus(std::uint32_t rings, std::uint32_t sides) {
    Positions positions;
    Triangles triangles;
    const double turn = 2 * std::numbers::pi;
    for (std::uint32_t i = 0; i < rings; ++i) {
        for (std::uint32_t j = 0; j < sides; ++j) {
            const double a = turn * i / rings;
            const double b = turn * j / sides;
            const double r = 1 + 0.4 * std::cos(b);
            positions.push_back(vec3(r * std::cos(a), 0.4 * std::sin(b), r * std::sin(a)));
            const auto at = [&](std::uint32_t k, std::uint32_t l) {
                return (k % rings) * sides + l % sides;
            };
            triangles.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
            triangles.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
        }
    }
    return {std::move(positions), std::move(triangles)};
}

TestScene grid_box(std::uint32_t cells) {
    Positions positions;
    Triangles triangles;
    std::map<std::array<std::uint32_t, 3>, std::uint32_t> ids;
    const auto vertex = [&](int axis, std::uint32_t side, std::uint32_t u, std::uint32_t v) {
        std::array<std::uint32_t, 3> key{};
        key[static_cast<std::size_t>(axis)] = side;
        key[static_cast<std::size_t>((axis + 1) % 3)] = u;
        key[static_cast<std::size_t>((axis + 2) % 3)] = v;
        const auto [place, added] =
            ids.try_emplace(key, static_cast<std::uint32_t>(positions.size()));
        const auto coordinate = [&](std::uint32_t k) {
            return 2 * static_cast<float>(k) / static_cast<float>(cells) - 1;
        };
        if (added)
            positions.push_back({coordinate(key[0]), coordinate(key[1]), coordinate(key[2])});
        return place->second;
    };
    for (int axis = 0; axis < 3; ++axis) {
        for (const std::uint32_t side : {0u, cells}) {
            for (std::uint32_t u = 0; u < cells; ++u) {
                for (std::uint32_t v = 0; v < cells; ++v) {
                    const std::uint32_t a = vertex(axis, side, u, v);
                    const std::uint32_t b = vertex(axis, side, u + 1, v);
                    const std::uint32_t c = vertex(axis, side, u + 1, v + 1);
                    const std::uint32_t d = vertex(axis, side, u, v + 1);
                    triangles.push_back({a, b, c});
                    triangles.push_back({a, c, d});
                }
            }
        }
    }
    return {std::move(positions), std::move(triangles)};
}

TestScene random_soup(std::uint32_t triangles, double size, std::uint64_t seed) {
    Random random(seed);
    return separate_triangles(triangles, [&](std::uint32_t) {
        const vec3 centre = random.point();
        return Corners{centre + random.point(size), centre + random.point(size),
                       centre + random.point(size)};
    });
}

TestScene needles_towards(const vec3& eye, std::uint32_t triangles, std::uint64_t seed) {
    Random random(seed);
    return separate_triangles(triangles, [&](std::uint32_t) {
        const vec3 base = random.point();
        const vec3 tip = base + scaled(eye - base, random.real(0.3, 0.6));
        return Corners{base, base + random.point(1e-4), tip};
    });
}

std::vector<NamedScene> adversarial_scenes() {
    std::vector<NamedScene> scenes;
    scenes.push_back({"needles", needles_towards({0, 0, 5}, 300, 1)});
    scenes.push_back({"slivers", slivers()});
    scenes.push_back({"soup", random_soup(500, 0.2, 2)});
    scenes.push_back({"large soup", random_soup(200, 2, 3)});
    scenes.push_back({"duplicates", separate_triangles(300, [](std::uint32_t i) {
                          const Corners c{vec3(-1, -1, 0), vec3(1, -1, 0), vec3(0, 1, 0)};
                          return i % 2 == 0 ? c : Corners{c[0], c[2], c[1]};
                      })});
    scenes.push_back({"repeated", repeated_halves()});
    scenes.push_back({"coplanar", coplanar_quads()});
    scenes.push_back({"nested", nested_triangles()});
    scenes.push_back(
        {"one point", separate_triangles(100, [](std::uint32_t) {
             return Corners{vec3(.25, .5, -.75), vec3(.25, .5, -.75), vec3(.25, .5, -.75)};
         })});
    scenes.push_back({"equal corners", equal_corners()});
    Random random(4);
    scenes.push_back({"collinear", separate_triangles(100, [&](std::uint32_t) {
                          const vec3 a = random.point();
                          return Corners{a, a + vec3(0.25, 0, 0), a + vec3(0.5, 0, 0)};
                      })});
    scenes.push_back({"not finite", with_broken_vertices()});
    for (std::uint32_t n = 0; n <= 5; ++n) {
        scenes.push_back(
            {std::to_string(n) + " triangles", separate_triangles(n, [](std::uint32_t i) {
                 const float z = static_cast<float>(i);
                 return Corners{vec3(0, 0, z), vec3(1, 0, z), vec3(0, 1, z)};
             })});
    }
    scenes.push_back({"offset 1e5", icosphere(2, 2, {148376, 1234, -223423})});
    scenes.push_back({"offset 1e7", icosphere(2, 100, {1e7, 1e7, 1e7})});
    scenes.push_back({"collapsed by offset", icosphere(2, 1, {1e7, 1e7, 1e7})});
    for (const double scale : {1e-39, 1e-30, 1e-12, 1e12, 1e30}) {
        scenes.push_back({"scale", icosphere(2, scale)});
    }
    scenes.push_back({"mixed scales", mixed_scales()});
    scenes.push_back({"progression", geometric_progression()});
    scenes.push_back({"star", star(3, 5)});
    scenes.push_back({"torus", torus(24, 12)});
    scenes.push_back({"grid box", grid_box(8)});
    return scenes;
}

Ray scene_ray(const TestScene& scene, vec3 org, vec3 dir, double tnear, double tfar) {
    const WorldRay world{{org.x, org.y, org.z}, {dir.x, dir.y, dir.z}, tnear, tfar};
    return to_scene(scene.space(), world).ray;
}

std::vector<Ray> mixed_rays(const TestScene& scene, std::size_t count, std::uint64_t seed) {
    Random random(seed);
    const double e = kSceneExtent;
    const auto vertex = [&]() -> vec3 {
        if (scene.positions().empty()) return random.point(e);
        const vec3 p =
            scene.positions()[random.below(static_cast<std::uint32_t>(scene.positions().size()))];
        return p.x <= kSceneExtent ? p : vec3(0, 0, 0);
    };
    std::vector<Ray> rays;
    while (rays.size() < count) {
        vec3 org = random.point(rays.size() % 2 == 0 ? e : 3 * e);
        vec3 target = random.point(e);
        switch (random.below(6)) {
            case 0:
                target = vertex();
                break;
            case 1:
                target = scaled(vertex() + vertex(), 0.5);
                break;
            case 2:
                org = vertex();
                break;
            case 3:
                org = vertex();
                target = vertex();
                break;
            case 4: {
                const vec3 axes[] = {{1, -0.0f, 0}, {-0.0f, -1, 0}, {0, -0.0f, 1}};
                org = vertex() - scaled(axes[rays.size() % 3], 2 * e);
                target = org + scaled(axes[rays.size() % 3], e);
                break;
            }
            default:
                break;
        }
        Ray ray;
        ray.org = snap_point(org);
        ray.dir = canonical_direction(snap_point(target) - ray.org);
        ray.tnear = 0;
        ray.tfar = random.below(8) == 0 ? static_cast<float>(random.real(0.1, 3) * e) : kInfiniteT;
        rays.push_back(ray);
    }
    return rays;
}

}  // namespace mray::test
