// Pairs of triangles that cross, against a referee that solves for their common points in rational
// numbers.
#include <gmpxx.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdint>
#include <set>
#include <vector>

#include "common/scene/triangle_crossing.h"
#include "tests/library/scenes.h"

namespace mray::test {
namespace {

using morphray::CrossingOptions;
using morphray::CrossingPair;
using morphray::Crossings;
using morphray::Device;
using morphray::Scene;

using Triangle = std::array<vec3, 3>;
using Rational = mpq_class;
using RationalPoint = std::array<Rational, 3>;

// ---- The referee

/// Rows of `columns` coefficients and a right side.
using Equations = std::vector<std::vector<Rational>>;

/// Solves equations by elimination; returns their rank. `solution` is set if it is the only one.
std::size_t solve(Equations rows, std::size_t columns, std::vector<Rational>& solution,
                  bool& has_solution) {
    std::size_t rank = 0;
    for (std::size_t column = 0; column < columns && rank < rows.size(); ++column) {
        std::size_t pivot = rank;
        while (pivot < rows.size() && rows[pivot][column] == 0) ++pivot;
        if (pivot == rows.size()) continue;
        std::swap(rows[rank], rows[pivot]);
        for (std::size_t r = 0; r < rows.size(); ++r) {
            if (r == rank || rows[r][column] == 0) continue;
            const Rational factor = rows[r][column] / rows[rank][column];
            for (std::size_t c = column; c <= columns; ++c) rows[r][c] -= factor * rows[rank][c];
        }
        ++rank;
    }
    has_solution = true;
    for (std::size_t r = rank; r < rows.size(); ++r) has_solution &= rows[r][columns] == 0;
    solution.clear();
    // With full rank every column has a pivot, in order.
    if (has_solution && rank == columns)
        for (std::size_t c = 0; c < columns; ++c) solution.push_back(rows[c][columns] / rows[c][c]);
    return rank;
}

RationalPoint rational(const vec3& p) {
    const auto of = [](float x) { return Rational(static_cast<double>(x)); };
    return {of(p.x), of(p.y), of(p.z)};
}

/// The corners of what two triangles have in common: as weights (u, v) of each, where as many
/// weights are at a bound as leave one solution.
std::vector<RationalPoint> common_corners(const Triangle& first, const Triangle& second) {
    RationalPoint a[3], b[3];
    std::ranges::transform(first, a, rational);
    std::ranges::transform(second, b, rational);
    Equations equal;
    for (std::size_t x = 0; x < 3; ++x)
        equal.push_back({a[1][x] - a[0][x], a[2][x] - a[0][x], b[0][x] - b[1][x], b[0][x] - b[2][x],
                         b[0][x] - a[0][x]});
    const Equations bounds = {{1, 0, 0, 0, 0}, {0, 1, 0, 0, 0}, {1, 1, 0, 0, 1},
                              {0, 0, 1, 0, 0}, {0, 0, 0, 1, 0}, {0, 0, 1, 1, 1}};
    std::vector<Rational> weights;
    bool has_solution = false;
    const int left = 4 - static_cast<int>(solve(equal, 4, weights, has_solution));
    std::vector<RationalPoint> corners;
    for (unsigned chosen = 0; has_solution && chosen < 64; ++chosen) {
        if (std::popcount(chosen) != left) continue;
        Equations all = equal;
        for (std::size_t i = 0; i < 6; ++i)
            if ((chosen >> i & 1) != 0) all.push_back(bounds[i]);
        bool is_solved = false;
        solve(all, 4, weights, is_solved);
        if (!is_solved || weights.empty()) continue;
        if (std::ranges::any_of(weights, [](const Rational& w) { return w < 0; })) continue;
        if (weights[0] + weights[1] > 1 || weights[2] + weights[3] > 1) continue;
        RationalPoint corner;
        for (std::size_t x = 0; x < 3; ++x)
            corner[x] =
                a[0][x] + weights[0] * (a[1][x] - a[0][x]) + weights[1] * (a[2][x] - a[0][x]);
        corners.push_back(corner);
    }
    return corners;
}

bool is_between(const RationalPoint& p, const RationalPoint& from, const RationalPoint& to) {
    for (std::size_t x = 0; x < 3; ++x) {
        const std::size_t y = (x + 1) % 3;
        if ((p[x] - from[x]) * (to[y] - from[y]) != (p[y] - from[y]) * (to[x] - from[x]))
            return false;
        if (p[x] < std::min(from[x], to[x]) || p[x] > std::max(from[x], to[x])) return false;
    }
    return true;
}

/// Whether the common points are more than common vertices and edges.
bool referee_crosses(const Triangle& a, const Triangle& b) {
    std::vector<RationalPoint> corners = common_corners(a, b);
    if (corners.empty()) return false;
    std::vector<RationalPoint> shared;
    for (const vec3& p : a)
        if (std::ranges::count(b, p) > 0) shared.push_back(rational(p));
    RationalPoint middle = {0, 0, 0};
    for (const RationalPoint& corner : corners)
        for (std::size_t axis = 0; axis < 3; ++axis)
            middle[axis] += corner[axis] / static_cast<double>(corners.size());
    corners.push_back(middle);
    return std::ranges::any_of(corners, [&](const RationalPoint& p) {
        for (const RationalPoint& from : shared)
            for (const RationalPoint& to : shared)
                if (is_between(p, from, to)) return false;
        return true;
    });
}

// ---- Pairs that are aimed at what is hard

class PairMaker {
public:
    explicit PairMaker(std::uint64_t seed) : random_(seed) {}

