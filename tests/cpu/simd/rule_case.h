// A ray and a triangle, and what the hit rule says of them.
#pragma once

#include "common/interop/hit_rule.h"

namespace morphray::cpu {

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

}  // namespace morphray::cpu
