// A ray and a triangle, and the answer of the hit rule.
#pragma once

#include "common/interop/hit_rule.h"

namespace mray::cpu {

struct RuleCase {
    Ray ray;
    vec3 a;
    vec3 b;
    vec3 c;
};

struct RuleAnswer {
    bool hits = false;
    TriangleHit hit = {};
};

}  // namespace mray::cpu
