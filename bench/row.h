// What is reported: one of ours against one peer.
#pragma once

#include <cstdint>
#include <string>

#include "bench/compare_answers.h"
#include "bench/interleave.h"

namespace morphray::bench {

/// How a duration is expressed. Of kMrayPerSecond more is better, of the others less.
enum class Unit { kMrayPerSecond, kNsPerTriangle, kMs };

struct Row {
    std::string scene;
    std::uint64_t triangles = 0;
    /// fill, whole or given
    std::string view;
    /// primary, shadow, ao, refit or build
    std::string work;
    int threads = 0;
    /// Traced; 0 for refits and builds.
    std::uint64_t rays = 0;
    /// Of the rays that hit something, from 0 to 1.
    double hit_share = 0;
    std::string tracer;
    std::string target;
    std::string peer;
    Unit unit = Unit::kMs;
    /// Medians, in `unit`.
    double ours = 0;
    double peer_value = 0;
    /// Above 1 we are faster, whatever the unit.
    Ratio ratio = {};
    Mismatches mismatches;
};

/// "Mray/s", "ns/triangle", "ms"
const char* name_of(Unit unit);

/// `count`: of rays or triangles that the durations are for.
void set_times(Row& row, const Samples& ours, const Samples& peer, Unit unit, std::uint64_t count);

}  // namespace morphray::bench
