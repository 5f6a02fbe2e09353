// The triangles that a ray may hit, with the result of every condition of the hit rule.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "app/report/probe_report.h"
#include "common/interop/ray.h"
#include "common/scene/mesh.h"

namespace mray::app {

/// Tests all triangles (positions in scene space) by brute force. Returns the hits from the nearest
/// to the farthest, so that the first is the answer, then triangles that the fast filter keeps; at
/// most `limit` triangles, and in addition those of `wanted`.
std::vector<Candidate> find_candidates(const Ray& ray, const Topology& topology,
                                       std::span<const vec3> positions, std::size_t limit,
                                       std::span<const std::uint32_t> wanted);

}  // namespace mray::app
