#include "tests/support/shapes.h"

#include <algorithm>
#include <array>
#include <map>
#include <numbers>
#include <utility>

#include <glm/geometric.hpp>

namespace mray::test {

void Shape::add_triangle(const dvec3& a, const dvec3& b, const dvec3& c) {
    const auto first = static_cast<std::uint32_t>(positions.size());
    positions.insert(positions.end(), {a, b, c});
    triangles.push_back({first, first + 1, first + 2});
}

void Shape::append(const Shape& other) {
    const auto first = static_cast<std::uint32_t>(positions.size());
    positions.insert(positions.end(), other.positions.begin(), other.positions.end());
    for (const uvec3& t : other.triangles) triangles.push_back(t + first);
}

namespace shapes {
namespace {

int any_count(Random& random) {
    if (random.one_in(40)) return static_cast<int>(random.magnitude(200, 2000));
    if (random.one_in(8)) return random.from(40, 200);
    return static_cast<int>(random.magnitude(1, 41));
}

/// Triangles with these corners, as many as asked for.
template <class Corners>
Shape triangles(int count, const Corners& corners) {
    Shape shape;
    for (int i = 0; i < count; ++i) {
        const std::array<dvec3, 3> p = corners();
        shape.add_triangle(p[0], p[1], p[2]);
    }
    return shape;
}

Shape grid_soup(Random& random, int count) {
    return triangles(count, [&] {
        return std::array{random.grid_point(), random.grid_point(), random.grid_point()};
    });
}

Shape any_soup(Random& random, int count) {
    if (random.one_in(2)) return grid_soup(random, count);
    return soup(random, count, random.magnitude(0.01, 2));
}

Shape few_vertices(Random& random, int count) {
    return shared_vertices(random, count, static_cast<std::uint32_t>(random.from(3, 12)));
}

/// Turned, and mirrored one time in `n`.
uvec3 turned(Random& random, const uvec3& t, std::uint32_t n) {
    const int turn = random.from(0, 2);
    uvec3 turned{t[turn], t[(turn + 1) % 3], t[(turn + 2) % 3]};
    if (random.one_in(n)) std::swap(turned.x, turned.y);
    return turned;
}

/// A square of cells, sometimes several times, so that every ray at a line of the grid meets ties.
Shape tie_grid(Random& random, int) {
    Shape shape;
    const int cells = random.from(1, 4);
    const int sheets = random.from(1, 3);
    const int fixed = random.from(0, 2);
    const bool shifted = random.one_in(3);
    const auto corner = [&](int sheet, int i, int j) {
        dvec3 p = {0, 0, 0};
        p[fixed] = shifted ? 0.125 * sheet : 0;
        p[(fixed + 1) % 3] = 2.0 * i / cells - 1;
        p[(fixed + 2) % 3] = 2.0 * j / cells - 1;
        return p;
    };
    for (int sheet = 0; sheet < sheets; ++sheet) {
        for (int i = 0; i < cells; ++i) {
            for (int j = 0; j < cells; ++j) {
                const dvec3 a = corner(sheet, i, j);
                const dvec3 c = corner(sheet, i + 1, j + 1);
                shape.add_triangle(a, corner(sheet, i + 1, j), c);
                shape.add_triangle(a, c, corner(sheet, i, j + 1));
            }
        }
    }
    return shape;
}

/// Triangles around a common vertex; collapsed, their rim lies on a line, in a point, or in the
/// vertex itself.
Shape fan(Random& random, int) {
    Shape shape;
    const dvec3 hub = random.one_in(2) ? random.grid_point() : random.exact_point(1);
    const dvec3 along = random.direction();
    const int kind = random.from(0, 4);
    const auto rim = static_cast<std::uint32_t>(random.from(3, 20));
    shape.positions.push_back(hub);
    for (std::uint32_t i = 0; i < rim; ++i) {
        dvec3 p = hub + random.direction() * random.real(0.2, 1);
        if (kind == 0) p = hub + along * random.real(-1, 1);
        if (kind == 1) p = hub;
        if (kind == 2) p = hub + along;
        if (kind == 3) p.z = hub.z;
        shape.positions.push_back(p);
        shape.triangles.push_back({0, 1 + i, 1 + (i + 1) % rim});
    }
    return shape;
}

/// Two large triangles at an edge that one side divides, with triangles without area that close the
/// joint.
Shape t_joints(Random& random, int) {
    Shape shape;
    const dvec3 a = random.one_in(2) ? random.grid_point() : random.exact_point(1);
    const dvec3 b = random.one_in(2) ? random.grid_point() : random.exact_point(1);
    shape.positions = {a, b, random.exact_point(1), random.exact_point(1)};
    shape.triangles.push_back({0, 1, 2});
    const auto parts = static_cast<std::uint32_t>(random.from(2, 6));
    std::uint32_t before = 0;
    for (std::uint32_t i = 1; i <= parts; ++i) {
        std::uint32_t next = 1;
        if (i < parts) {
            next = static_cast<std::uint32_t>(shape.positions.size());
            shape.positions.push_back(a + (b - a) * (static_cast<double>(i) / parts));
            shape.triangles.push_back({before, next, 1});
        }
        shape.triangles.push_back({next, before, 3});
        before = next;
    }
    return shape;
}

Shape axis_aligned(Random& random, int count) {
    return triangles(count, [&] {
        const dvec3 a = random.grid_point();
        const int axis = random.from(0, 2);
        std::array corners{a, a, a};
        for (const std::size_t k : {1u, 2u})
            corners[k][(axis + static_cast<int>(k)) % 3] += random.sign() * random.from(1, 8) / 8.0;
        return corners;
    });
}

Shape small_closed_mesh(Random& random) {
    switch (random.from(0, 4)) {
        case 0:
            return icosphere(random.one_in(6) ? 1 : 0);
        case 1:
            return grid_box(random.one_in(4) ? 2 : 1);
        case 2: {
            const auto rings = static_cast<std::uint32_t>(random.from(3, 5));
            return torus(rings, static_cast<std::uint32_t>(random.from(3, 4)));
        }
        case 3:
            return star(0, random.bits());
        default: {
            Shape shape = tetrahedron();
            for (dvec3& p : shape.positions) p = random.grid_point();
            return shape;
        }
    }
}

/// Every third is pressed flat, to a line, or to a point.
Shape closed_mesh(Random& random, int) {
    Shape shape = small_closed_mesh(random);
    if (!random.one_in(3)) return shape;
    const int axis = random.from(0, 2);
    const double left = random.one_in(2) ? 0 : std::exp2(-random.from(1, 50));
    const int axes = random.from(1, 3);
    for (dvec3& p : shape.positions)
        for (int i = 0; i < axes; ++i) p[(axis + i) % 3] *= left;
    return shape;
}

/// A floor of two triangles, much larger than the objects on it.
Shape floor_with_things(Random& random, int count) {
    Shape shape = random.one_in(2) ? any_soup(random, count) : closed_mesh(random, count);
    const double size = random.magnitude(2, 1e5);
    const double level = random.one_in(2) ? 0 : random.real(-1, 1);
    const int up = random.from(0, 2);
    const auto corner = [&](double x, double y) {
        dvec3 p = {0, 0, 0};
        p[up] = level;
        p[(up + 1) % 3] = x * size;
        p[(up + 2) % 3] = y * size;
        return p;
    };
    shape.add_triangle(corner(-1, -1), corner(1, -1), corner(1, 1));
    shape.add_triangle(corner(-1, -1), corner(1, 1), corner(-1, 1));
    return shape;
}

}  // namespace

Shape icosphere(int levels) {
    const double g = std::numbers::phi;
    Shape shape{
        {{-1, g, 0},
         {1, g, 0},
         {-1, -g, 0},
         {1, -g, 0},
         {0, -1, g},
         {0, 1, g},
         {0, -1, -g},
         {0, 1, -g},
         {g, 0, -1},
         {g, 0, 1},
         {-g, 0, -1},
         {-g, 0, 1}},
        {{0, 11, 5},  {0, 5, 1},  {0, 1, 7},  {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4},
         {11, 10, 2}, {10, 7, 6}, {7, 1, 8},  {3, 9, 4},  {3, 4, 2},   {3, 2, 6}, {3, 6, 8},
         {3, 8, 9},   {4, 9, 5},  {2, 4, 11}, {6, 2, 10}, {8, 6, 7},   {9, 8, 1}}};
    for (dvec3& p : shape.positions) p = glm::normalize(p);
    for (int level = 0; level < levels; ++level) {
        std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
        const auto middle = [&](std::uint32_t a, std::uint32_t b) {
            const auto [entry, added] = middles.try_emplace(
                std::minmax(a, b), static_cast<std::uint32_t>(shape.positions.size()));
            if (added)
                shape.positions.push_back(glm::normalize(shape.positions[a] + shape.positions[b]));
            return entry->second;
        };
        std::vector<uvec3> finer;
        for (const uvec3& t : shape.triangles) {
            const std::uint32_t ab = middle(t.x, t.y);
            const std::uint32_t bc = middle(t.y, t.z);
            const std::uint32_t ca = middle(t.z, t.x);
            finer.insert(finer.end(), {{t.x, ab, ca}, {t.y, bc, ab}, {t.z, ca, bc}, {ab, bc, ca}});
        }
        shape.triangles = std::move(finer);
    }
    return shape;
}

Shape star(int levels, std::uint64_t seed) {
    Shape shape = icosphere(levels);
    Random random(seed);
    for (dvec3& p : shape.positions) p *= random.real(1, 6);
    return shape;
}

Shape torus(std::uint32_t rings, std::uint32_t sides) {
    Shape shape;
    const auto at = [&](std::uint32_t ring, std::uint32_t side) {
        return (ring % rings) * sides + side % sides;
    };
    for (std::uint32_t i = 0; i < rings; ++i) {
        for (std::uint32_t j = 0; j < sides; ++j) {
            const double a = 2 * std::numbers::pi * i / rings;
            const double b = 2 * std::numbers::pi * j / sides;
            const double r = 1 + 0.4 * std::cos(b);
            shape.positions.emplace_back(r * std::cos(a), 0.4 * std::sin(b), r * std::sin(a));
            shape.triangles.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
            shape.triangles.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
        }
    }
    return shape;
}

Shape grid_box(std::uint32_t cells) {
    Shape shape;
    std::map<std::array<std::uint32_t, 3>, std::uint32_t> ids;
    const auto vertex = [&](std::size_t axis, std::uint32_t side, std::uint32_t u,
                            std::uint32_t v) {
        std::array<std::uint32_t, 3> key{};
        key[axis] = side;
        key[(axis + 1) % 3] = u;
        key[(axis + 2) % 3] = v;
        const auto [entry, added] =
            ids.try_emplace(key, static_cast<std::uint32_t>(shape.positions.size()));
        if (added) shape.positions.push_back(dvec3(key[0], key[1], key[2]) * (2.0 / cells) - 1.0);
        return entry->second;
    };
    for (std::size_t axis = 0; axis < 3; ++axis) {
        for (const std::uint32_t side : {0u, cells}) {
            for (std::uint32_t u = 0; u < cells; ++u) {
                for (std::uint32_t v = 0; v < cells; ++v) {
                    const std::uint32_t a = vertex(axis, side, u, v);
                    const std::uint32_t b = vertex(axis, side, u + 1, v);
                    const std::uint32_t c = vertex(axis, side, u + 1, v + 1);
                    const std::uint32_t d = vertex(axis, side, u, v + 1);
                    shape.triangles.push_back({a, b, c});
                    shape.triangles.push_back({a, c, d});
                }
            }
        }
    }
    return shape;
}

Shape tetrahedron() {
    return {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}},
            {{0, 2, 1}, {0, 3, 2}, {0, 1, 3}, {1, 2, 3}}};
}

