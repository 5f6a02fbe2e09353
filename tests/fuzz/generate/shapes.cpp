#include "tests/fuzz/generate/generate.h"

#include <algorithm>
#include <utility>

namespace mray::fuzz {
namespace {

void add_triangle(Shape& shape, const dvec3& a, const dvec3& b, const dvec3& c) {
    const auto first = static_cast<std::uint32_t>(shape.positions.size());
    shape.positions.insert(shape.positions.end(), {a, b, c});
    shape.triangles.push_back({first, first + 1, first + 2});
}

void append(Shape& shape, const Shape& other) {
    const auto first = static_cast<std::uint32_t>(shape.positions.size());
    shape.positions.insert(shape.positions.end(), other.positions.begin(), other.positions.end());
    for (const uvec3& t : other.triangles)
        shape.triangles.push_back({t.x + first, t.y + first, t.z + first});
}

int triangle_count(Dice& dice) {
    if (dice.one_in(40)) return static_cast<int>(dice.magnitude(200, 2000));
    if (dice.one_in(8)) return dice.from(40, 200);
    return static_cast<int>(dice.magnitude(1, 41));
}

Shape random_soup(Dice& dice) {
    Shape shape;
    const double size = dice.magnitude(0.01, 2);
    for (int i = triangle_count(dice); i > 0; --i) {
        const dvec3 centre = dice.point(1);
        const dvec3 a = centre + dice.point(size);
        const dvec3 b = centre + dice.point(size);
        add_triangle(shape, a, b, centre + dice.point(size));
    }
    return shape;
}

Shape grid_soup(Dice& dice) {
    Shape shape;
    for (int i = triangle_count(dice); i > 0; --i) {
        const dvec3 a = dice.grid_point();
        const dvec3 b = dice.grid_point();
        add_triangle(shape, a, b, dice.grid_point());
    }
    return shape;
}

/// Triangles over few vertices, so that every edge and vertex has many.
Shape shared_vertices(Dice& dice) {
    Shape shape;
    const bool on_grid = dice.one_in(2);
    const auto vertices = static_cast<std::uint32_t>(dice.from(3, 12));
    for (std::uint32_t i = 0; i < vertices; ++i)
        shape.positions.push_back(on_grid ? dice.grid_point() : dice.point(1));
    for (int i = triangle_count(dice); i > 0; --i)
        shape.triangles.push_back(
            uvec3{dice.below(vertices), dice.below(vertices), dice.below(vertices)});
    return shape;
}

Shape needles(Dice& dice) {
    Shape shape;
    const double width = dice.magnitude(1e-9, 1e-2);
    const bool share_tip = dice.one_in(2);
    const dvec3 tip = dice.point(1);
    for (int i = triangle_count(dice); i > 0; --i) {
        const dvec3 base = dice.point(1);
        const dvec3 side = base + dice.point(width);
        add_triangle(shape, base, side, share_tip ? tip : dice.point(1));
    }
    return shape;
}

Shape slivers(Dice& dice) {
    Shape shape;
    const double height = dice.magnitude(1e-9, 1e-2);
    for (int i = triangle_count(dice); i > 0; --i) {
        const dvec3 a = dice.point(1);
        const dvec3 b = dice.point(1);
        add_triangle(shape, a, b, a + (b - a) * dice.real(0, 1) + dice.point(height));
    }
    return shape;
}

/// Some triangles, each several times, also turned and mirrored.
Shape duplicates(Dice& dice) {
    const Shape once = dice.one_in(2) ? grid_soup(dice) : random_soup(dice);
    Shape shape;
    const std::size_t kept = std::min<std::size_t>(once.triangles.size(), 30);
    for (std::size_t i = 0; i < kept; ++i) {
        for (int copy = dice.from(1, 4); copy > 0; --copy) {
            const uvec3 t = once.triangles[i];
            const int turn = dice.from(0, 2);
            uvec3 turned{t[turn], t[(turn + 1) % 3], t[(turn + 2) % 3]};
            if (dice.one_in(2)) std::swap(turned.x, turned.y);
            add_triangle(shape, once.positions[turned.x], once.positions[turned.y],
                         once.positions[turned.z]);
        }
    }
    return shape;
}

/// Few triangles over the same vertices again and again, also turned and mirrored.
Shape repeated(Dice& dice) {
    Shape shape = dice.one_in(2) ? grid_soup(dice) : random_soup(dice);
    shape.triangles.resize(std::min<std::size_t>(shape.triangles.size(), 8));
    const std::size_t kept = shape.triangles.size();
    for (int copy = dice.from(1, 200); copy > 0; --copy) {
        const uvec3 t = shape.triangles[static_cast<std::size_t>(dice.from(0, 7)) % kept];
        const int turn = dice.from(0, 2);
        uvec3 turned{t[turn], t[(turn + 1) % 3], t[(turn + 2) % 3]};
        if (dice.one_in(4)) std::swap(turned.x, turned.y);
        shape.triangles.push_back(turned);
    }
    return shape;
}

/// Overlapping triangles in one plane, or in few parallel ones at equal or almost equal distances.
Shape coplanar_stack(Dice& dice) {
    Shape shape;
    const int fixed = dice.from(0, 2);
    const bool on_grid = dice.one_in(2);
    const bool tilted = dice.one_in(3);
    const int layers = dice.from(1, 3);
    const double gap = dice.one_in(2) ? 0 : std::exp2(-dice.from(1, 45));
    const dvec3 slope = dice.point(1);
    for (int i = triangle_count(dice); i > 0; --i) {
        dvec3 corners[3];
        const double level = 0.25 + gap * dice.from(0, layers - 1);
        for (dvec3& corner : corners) {
            corner = on_grid ? dice.grid_point() : dice.point(1);
            corner[fixed] = level;
            if (tilted)
                corner[fixed] +=
                    slope.x * corner[(fixed + 1) % 3] + slope.y * corner[(fixed + 2) % 3];
        }
        add_triangle(shape, corners[0], corners[1], corners[2]);
    }
    return shape;
}

/// A square of cells, sometimes twice, so that every ray at a line of the grid meets ties.
Shape tie_grid(Dice& dice) {
    Shape shape;
    const int cells = dice.from(1, 4);
    const int sheets = dice.from(1, 3);
    const int fixed = dice.from(0, 2);
    const bool shifted = dice.one_in(3);
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
                add_triangle(shape, a, corner(sheet, i + 1, j), c);
                add_triangle(shape, a, c, corner(sheet, i, j + 1));
            }
        }
    }
    return shape;
}

