// inside_check [POINTS [SEED]]: compares winding numbers, inside and the signs of distances with
// CGAL's Side_of_triangle_mesh on a kernel of exact predicates and constructions, for points on and
// next to meshes, on their planes and lines. Exit code 1 if an answer is wrong.
#include <CGAL/Exact_predicates_exact_constructions_kernel.h>
#include <CGAL/Side_of_triangle_mesh.h>
#include <CGAL/Surface_mesh.h>

#include <cstdio>
#include <cstdlib>
#include <list>
#include <vector>

#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

#include "morphray/morphray.hpp"
#include "tests/support/mixed_points.h"
#include "tests/support/test_scene.h"

namespace mray::test {
namespace {

using Kernel = CGAL::Exact_predicates_exact_constructions_kernel;
using Mesh = CGAL::Surface_mesh<Kernel::Point_3>;
using Side = CGAL::Side_of_triangle_mesh<Mesh, Kernel>;

/// A mesh that bounds a volume, scaled and moved.
struct Part {
    TestScene scene;
    vec3 scale = {1, 1, 1};
    vec3 shift = {0, 0, 0};
    bool is_turned = false;
};

struct Checked {
    Checked(const char* scene_name, const std::vector<Part>& parts) : name(scene_name) {
        for (const Part& part : parts) {
            const auto base = static_cast<std::uint32_t>(positions.size());
            Mesh& mesh = meshes.emplace_back();
            for (const vec3& p : part.scene.world_positions()) {
                positions.push_back(p * part.scale + part.shift);
                mesh.add_vertex({positions.back().x, positions.back().y, positions.back().z});
            }
            double volume = 0;
            for (uvec3 t : part.scene.topology().triangles) {
                if (part.is_turned) std::swap(t.y, t.z);
                mesh.add_face(Mesh::Vertex_index(t.x), Mesh::Vertex_index(t.y),
                              Mesh::Vertex_index(t.z));
                triangles.push_back({t.x + base, t.y + base, t.z + base});
                const auto corner = [&](std::uint32_t i) {
                    return glm::dvec3(positions[i + base] - part.shift);
                };
                volume += glm::dot(corner(t.x), glm::cross(corner(t.y), corner(t.z)));
            }
            if (mesh.number_of_faces() != part.scene.triangle_count()) std::abort();
            sides.emplace_back(mesh);
            signs.push_back(volume > 0 ? 1 : -1);
        }
    }