    std::array<Triangle, 2> next() {
        const std::uint32_t kind = random_.below(6);
        Triangle a, b;
        for (Triangle* t : {&a, &b})
            for (vec3& p : *t) p = kind < 4 ? grid() : random_.point();
        // Shared vertices, points on edges and in the plane of the other triangle.
        const std::uint32_t shared = random_.below(4);
        for (std::uint32_t i = 0; i < shared; ++i) b[random_.below(3)] = a[random_.below(3)];
        if (random_.one_in(3)) b[2] = along(a[0], a[1]);
        if (random_.one_in(4)) b[1] = along(a[1], along(a[0], a[2]));
        if (random_.one_in(6)) a[2] = along(a[0], a[1]);
        if (random_.one_in(12)) a[1] = a[0];
        if (random_.one_in(12)) b = {a[1], a[2], a[0]};
        if (random_.one_in(3)) nudge(b[random_.below(3)]);
        const float scale = random_.one_in(4) ? (random_.one_in(2) ? 1e-30f : 1e30f) : 1.0f;
        for (Triangle* t : {&a, &b})
            for (vec3& p : *t) p *= scale;
        return {a, b};
    }

private:
    vec3 grid() {
        const vec3 p(random_.from(-2, 2), random_.from(-2, 2), random_.from(-2, 2));
        return random_.one_in(2) ? p : vec3(p.x, p.y, 0);
    }
    vec3 along(vec3 p, vec3 q) {
        return p + 0.25f * static_cast<float>(random_.from(-1, 5)) * (q - p);
    }
    void nudge(vec3& p) {
        const int axis = random_.from(0, 2);
        p[axis] = std::nextafter(p[axis], static_cast<float>(random_.sign()) * 10);
    }

