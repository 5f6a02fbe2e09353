// An intersector that shares nothing with the tracers: signed volumes over the same float inputs,
// in long double, every triangle.
#pragma once

#include <vector>

#include "tests/support/test_scene.h"

namespace mray::test {

struct OracleHit {
    bool hit = false;
    long double t = 0;
    std::uint32_t prim_id = 0;
    /// A triangle as near or nearer is grazed at an edge to within 1e-6 of its size, seen edge-on,
    /// or has its t within 1e-6 of the best: either answer is right.
    bool ambiguous = false;
};

/// Closest hit in scene space.
OracleHit oracle_intersect(const TestScene& scene, const Ray& ray);

}  // namespace mray::test