Shape height_map(std::uint32_t columns, std::uint32_t rows,
                 const std::function<double(std::uint32_t, std::uint32_t)>& height) {
    Shape shape;
    for (std::uint32_t y = 0; y <= rows; ++y) {
        for (std::uint32_t x = 0; x <= columns; ++x) {
            shape.positions.emplace_back(x, y, height(x, y));
            if (x == columns || y == rows) continue;
            const std::uint32_t a = y * (columns + 1) + x;
            const std::uint32_t c = a + columns + 2;
            shape.triangles.push_back({a, a + 1, c});
            shape.triangles.push_back({a, c, c - 1});
        }
    }
    return shape;
}

Shape soup(Random& random, int count, double size) {
    return triangles(count, [&] {
        const dvec3 centre = random.exact_point(1);
        return std::array{centre + random.exact_point(size), centre + random.exact_point(size),
                          centre + random.exact_point(size)};
    });
}

Shape needles(Random& random, int count) {
    const double width = random.magnitude(1e-9, 1e-2);
    const bool share_tip = random.one_in(2);
    const dvec3 tip = random.exact_point(1);
    return triangles(count, [&] {
        const dvec3 base = random.exact_point(1);
        return std::array{base, base + random.exact_point(width),
                          share_tip ? tip : random.exact_point(1)};
    });
}