    const char* name;
    std::vector<vec3> positions;
    std::vector<uvec3> triangles;
    std::list<Mesh> meshes;
    std::list<Side> sides;
    /// How often each part winds around its inside.
    std::vector<int> signs;
    std::size_t points = 0, inside = 0, on_surface = 0, wrong = 0;
};

/// The box of grid_box() with triangles that are all counter-clockwise as seen from outside.
TestScene box_of_cells(std::uint32_t cells) {
    const TestScene box = grid_box(cells);
    std::vector<uvec3> triangles = box.topology().triangles;
    const std::vector<vec3>& p = box.world_positions();
    for (uvec3& t : triangles)
        if (glm::dot(glm::cross(p[t.y] - p[t.x], p[t.z] - p[t.x]), p[t.x]) < 0) std::swap(t.y, t.z);
    return {p, triangles};
}

void add_scenes(std::list<Checked>& scenes) {
    const TestScene ball = icosphere(3);
    const TestScene ring = torus(40, 16);
    const TestScene box = box_of_cells(8);
    const auto add = [&](const char* name, const std::vector<Part>& parts) {
        scenes.emplace_back(name, parts);
    };
    add("sphere", {{icosphere(4)}});
    add("sphere, 1e5 sizes off", {{ball, {.5, .5, .5}, {1e5, 1e5, -1e5}}});
    add("box, 1e5 sizes off", {{box, {.5, .5, .5}, {-1e5, 1e5, 1e5}}});
    add("torus", {{ring}});
    add("torus, 1e4 sizes off", {{ring, {1, .1f, 1}, {3e4, -1e3, 2e4}, true}});
    add("box of squares", {{box_of_cells(12)}});
    add("star", {{star(4, 3)}});
    add("size 1e-20", {{ball, {1e-20, 1e-20, 1e-20}}});
    add("slivers", {{ball, {1e-4, 1, 100}}});
    add("thin slivers", {{ring, {1, 1e-6, 1}, {0, 3, 0}}});
    add("nested",
        {{ball, {5, 5, 5}}, {box, {1, 1, 1}, {}, true}, {ball, {.5, .5, .5}}, {ring, {2, 2, 2}}});
    add("multiply covered", {{ball},
                             {ball},
                             {ball, {1, 1, 1}, {.5, .25, 0}},
                             {box},
                             {box, {1, 1, 1}, {}, true},
                             {box, {.5, .5, .5}, {.5, .5, .5}}});
}

/// Whether all answers about a point are right.
bool is_right(Checked& scene, const Kernel::Point_3& point, std::int32_t winding, bool nonzero,
              bool odd, float distance) {
    int expected = 0;
    int crossings = 0;
    bool is_on_surface = false;
    auto sign = scene.signs.begin();
    for (const Side& side : scene.sides) {
        const CGAL::Bounded_side of_part = side(point);
        is_on_surface |= of_part == CGAL::ON_BOUNDARY;
        if (of_part == CGAL::ON_BOUNDED_SIDE) {
            expected += *sign;
            ++crossings;
        }
        ++sign;
    }
    ++scene.points;
    scene.on_surface += is_on_surface;
    if (is_on_surface) return nonzero && odd && distance == 0;
    scene.inside += expected != 0;
    return winding == expected && nonzero == (expected != 0) && odd == (crossings % 2 == 1) &&
           (nonzero ? distance <= 0 : distance >= 0);
}

void check(Checked& scene, std::size_t count, std::uint64_t seed) {
    const TestScene places(scene.positions, scene.triangles);
    std::vector<std::uint32_t> indices;
    for (const uvec3& t : scene.triangles) indices.insert(indices.end(), {t.x, t.y, t.z});
    const auto asked =
        morphray::Scene::build(morphray::MeshView{morphray::packed(scene.positions), indices});
    std::vector<morphray::Vec3> points;
    for (const vec3& p : mixed_points(scene.triangles, places.positions(), count, seed)) {
        const vec3 world = places.space().to_world(p);
        points.push_back({world.x, world.y, world.z});
    }
    std::vector<std::int32_t> windings(count);
    std::vector<std::uint8_t> nonzero(count), odd(count);
    std::vector<float> distances(count);
    asked.winding(points, windings);
    asked.contains(points, nonzero);
    asked.contains(points, odd, morphray::FillRule::odd);
    asked.signed_distance(points, distances);
    for (std::size_t i = 0; i < count; ++i) {
        const morphray::Vec3 p = points[i];
        if (is_right(scene, {p.x, p.y, p.z}, windings[i], nonzero[i], odd[i], distances[i]))
            continue;
        if (scene.wrong++ < 3)
            std::printf("%s: %a %a %a has winding %d\n", scene.name, p.x, p.y, p.z, windings[i]);
    }
}

}  // namespace
}  // namespace mray::test

int main(int argc, char** argv) {
    const std::size_t most = argc > 1 ? std::strtoull(argv[1], nullptr, 10) : 120000;
    std::uint64_t seed = argc > 2 ? std::strtoull(argv[2], nullptr, 10) : 1;
    std::list<mray::test::Checked> scenes;
    mray::test::add_scenes(scenes);
    const std::size_t each = std::min<std::size_t>(most / scenes.size() + 1, 10000);
    for (std::size_t points = 0, wrong = 0;; ++seed) {
        points = wrong = 0;
        for (auto& scene : scenes) {
            mray::test::check(scene, each, seed);
            std::printf("%-24s %9zu points, %8zu inside, %8zu on the surface, %zu wrong\n",
                        scene.name, scene.points, scene.inside, scene.on_surface, scene.wrong);
            points += scene.points;
            wrong += scene.wrong;
        }
        std::printf("%zu points, %zu wrong\n", points, wrong);
        if (points >= most) return wrong == 0 ? 0 : 1;
    }
}
