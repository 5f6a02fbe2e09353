// The hit rule on vectors against the scalar one, bit for bit, on every target.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

#include "common/interop/hit_rule.h"
#include "common/simd/simd_target.h"
#include "tests/cpu/simd/rule_case.h"
#include "tests/support/test_scene.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "tests/cpu/simd/hit_rule_test.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "cpu/simd/hit_rule-inl.h"

HWY_BEFORE_NAMESPACE();
namespace mray::cpu {
namespace HWY_NAMESPACE {

/// Answers the cases by intersect_triangles. Only the lanes of `pattern` (repeated) are active;
/// other answers are kept.
void answer_cases(std::span<const RuleCase> cases, std::uint32_t pattern,
                  std::span<RuleAnswer> answers) {
    constexpr std::size_t kCount = kLanes;
    for (std::size_t first = 0; first < cases.size(); first += kCount) {
        // org, dir, a, b, c, and then tnear and tfar.
        alignas(64) float values[17][kCount];
        for (std::size_t i = 0; i < kCount; ++i) {
            const RuleCase& own = cases[std::min(first + i, cases.size() - 1)];
            const vec3 vectors[5] = {own.ray.org, own.ray.dir, own.a, own.b, own.c};
            for (int k = 0; k < 15; ++k) values[k][i] = vectors[k / 3][k % 3];
            values[15][i] = own.ray.tnear;
            values[16][i] = own.ray.tfar;
        }
        FloatVec v[17];
        for (int k = 0; k < 17; ++k) v[k] = load(values[k]);
        const std::uint32_t active = pattern >> (first % 16);
        lanes::TriangleHit hit;
        const TriangleCorners corners{lanes::Float3(v + 6), lanes::Float3(v + 9),
                                      lanes::Float3(v + 12)};
        const std::uint32_t hits =
            bits_of(intersect_triangles(lanes::shear_ray(lanes::Float3(v), lanes::Float3(v + 3)),
                                        mask_of(active), {v[15], v[16]}, corners, hit));
        store(hit.t, values[0]);
        store(hit.u, values[1]);
        store(hit.v, values[2]);
        for (std::size_t i = 0; i < std::min(kCount, cases.size() - first); ++i) {
            if ((active >> i & 1) == 0) continue;
            answers[first + i] = {(hits >> i & 1) != 0,
                                  {values[0][i], values[1][i], values[2][i], 0, 0}};
        }
    }
}

/// The error of each a[i] * b[i]; as many errors as factors.
void find_product_errors(std::span<const float> a, std::span<const float> b,
                         std::span<float> errors) {
    for (std::size_t i = 0; i < a.size(); i += kLanes) {
        const FloatVec va = load_unaligned(&a[i]);
        const FloatVec vb = load_unaligned(&b[i]);
        store_unaligned(lanes::product_error(va, vb, va * vb), &errors[i]);
    }
}

}  // namespace HWY_NAMESPACE
}  // namespace mray::cpu
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

#include "common/simd/simd_dispatch-inl.h"

