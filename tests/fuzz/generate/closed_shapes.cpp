#include "tests/fuzz/generate/closed_shapes.h"

#include <utility>

namespace mray::fuzz {
namespace {

Shape from_test_scene(std::string name, const test::TestScene& scene) {
    Shape shape{std::move(name), {}, scene.topology().triangles};
    for (const vec3& p : scene.world_positions()) shape.positions.emplace_back(p);
    return shape;
}

Shape whole_mesh(Dice& dice) {
    Shape shape;
    switch (dice.from(0, 4)) {
        case 0:
            shape = from_test_scene("ball", test::icosphere(dice.one_in(6) ? 1 : 0));
            break;
        case 1:
            shape = from_test_scene("box", test::grid_box(dice.one_in(4) ? 2 : 1));
            break;
        case 2: {
            const auto rings = static_cast<std::uint32_t>(dice.from(3, 5));
            shape = from_test_scene(
                "torus", test::torus(rings, static_cast<std::uint32_t>(dice.from(3, 4))));
            break;
        }
        case 3:
            shape = from_test_scene("star", test::star(0, dice.bits()));
            break;
        default:
            shape.name = "tetrahedron";
            for (int i = 0; i < 4; ++i) shape.positions.push_back(dice.grid_point());
            shape.triangles = {{0, 1, 2}, {0, 3, 1}, {1, 3, 2}, {2, 3, 0}};
    }
    return shape;
}

}  // namespace

Shape closed_mesh(Dice& dice) {
    Shape shape = whole_mesh(dice);
    if (dice.one_in(3)) {
        const int axis = dice.from(0, 2);
        const double left = dice.one_in(2) ? 0 : std::exp2(-dice.from(1, 50));
        const int axes = dice.from(1, 3);
        for (dvec3& p : shape.positions)
            for (int i = 0; i < axes; ++i) p[(axis + i) % 3] *= left;
        shape.name += ", collapsed";
    }
    return shape;
}

}  // namespace mray::fuzz