Shape slivers(Random& random, int count) {
    const double height = random.magnitude(1e-9, 1e-2);
    return triangles(count, [&] {
        const dvec3 a = random.exact_point(1);
        const dvec3 b = random.exact_point(1);
        const dvec3 between = a + (b - a) * random.real(0, 1);
        return std::array{a, b, between + random.exact_point(height)};
    });
}

Shape duplicates(Random& random, int count) {
    const Shape once = any_soup(random, 1 + count / 3);
    Shape shape;
    for (const uvec3& t : once.triangles) {
        for (int copy = random.from(1, 4); copy > 0; --copy) {
            const uvec3 other = turned(random, t, 2);
            shape.add_triangle(once.positions[other.x], once.positions[other.y],
                               once.positions[other.z]);
        }
    }
    return shape;
}

Shape repeated(Random& random, int count) {
    Shape shape = any_soup(random, random.from(1, 8));
    const std::vector<uvec3> once = shape.triangles;
    for (int i = 0; i < count; ++i) shape.triangles.push_back(turned(random, random.pick(once), 4));
    return shape;
}

Shape shared_vertices(Random& random, int count, std::uint32_t vertices) {
    Shape shape;
    const bool on_grid = random.one_in(2);
    for (std::uint32_t i = 0; i < vertices; ++i)
        shape.positions.push_back(on_grid ? random.grid_point() : random.exact_point(1));
    for (int i = 0; i < count; ++i)
        shape.triangles.push_back(
            uvec3{random.below(vertices), random.below(vertices), random.below(vertices)});
    return shape;
}