namespace mray::cpu {
namespace {

using namespace test;

HWY_EXPORT(answer_cases);
HWY_EXPORT(find_product_errors);

/// A multiple of 2^grid below 2^top in magnitude, of any size in between; sometimes +0 or -0.
float grid_value(Random& random, int grid, int top) {
    const int exponent =
        grid + 1 + static_cast<int>(random.below(static_cast<std::uint32_t>(top - grid)));
    const double x = std::ldexp(random.real(-1, 1), exponent);
    const double unit = std::ldexp(1.0, std::max(grid, exponent - 24));
    return static_cast<float>(std::nearbyint(x / unit) * unit);
}

TEST(ProductErrors, HaveTheBitsOfDekkersSplittingOnAllGridsOfTheRule) {
    // Relative vertices and directions; projected points.
    const int grids[2][4] = {{-40, 41, -46, 1}, {-63, 44, -63, 44}};
    constexpr std::size_t kCases = 1 << 20;
    for (const int(&grid)[4] : grids) {
        Random random(1);
        std::vector<float> a(kCases), b(kCases), expected(kCases), found(kCases);
        for (std::size_t i = 0; i < kCases; ++i) {
            a[i] = grid_value(random, grid[0], grid[1]);
            b[i] = grid_value(random, grid[2], grid[3]);
            expected[i] = product_error(a[i], b[i], a[i] * b[i]);
        }
        for (const SimdTarget& target : supported_simd_targets()) {
            SIMD_FUNCTION(find_product_errors, target)(a, b, found);
            std::size_t differences = 0;
            for (std::size_t i = 0; i < kCases; ++i)
                differences += floatBitsToUint(found[i]) != floatBitsToUint(expected[i]);
            EXPECT_EQ(differences, 0u) << target.name;
        }
    }
}

/// How often the rule took each way to an answer.
struct Ways {
    std::size_t fast_hits = 0;
    std::size_t exact_hits = 0;
    std::size_t exact_misses = 0;
};

RuleAnswer expected_answer(const RuleCase& own, Ways& ways) {
    const ShearedRay s = shear_ray(own.ray.org, own.ray.dir);
    RuleAnswer answer;
    answer.hits =
        intersect_triangle(s, own.ray.tnear, own.ray.tfar, own.a, own.b, own.c, answer.hit);
    const Edges e =
        fast_edges(project_fast(s, own.a), project_fast(s, own.b), project_fast(s, own.c));
    const bool is_fast = surely_inside(s, e);
    ways.fast_hits += is_fast && answer.hits;
    ways.exact_hits += !is_fast && answer.hits;
    ways.exact_misses += !is_fast && !answer.hits && may_be_inside(e);
    return answer;
}

bool same(const RuleAnswer& a, const RuleAnswer& b) {
    const auto bits = [](float x) { return floatBitsToUint(x); };
    return a.hits == b.hits &&
           (!a.hits || (bits(a.hit.t) == bits(b.hit.t) && bits(a.hit.u) == bits(b.hit.u) &&
                        bits(a.hit.v) == bits(b.hit.v)));
}

void expect_same_answers(std::span<const RuleCase> cases, Ways& ways, const std::string& name) {
    std::vector<RuleAnswer> expected;
    for (const RuleCase& own : cases) expected.push_back(expected_answer(own, ways));
    for (const SimdTarget& target : supported_simd_targets()) {
        std::vector<RuleAnswer> found(cases.size());
        const auto answer = SIMD_FUNCTION(answer_cases, target);
        answer(cases, 0x5A5A5A5Au, found);
        answer(cases, ~0x5A5A5A5Au, found);
        std::size_t differences = 0;
        for (std::size_t i = 0; i < cases.size(); ++i) differences += !same(found[i], expected[i]);
        EXPECT_EQ(differences, 0u) << name << ", " << target.name;
    }
}

TEST(RuleOnVectors, HasTheBitsOfTheScalarRuleOnAdversarialScenes) {
    Ways ways;
    for (const NamedScene& named : adversarial_scenes()) {
        const auto& triangles = named.scene.topology().triangles;
        if (triangles.empty()) continue;
        Random random(7);
        std::vector<RuleCase> cases;
        for (const Ray& ray : mixed_rays(named.scene, 20000, 8)) {
            const uvec3 t = random.pick(triangles);
            const std::vector<vec3>& p = named.scene.positions();
            cases.push_back({ray, p[t.x], p[t.y], p[t.z]});
        }
        cases.push_back(cases.back());
        cases.back().ray.dir = {0, 0, 0};
        expect_same_answers(cases, ways, named.name);
    }
    EXPECT_GT(ways.exact_hits, 1000u);
    EXPECT_GT(ways.exact_misses, 1000u);
}

/// A ray that passes a triangle of any size and thinness at a vertex, an edge or in between, comes
/// from far off, lies in its plane, or starts next to it.
RuleCase random_case(Random& random) {
    const double size = std::ldexp(kSceneExtent, -static_cast<int>(random.below(50)));
    const double thin = std::ldexp(size, -static_cast<int>(random.below(30)));
    RuleCase own;
    own.a = snap_point(random.point(kSceneExtent - size));
    own.b = snap_point(own.a + random.point(size / 2));
    own.c = random.below(2) == 0
                ? snap_point(own.a + random.point(size / 2))
                : snap_point(own.a + (own.b - own.a) * static_cast<float>(random.real(0, 1)) +
                             random.point(thin / 2));
    const float u = static_cast<float>(random.below(3)) / 2;
    const float v = static_cast<float>(random.real(0, 1)) * (1 - u);
    const vec3 target = own.a + (own.b - own.a) * u + (own.c - own.a) * v;
    const std::uint32_t kind = random.below(8);
    if (kind < 3) {
        own.ray.org = snap_point(random.point(kSceneExtent));
    } else if (kind == 3) {
        own.ray.org = snap_point(random.point(kOriginExtent));
    } else {
        own.ray.org = snap_point(
            target + random.point(std::ldexp(size, -static_cast<int>(random.below(30)))));
    }
    own.ray.dir = canonical_direction(kind == 7   ? own.b - own.a
                                      : kind == 6 ? random.point()
                                                  : target - own.ray.org);
    own.ray.tnear = 0;
    own.ray.tfar = random.below(4) == 0 ? largest_component(target - own.ray.org) : kInfiniteT;
    return own;
}

TEST(RuleOnVectors, HasTheBitsOfTheScalarRuleOnTrianglesOfAnySizeAndThinness) {
    Random random(9);
    Ways ways;
    for (int round = 0; round < 60; ++round) {
        std::vector<RuleCase> cases;
        for (int i = 0; i < 20000; ++i) cases.push_back(random_case(random));
        expect_same_answers(cases, ways, "random");
    }
    EXPECT_GT(ways.fast_hits, 10000u);
    EXPECT_GT(ways.exact_hits, 10000u);
    EXPECT_GT(ways.exact_misses, 10000u);
}

// Rough hits with a weight below the steps of floats, where the rounded others add up to more
// than 1.
TEST(RuleOnVectors, HasTheBitsOfTheScalarRuleBesideEdges) {
    Random random(97);
    const auto corner = [&] {
        const auto side = [&] { return random.real(-0.5, 0.5) * kSceneExtent; };
        return snap_point(vec3(side(), side(), side()));
    };
    std::vector<RuleCase> cases;
    for (int i = 0; i < 200'000; ++i) {
        RuleCase own{{}, corner(), corner(), corner()};
        const double u = random.real(0, 1);
        const double a = std::exp2(random.real(-40, -20));
        const glm::dvec3 at = a * glm::dvec3(own.a) + (1 - a) * u * glm::dvec3(own.b) +
                              (1 - a) * (1 - u) * glm::dvec3(own.c);
        own.ray.org = snap_point(vec3(at + random.real(0.001, 0.1) * glm::dvec3(corner())));
        own.ray.dir = canonical_direction(vec3(at - glm::dvec3(own.ray.org)));
        own.ray.tnear = 0;
        own.ray.tfar = kInfiniteT;
        cases.push_back(own);
    }
    Ways ways;
    expect_same_answers(cases, ways, "beside edges");
    EXPECT_GT(ways.exact_hits, 1000u);
    const auto has_whole_weights = [&](const RuleCase& own) {
        const RuleAnswer answer = expected_answer(own, ways);
        return answer.hits && answer.hit.v == 1 - answer.hit.u;
    };
    EXPECT_GT(std::ranges::count_if(cases, has_whole_weights), 10);
}

}  // namespace
}  // namespace mray::cpu

#endif  // HWY_ONCE