/// Triangles around a common vertex; collapsed, their rim lies on a line, in a point, or in the
/// vertex itself.
Shape fan(Dice& dice) {
    Shape shape;
    const dvec3 hub = dice.one_in(2) ? dice.grid_point() : dice.point(1);
    const dvec3 along = dice.direction();
    const int kind = dice.from(0, 4);
    const auto rim = static_cast<std::uint32_t>(dice.from(3, 20));
    shape.positions.push_back(hub);
    for (std::uint32_t i = 0; i < rim; ++i) {
        dvec3 p = hub + dice.direction() * dice.real(0.2, 1);
        if (kind == 0) p = hub + along * dice.real(-1, 1);
        if (kind == 1) p = hub;
        if (kind == 2) p = hub + along;
        if (kind == 3) p.z = hub.z;
        shape.positions.push_back(p);
    }
    for (std::uint32_t i = 0; i < rim; ++i)
        shape.triangles.push_back({0, 1 + i, 1 + (i + 1) % rim});
    return shape;
}

/// Two large triangles at an edge that one side cuts into pieces, with triangles without area
/// that close the joint.
Shape t_joints(Dice& dice) {
    Shape shape;
    const dvec3 a = dice.one_in(2) ? dice.grid_point() : dice.point(1);
    const dvec3 b = dice.one_in(2) ? dice.grid_point() : dice.point(1);
    shape.positions = {a, b, dice.point(1), dice.point(1)};
    shape.triangles.push_back({0, 1, 2});
    const auto pieces = static_cast<std::uint32_t>(dice.from(2, 6));
    std::uint32_t before = 0;
    for (std::uint32_t i = 1; i <= pieces; ++i) {
        std::uint32_t next = 1;
        if (i < pieces) {
            next = static_cast<std::uint32_t>(shape.positions.size());
            shape.positions.push_back(a + (b - a) * (static_cast<double>(i) / pieces));
            shape.triangles.push_back({before, next, 1});
        }
        shape.triangles.push_back({next, before, 3});
        before = next;
    }
    return shape;
}

