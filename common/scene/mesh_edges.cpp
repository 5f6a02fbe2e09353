#include "common/scene/mesh_edges.h"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>
#include <tuple>
#include <vector>

#include "common/interop/hit_rule.h"

namespace mray {
namespace {

// The number of vertices that are not finite.
constexpr std::uint32_t kNowhere = 0xFFFFFFFFu;

std::tuple<float, float, float> place_of(vec3 p) { return {p.x, p.y, p.z}; }

/// A number for each vertex, which those at one place have in common.
std::vector<std::uint32_t> number_places(std::span<const vec3> positions) {
    std::vector<std::uint32_t> numbers(positions.size(), kNowhere);
    std::vector<std::uint32_t> sorted(positions.size());
    std::iota(sorted.begin(), sorted.end(), 0u);
    std::erase_if(sorted, [&](std::uint32_t i) { return positions[i].x > kSceneExtent; });
    std::sort(sorted.begin(), sorted.end(), [&](std::uint32_t a, std::uint32_t b) {
        return place_of(positions[a]) < place_of(positions[b]);
    });
    std::uint32_t number = 0;
    for (std::size_t i = 0; i < sorted.size(); ++i) {
        if (i > 0 && place_of(positions[sorted[i]]) != place_of(positions[sorted[i - 1]])) ++number;
        numbers[sorted[i]] = number;
    }
    return numbers;
}

/// An edge of a triangle, from one corner to the next.
struct DirectedEdge {
    std::uint32_t lower;
    std::uint32_t upper;
    bool is_upward;

    bool is_same_edge(const DirectedEdge& other) const {
        return lower == other.lower && upper == other.upper;
    }
};

std::vector<DirectedEdge> edges_of(const Topology& topology, std::span<const vec3> positions) {
    const std::vector<std::uint32_t> places = number_places(positions);
    std::vector<DirectedEdge> edges;
    edges.reserve(3 * topology.triangles.size());
    for (const uvec3& triangle : topology.triangles) {
        const std::uint32_t p[3] = {places[triangle.x], places[triangle.y], places[triangle.z]};
        if (std::max({p[0], p[1], p[2]}) == kNowhere) continue;
        if (p[0] == p[1] || p[1] == p[2] || p[2] == p[0]) continue;
        for (int i = 0; i < 3; ++i) {
            const std::uint32_t from = p[i];
            const std::uint32_t to = p[(i + 1) % 3];
            edges.push_back({std::min(from, to), std::max(from, to), from < to});
        }
    }
    return edges;
}

}  // namespace

EdgeCounts count_edges(const Topology& topology, std::span<const vec3> positions) {
    std::vector<DirectedEdge> edges = edges_of(topology, positions);
    std::sort(edges.begin(), edges.end(), [](const DirectedEdge& a, const DirectedEdge& b) {
        return std::tie(a.lower, a.upper) < std::tie(b.lower, b.upper);
    });
    EdgeCounts counts;
    for (auto first = edges.begin(); first != edges.end();) {
        const auto last = std::find_if(
            first, edges.end(), [&](const DirectedEdge& e) { return !e.is_same_edge(*first); });
        const auto triangles = last - first;
        const auto upward = std::count_if(first, last, [](const auto& e) { return e.is_upward; });
        const bool is_uneven = 2 * upward != triangles;
        counts.open += triangles == 1;
        counts.shared += triangles > 2;
        counts.turned += triangles == 2 && is_uneven;
        counts.uneven += is_uneven;
        first = last;
    }
    return counts;
}

std::string describe(const EdgeCounts& counts) {
    return fmt::format("{}{} open, {} of more than two triangles, {} turned",
                       counts.uneven == 0 ? "closed: " : "", counts.open, counts.shared,
                       counts.turned);
}

}  // namespace mray