    Random random_;
};

TEST(Crossings, OfPairsAreThoseOfTheReferee) {
    constexpr int kPairs = 6'000;
    PairMaker maker(1);
    int wrong = 0, crossing = 0;
    for (int i = 0; i < kPairs; ++i) {
        const auto [a, b] = maker.next();
        const bool expected = referee_crosses(a, b);
        crossing += expected;
        wrong += triangles_cross(a, b) != expected || triangles_cross(b, a) != expected;
    }
    EXPECT_EQ(wrong, 0);
    EXPECT_GT(crossing, kPairs / 10);
    EXPECT_LT(crossing, kPairs - kPairs / 10);
}

// ---- Scenes

Triangle corners_of(const UserMesh& mesh, std::size_t prim) {
    Triangle corners;
    for (std::size_t k = 0; k < 3; ++k) {
        const morphray::Vec3& p = mesh.points[mesh.triangles[3 * prim + k]];
        corners[k] = {p.x, p.y, p.z};
    }
    return corners;
}

bool is_finite(const Triangle& t) {
    return std::ranges::all_of(
        t, [](vec3 p) { return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z); });
}

/// All pairs of all meshes, one after the other.
std::vector<CrossingPair> every_crossing(const std::vector<UserMesh>& meshes) {
    std::vector<std::pair<morphray::Primitive, Triangle>> all;
    for (std::uint32_t id = 0; id < meshes.size(); ++id)
        for (std::uint32_t i = 0; i < meshes[id].triangles.size() / 3; ++i)
            all.push_back({{i, id}, corners_of(meshes[id], i)});
    std::vector<CrossingPair> pairs;
    for (std::size_t i = 0; i < all.size(); ++i)
        for (std::size_t k = i + 1; k < all.size(); ++k)
            if (is_finite(all[i].second) && is_finite(all[k].second) &&
                triangles_cross(all[i].second, all[k].second))
                pairs.push_back({all[i].first, all[k].first});
    return pairs;
}

Scene scene_of(const std::vector<UserMesh>& meshes, const Device& device = Device::cpu()) {
    return Scene::build(views_of(meshes), device);
}

TEST(Crossings, OfScenesAreThoseOfAllPairs) {
    std::size_t found = 0;
    for (const NamedScene& named : adversarial_scenes()) {
        const std::vector<UserMesh> meshes = {UserMesh(named.scene)};
        if (meshes[0].triangles.size() > 3 * 250) continue;
        const std::vector<CrossingPair> expected = every_crossing(meshes);
        found += expected.size();
        for (const std::string& simd : all_simd()) {
            const Scene scene = scene_of(meshes, Device::cpu({.threads = 2, .simd = simd}));
            const Crossings crossings = scene.crossings();
            EXPECT_EQ(crossings.pairs == expected, true)
                << named.name << ", " << simd << ": " << crossings.pairs.size() << " for "
                << expected.size();
            EXPECT_EQ(crossings.left_out, 0u);
            EXPECT_EQ(scene.has_crossings(), !expected.empty()) << named.name;
        }
    }
    EXPECT_GT(found, 1000u);
}

TEST(Crossings, ArePairsOfTheMeshesAskedFor) {
    const std::vector<UserMesh> meshes = {UserMesh(random_soup(150, 0.5, 1)),
                                          UserMesh(torus(12, 8)), UserMesh(icosphere(2, 0.9))};
    const std::vector<CrossingPair> all = every_crossing(meshes);
    const Scene scene = scene_of(meshes);
    EXPECT_EQ(scene.crossings().pairs == all, true);
    const auto among = [&](const std::set<std::uint32_t>& first,
                           const std::set<std::uint32_t>& second) {
        std::vector<CrossingPair> kept;
        for (const CrossingPair& pair : all) {
            const std::uint32_t a = pair.first.geom_id, b = pair.second.geom_id;
            if ((first.count(a) && second.count(b)) || (first.count(b) && second.count(a)))
                kept.push_back(pair);
        }
        return kept;
    };
    const std::vector<std::uint32_t> zero = {0}, two = {2}, both = {2, 0};
    EXPECT_EQ(scene.crossings({.geom_ids = zero}).pairs == among({0}, {0}), true);
    EXPECT_EQ(scene.crossings({.geom_ids = zero, .other = two}).pairs == among({0}, {2}), true);
    EXPECT_EQ(scene.crossings({.other = two}).pairs == among({0, 1, 2}, {2}), true);
    const Crossings of_both = scene.crossings({.geom_ids = both, .limit = 5});
    const std::vector<CrossingPair> expected = among({0, 2}, {0, 2});
    ASSERT_GT(expected.size(), 5u);
    EXPECT_EQ(of_both.pairs == std::vector(expected.begin(), expected.begin() + 5), true);
    EXPECT_EQ(of_both.left_out, expected.size() - 5);
    const std::vector<std::uint8_t> visible = {1, 1, 0};
    EXPECT_EQ(scene.crossings({}, {.visible = visible}).pairs == among({0, 1}, {0, 1}), true);
    EXPECT_FALSE(scene.has_crossings({.geom_ids = two}));
    EXPECT_EQ(scene.crossings({.limit = 0}).left_out, all.size());

    const std::vector<std::uint32_t> missing = {3};
    EXPECT_EQ(error_of([&] { scene.crossings({.geom_ids = missing}); }), "bad_argument");
    const std::atomic<bool> cancel = true;
    EXPECT_EQ(error_of([&] { scene.crossings({}, {.cancel = &cancel}); }), "cancelled");
}

TEST(Crossings, OfRefittedTreesAndWhatIsLeftOut) {
    std::vector<UserMesh> meshes = {UserMesh(torus(24, 12)), UserMesh(torus(24, 12))};
    // Equal triangles, which a tree may have once, and a vertex that is left out.
    meshes[1].triangles.insert(meshes[1].triangles.end(), meshes[1].triangles.begin(),
                               meshes[1].triangles.begin() + 30);
    Scene scene = scene_of(meshes);
    Random random(5);
    for (int frame = 0; frame < 4; ++frame) {
        for (morphray::Vec3& p : meshes[0].points) {
            const vec3 by = random.point(0.05);
            p = {p.x + by.x, p.y + by.y, p.z + by.z};
        }
        if (frame == 2) meshes[0].points[7].y = std::numeric_limits<float>::quiet_NaN();
        if (frame == 3) meshes[1].points[3].x = 1e-25f;
        scene.update();
        const std::vector<CrossingPair> expected = every_crossing(meshes);
        EXPECT_EQ(scene.crossings().pairs == expected, true) << frame;
        EXPECT_GT(expected.size(), 100u);
    }
}

}  // namespace
}  // namespace mray::test