Shape coplanar_stack(Random& random, int count) {
    const int fixed = random.from(0, 2);
    const bool on_grid = random.one_in(2);
    const bool tilted = random.one_in(3);
    const int layers = random.from(1, 3);
    const double gap = random.one_in(2) ? 0 : std::exp2(-random.from(1, 45));
    const dvec3 slope = random.exact_point(1);
    return triangles(count, [&] {
        std::array<dvec3, 3> corners;
        const double level = 0.25 + gap * random.from(0, layers - 1);
        for (dvec3& corner : corners) {
            corner = on_grid ? random.grid_point() : random.exact_point(1);
            corner[fixed] = level;
            if (tilted)
                corner[fixed] +=
                    slope.x * corner[(fixed + 1) % 3] + slope.y * corner[(fixed + 2) % 3];
        }
        return corners;
    });
}

Shape equal_corners(Random& random, int count) {
    return triangles(count, [&] {
        const vec3 p = random.one_in(3) ? vec3(0, random.real(-1, 1), 0) : random.point();
        vec3 corners[] = {p, p, random.one_in(2) ? p : p + random.point(0.3)};
        float& moved = corners[1][random.from(0, 2)];
        const int kind = random.from(0, 3);
        if (kind == 0) moved = std::nextafter(moved, 2.0f);
        if (kind == 1) moved += 0.2f;
        if (kind == 2 && moved == 0) moved = -moved;
        std::rotate(corners, corners + random.below(3), std::end(corners));
        return std::array<dvec3, 3>{corners[0], corners[1], corners[2]};
    });
}

Shape mixed_sizes(Random& random, int count) {
    return triangles(count, [&] {
        const double size = std::exp2(-random.from(0, 50));
        return std::array{random.exact_point(size), random.exact_point(size),
                          random.exact_point(size)};
    });
}

Shape progression(int count) {
    Shape shape;
    for (int i = 0; i < count; ++i) {
        const double x = std::exp2(-0.5 * i);
        shape.add_triangle({x, 0, 0}, {x, 0.2 * x, 0}, {x, 0, 0.2 * x});
    }
    return shape;
}

Shape square_below(Random& random, int count) {
    const dvec3 n = random.direction();
    const dvec3 x = glm::normalize(glm::cross(n, random.direction()));
    const dvec3 y = glm::cross(n, x);
    const double height = random.magnitude(1e-7, 0.1);
    Shape shape = soup(random, count, 1);
    for (dvec3& p : shape.positions) p = height * (p + n);
    shape.add_triangle(-x - y, x - y, x + y);
    shape.add_triangle(-x - y, x + y, y - x);
    return shape;
}

Shape any(Random& random) {
    using Maker = Shape (*)(Random&, int);
    const Maker makers[] = {
        any_soup,
        any_soup,
        any_soup,
        grid_soup,
        needles,
        few_vertices,
        slivers,
        duplicates,
        repeated,
        tie_grid,
        coplanar_stack,
        coplanar_stack,
        fan,
        t_joints,
        floor_with_things,
        axis_aligned,
        closed_mesh,
        closed_mesh,
        square_below,
        mixed_sizes,
        equal_corners,
        [](Random&, int count) { return progression(2 * count); },
    };
    const auto make = [&] {
        const int count = any_count(random);
        return random.pick(makers)(random, count);
    };
    Shape shape = make();
    if (random.one_in(8)) shape.append(make());
    return shape;
}

}  // namespace shapes
}  // namespace mray::test