Shape from_test_scene(const test::TestScene& scene) {
    Shape shape{{}, scene.topology().triangles};
    for (const vec3& p : scene.world_positions()) shape.positions.emplace_back(p);
    return shape;
}

Shape whole_mesh(Dice& dice) {
    Shape shape;
    switch (dice.from(0, 4)) {
        case 0:
            shape = from_test_scene(test::icosphere(dice.one_in(6) ? 1 : 0));
            break;
        case 1:
            shape = from_test_scene(test::grid_box(dice.one_in(4) ? 2 : 1));
            break;
        case 2: {
            const auto rings = static_cast<std::uint32_t>(dice.from(3, 5));
            shape =
                from_test_scene(test::torus(rings, static_cast<std::uint32_t>(dice.from(3, 4))));
            break;
        }
        case 3:
            shape = from_test_scene(test::star(0, dice.bits()));
            break;
        default:
            for (int i = 0; i < 4; ++i) shape.positions.push_back(dice.grid_point());
            shape.triangles = {{0, 1, 2}, {0, 3, 1}, {1, 3, 2}, {2, 3, 0}};
    }
    return shape;
}

/// Balls, boxes, tori, stars and tetrahedra; every third is pressed flat, to a line, or to a point.
Shape closed_mesh(Dice& dice) {
    Shape shape = whole_mesh(dice);
    if (dice.one_in(3)) {
        const int axis = dice.from(0, 2);
        const double left = dice.one_in(2) ? 0 : std::exp2(-dice.from(1, 50));
        const int axes = dice.from(1, 3);
        for (dvec3& p : shape.positions)
            for (int i = 0; i < axes; ++i) p[(axis + i) % 3] *= left;
    }
    return shape;
}

/// A floor of few triangles, much larger than the objects on it.
Shape floor_with_things(Dice& dice) {
    Shape shape = dice.one_in(2) ? random_soup(dice) : closed_mesh(dice);
    const double size = dice.magnitude(2, 1e5);
    const double level = dice.one_in(2) ? 0 : dice.real(-1, 1);
    const int up = dice.from(0, 2);
    const auto corner = [&](double x, double y) {
        dvec3 p = {0, 0, 0};
        p[up] = level;
        p[(up + 1) % 3] = x * size;
        p[(up + 2) % 3] = y * size;
        return p;
    };
    add_triangle(shape, corner(-1, -1), corner(1, -1), corner(1, 1));
    add_triangle(shape, corner(-1, -1), corner(1, 1), corner(-1, 1));
    return shape;
}

Shape axis_aligned(Dice& dice) {
    Shape shape;
    for (int i = triangle_count(dice); i > 0; --i) {
        const dvec3 a = dice.grid_point();
        const int axis = dice.from(0, 2);
        dvec3 b = a;
        dvec3 c = a;
        b[(axis + 1) % 3] += dice.sign() * dice.from(1, 8) / 8.0;
        c[(axis + 2) % 3] += dice.sign() * dice.from(1, 8) / 8.0;
        add_triangle(shape, a, b, c);
    }
    return shape;
}

/// Magnitudes from 1 down to 2^-50 in one mesh.
Shape mixed_sizes(Dice& dice) {
    Shape shape;
    for (int i = triangle_count(dice); i > 0; --i) {
        const double size = std::exp2(-dice.from(0, 50));
        const dvec3 a = dice.point(size);
        const dvec3 b = dice.point(size);
        add_triangle(shape, a, b, dice.point(size));
    }
    return shape;
}

using Maker = Shape (*)(Dice&);
constexpr std::array kMakers = {
    Maker{random_soup},    Maker{random_soup},     Maker{grid_soup},         Maker{grid_soup},
    Maker{needles},        Maker{shared_vertices}, Maker{slivers},           Maker{duplicates},
    Maker{repeated},       Maker{tie_grid},        Maker{coplanar_stack},    Maker{fan},
    Maker{coplanar_stack}, Maker{t_joints},        Maker{floor_with_things}, Maker{axis_aligned},
    Maker{closed_mesh},    Maker{mixed_sizes},     Maker{closed_mesh},
};

}  // namespace

Shape make_shape(Dice& dice) {
    Shape shape = dice.pick(kMakers)(dice);
    if (dice.one_in(8)) {
        const Shape other = dice.pick(kMakers)(dice);
        append(shape, other);
    }
    return shape;
}

}  // namespace mray::fuzz
