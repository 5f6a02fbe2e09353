#include "scenes/polygons/triangulate.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <compare>
#include <cstddef>
#include <map>
#include <numbers>
#include <numeric>
#include <random>
#include <set>
#include <string>
#include <utility>

namespace mray {
namespace {

Polygons one_face(std::size_t corners) {
    Polygons faces;
    faces.corners.resize(corners);
    std::iota(faces.corners.begin(), faces.corners.end(), 0u);
    faces.corner_counts = {static_cast<std::uint32_t>(corners)};
    return faces;
}

std::vector<uvec3> triangles_of(const std::vector<vec3>& positions) {
    return triangulate(one_face(positions.size()), positions);
}

TEST(Triangulate, ConvexFaceIsAFanFromItsFirstCorner) {
    EXPECT_EQ(triangles_of({{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}),
              (std::vector<uvec3>{{0, 1, 2}, {0, 2, 3}}));
}

struct Corner {
    int x = 0;
    int y = 0;
    auto operator<=>(const Corner&) const = default;
};
using Curve = std::vector<Corner>;

int doubled_area(Corner a, Corner b, Corner c) {
    return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

bool any_cross(const Curve& curve) {
    const auto opposite = [](Corner a, Corner b, Corner c, Corner d) {
        const int left = doubled_area(a, b, c);
        const int right = doubled_area(a, b, d);
        return (left < 0 && right > 0) || (left > 0 && right < 0);
    };
    for (std::size_t i = 0; i < curve.size(); ++i) {
        for (std::size_t j = 0; j < i; ++j) {
            const Corner a = curve[i];
            const Corner b = curve[(i + 1) % curve.size()];
            const Corner c = curve[j];
            const Corner d = curve[(j + 1) % curve.size()];
            if (opposite(a, b, c, d) && opposite(c, d, a, b)) return true;
        }
    }
    return false;
}

/// Grid triangles, one after the other, each walked around from a corner of the curve so far. That
/// gives pinches, holes and edges walked there and back. Then corners within straight lines and
/// tips of spikes go, and other spikes come.
class RandomCurves {
public:
    /// Its edges do not cross; its winding number is 1 or 0 everywhere.
    Curve next() {
        Curve curve;
        do {
            curve = make();
        } while (any_cross(curve));
        return curve;
    }

private:
    int below(int n) { return static_cast<int>(random_() % static_cast<unsigned>(n)); }
    std::size_t any(const Curve& curve) { return random_() % curve.size(); }

    Curve make() {
        const int size = 2 + below(4);
        std::set<std::array<int, 3>> used;
        Curve curve;
        for (int tries = 1 + below(5 * size * size); tries > 0; --tries) {
            const std::array<int, 3> at = {below(size), below(size), below(2)};
            const auto [x, y, half] = at;
            Curve cell = {{x, y}, {x + 1, y + half}, {x + 1 - half, y + 1}};
            std::rotate(cell.begin(), cell.begin() + below(3), cell.end());
            const auto shared = std::find(curve.begin(), curve.end(), cell[0]);
            if (used.contains(at) || (!curve.empty() && shared == curve.end())) continue;
            used.insert(at);
            curve.insert(shared, cell.begin(), cell.end());
        }
        for (int tries = below(300); tries > 0 && curve.size() > 4; --tries) {
            const std::size_t i = any(curve);
            const std::size_t n = curve.size();
            if (doubled_area(curve[(i + n - 1) % n], curve[i], curve[(i + 1) % n]) == 0)
                curve.erase(curve.begin() + static_cast<std::ptrdiff_t>(i));
        }
        for (int spikes = below(4); spikes > 0; --spikes) {
            const std::size_t i = any(curve);
            const Corner foot = curve[i];
            const Corner tip = {below(size + 2) - 1, below(size + 2) - 1};
            curve.insert(curve.begin() + static_cast<std::ptrdiff_t>(i), {foot, tip});
        }
        return curve;
    }

    std::mt19937 random_{44};
};

/// No triangle is turned, and the edges of all are those of the curve, but for edges there and
/// back. So each point is in as many triangles as the curve winds around it.
void expect_same_winding(const Curve& curve) {
    std::vector<vec3> positions;
    int whole = 0;
    for (const Corner c : curve) {
        positions.emplace_back(c.x, c.y, c.x - 2 * c.y);
        whole += doubled_area({0, 0}, c, curve[positions.size() % curve.size()]);
    }
    const std::vector<uvec3> triangles = triangles_of(positions);
    ASSERT_EQ(triangles.size(), curve.size() - 2);
    std::map<std::pair<Corner, Corner>, int> edges;
    const auto count = [&](Corner a, Corner b, int times) {
        if (a != b) edges[std::minmax(a, b)] += a < b ? times : -times;
    };
    int sum = 0;
    for (const uvec3& t : triangles) {
        const Corner corners[3] = {curve[t.x], curve[t.y], curve[t.z]};
        const int area = doubled_area(corners[0], corners[1], corners[2]);
        EXPECT_GE(whole > 0 ? area : -area, 0);
        sum += area;
        for (int i = 0; i < 3; ++i) count(corners[i], corners[(i + 1) % 3], 1);
    }
    EXPECT_EQ(sum, whole);
    for (std::size_t i = 0; i < curve.size(); ++i)
        count(curve[i], curve[(i + 1) % curve.size()], -1);
    for (const auto& [edge, times] : edges) EXPECT_EQ(times, 0);
}

TEST(Triangulate, CurvesThatTouchThemselvesAreCoveredOnceFromEachCorner) {
    RandomCurves random;
    for (int round = 0; round < 150; ++round) {
        Curve curve = random.next();
        for (Corner& c : curve) c = {5 * c.x + round % 3 * c.y, 4 * c.y + round % 2 * c.x};
        for (int turn = 0; turn < 2; ++turn) {
            for (std::size_t first = 0; first < curve.size() && !HasFailure(); ++first) {
                std::rotate(curve.begin(), curve.begin() + 1, curve.end());
                expect_same_winding(curve);
            }
            std::reverse(curve.begin(), curve.end());
        }
        std::string text;
        for (const Corner c : curve) text += fmt::format(" ({},{})", c.x, c.y);
        ASSERT_FALSE(HasFailure()) << "round " << round << text;
    }
}

Corner on_circle(double angle, double radius) {
    return {static_cast<int>(radius * std::cos(angle)), static_cast<int>(radius * std::sin(angle))};
}

TEST(Triangulate, RandomStarsAreCoveredOnce) {
    std::mt19937 random(11);
    std::uniform_real_distribution<double> radius(2000, 20000);
    for (int round = 0; round <= 300; ++round) {
        SCOPED_TRACE(round);
        // The last one would take long if the time were cubic.
        const int count = round < 300 ? 4 + round : 4000;
        Curve star;
        for (int i = 0; i < count; ++i)
            star.push_back(on_circle(2 * std::numbers::pi * i / count, radius(random)));
        if (round % 2 == 1) std::reverse(star.begin(), star.end());
        expect_same_winding(star);
    }
}

TEST(Triangulate, CombsSpiralsAndArrowsAreCoveredOnce) {
    Curve comb, spiral, teeth;
    for (int i = 0; i < 4001; ++i) comb.push_back({i, i % 2 * 1000});
    comb.insert(comb.end(), {{4000, -1}, {0, -1}});
    for (int side = 0; side < 2; ++side) {
        for (int k = 0; k < 400; ++k) {
            const int i = side == 0 ? k : 399 - k;
            spiral.push_back(on_circle(0.1 * i, 2000 + 20 * i + 400 * side));
        }
    }
    // Long teeth that lean over: the box of each holds the feet of all after it.
    for (int i = 0; i < 300; ++i) teeth.insert(teeth.end(), {{-2 * i, 0}, {-2 * i - 601, 600}});
    teeth.insert(teeth.end(), {{-600, 0}, {-600, -1}, {0, -1}});
    for (const Curve& curve : {comb, spiral, teeth, Curve{{0, 0}, {4, 0}, {1, 1}, {0, 4}}}) {
        SCOPED_TRACE(curve.size());
        expect_same_winding(curve);
    }
}

TEST(Triangulate, AFaceWhoseEdgesCrossIsNamed) {
    const std::vector<vec3> positions = {{0, 0, 0}, {2, 0, 0}, {2, 2, 0}, {0, 2, 0}};
    const Polygons faces = {{0, 1, 2, 0, 1, 2, 3, 0, 2, 1, 3, 0, 2, 3, 1, 0, 1, 2, 3, 1},
                            {3, 4, 4, 4, 5}};
    std::vector<std::size_t> crossing;
    EXPECT_EQ(triangulate(faces, positions, nullptr, &crossing).size(), 10u);
    EXPECT_EQ(crossing, (std::vector<std::size_t>{1, 2}));
}

TEST(Triangulate, AFaceOfTooManyCornersIsAFanAndIsNamed) {
    std::vector<vec3> zigzag = {{0, -1, 0}};
    for (int i = 0; i < 8192; ++i) zigzag.emplace_back(8192 - i, i % 2, 0);
    std::vector<std::size_t> crossing;
    const std::vector<uvec3> triangles =
        triangulate(one_face(zigzag.size()), zigzag, nullptr, &crossing);
    ASSERT_EQ(triangles.size(), zigzag.size() - 2);
    EXPECT_EQ(triangles[5], uvec3(0, 6, 7));
    EXPECT_EQ(crossing, std::vector<std::size_t>{0});
}

TEST(Triangulate, FacesWithoutAnAnswerStillGetTheirNumberOfTriangles) {
    const float nan = std::numeric_limits<float>::quiet_NaN();
    const float inf = std::numeric_limits<float>::infinity();
    const std::vector<std::vector<vec3>> faces = {
        std::vector<vec3>(7, vec3(1, 2, 3)),
        {{0, 0, 0}, {1, 1, 1}, {2, 2, 2}, {3, 3, 3}, {1, 1, 1}},
        {{0, 0, 0}, {nan, 0, 0}, {1, 1, 0}, {0, 1, 0}},
        {{0, 0, 0}, {1, 0, 0}, {1, inf, 0}, {0, 1, 0}},
        {{3e38f, 3e38f, 0}, {-3e38f, 3e38f, 0}, {3e37f, -3e37f, 0}, {3e38f, -3e38f, 0}},
        {{0, 0, 0}, {1, 1, 0}, {1, 0, 0}, {0, 1, 0}},                 // bow tie
        {{0, 3, 0}, {2, -3, 0}, {-3, 1, 0}, {3, 1, 0}, {-2, -3, 0}},  // pentagram
        {{0, 0, 0}, {1e-42f, 0, 0}, {1e-43f, 1e-43f, 0}, {0, 1e-42f, 0}},
    };
    for (const std::vector<vec3>& face : faces) {
        const std::vector<uvec3> triangles = triangles_of(face);
        ASSERT_EQ(triangles.size(), face.size() - 2);
        for (const uvec3& t : triangles) {
            EXPECT_LT(std::max({t.x, t.y, t.z}), face.size());
            EXPECT_TRUE(t.x != t.y && t.y != t.z && t.z != t.x);
        }
    }
}

TEST(Triangulate, CrossingEdgesOfThousandsOfCornersEnd) {
    std::mt19937 random(3);
    std::uniform_real_distribution<float> coordinate(0, 1);
    std::vector<vec3> tangle(5'000);
    for (vec3& p : tangle) p = {coordinate(random), coordinate(random), 0};
    EXPECT_EQ(triangles_of(tangle).size(), tangle.size() - 2);
}

}  // namespace
}  // namespace mray
