#include "common/scene/mesh.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <tuple>
#include <utility>

#include "common/base/hash.h"
#include "common/interop/hit_rule.h"
#include "common/scene/camera_setup.h"

namespace mray {
namespace {

Albedo channel(float value) {
    return static_cast<Albedo>(std::lround(std::clamp(value, 0.0f, 1.0f) * 255.0f));
}

/// In units of the grid of coordinates, 2^-40.
std::int64_t on_grid(float x) { return static_cast<std::int64_t>(std::ldexp(x, 40)); }

// The number of vertices that are not finite.
constexpr std::uint32_t kNowhere = 0xFFFFFFFFu;

std::tuple<float, float, float> place_of(vec3 p) { return {p.x, p.y, p.z}; }

/// A number for each vertex, which those at one place have in common.
std::vector<std::uint32_t> number_places(std::span<const vec3> positions) {
    std::vector<std::uint32_t> numbers(positions.size(), kNowhere);
    std::vector<std::uint32_t> sorted(positions.size());
    std::iota(sorted.begin(), sorted.end(), 0u);
    std::erase_if(sorted, [&](std::uint32_t i) { return positions[i].x > kSceneExtent; });
    std::ranges::sort(sorted, {}, [&](std::uint32_t i) { return place_of(positions[i]); });
    std::uint32_t number = 0;
    for (std::size_t i = 0; i < sorted.size(); ++i) {
        if (i > 0 && place_of(positions[sorted[i]]) != place_of(positions[sorted[i - 1]])) ++number;
        numbers[sorted[i]] = number;
    }
    return numbers;
}

struct DirectedEdge {
    std::uint32_t lower, upper;
    bool is_upward;
};

/// The three edges of each triangle, one triangle after the other.
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

std::uint64_t count_twins(std::span<const DirectedEdge> edges) {
    // The lowest place comes first.
    std::vector<std::array<std::uint32_t, 3>> triangles(edges.size() / 3);
    for (std::size_t i = 0; i < edges.size(); ++i)
        triangles[i / 3][i % 3] = edges[i].is_upward ? edges[i].lower : edges[i].upper;
    for (auto& t : triangles) std::rotate(t.begin(), std::ranges::min_element(t), t.end());
    std::ranges::sort(triangles);
    return static_cast<std::uint64_t>(std::ranges::count_if(triangles, [&](const auto& t) {
        return std::ranges::binary_search(triangles, std::array{t[0], t[2], t[1]});
    }));
}

}  // namespace

Albedo albedo_of(float r, float g, float b) {
    return channel(r) | channel(g) << 8 | channel(b) << 16;
}

std::uint64_t topology_hash(const Topology& topology) {
    const std::uint32_t count[] = {topology.vertex_count};
    return Hasher().add(count).add(topology.triangles).digest();
}

std::vector<IndexRange> used_vertices(std::span<const uvec3> triangles, std::size_t vertex_count) {
    std::vector<std::uint8_t> is_used(vertex_count, 0);
    for (const uvec3& t : triangles) is_used[t.x] = is_used[t.y] = is_used[t.z] = 1;
    std::vector<IndexRange> ranges;
    for (auto end = is_used.begin(); end != is_used.end();) {
        const auto begin = std::find(end, is_used.end(), 1);
        end = std::find(begin, is_used.end(), 0);
        if (begin == end) break;
        ranges.push_back({static_cast<std::uint32_t>(begin - is_used.begin()),
                          static_cast<std::uint32_t>(end - is_used.begin())});
    }
    return ranges;
}

std::uint64_t count_not_finite(const Topology& topology, std::span<const vec3> positions) {
    const auto count = std::ranges::count_if(topology.triangles, [&](const uvec3& t) {
        return !all_finite(positions[t.x]) || !all_finite(positions[t.y]) ||
               !all_finite(positions[t.z]);
    });
    return static_cast<std::uint64_t>(count);
}

DegenerateCount count_degenerate(const Topology& topology, std::span<const vec3> positions) {
    DegenerateCount count;
    for (const uvec3& t : topology.triangles) {
        const vec3 a = positions[t.x];
        const vec3 b = positions[t.y];
        const vec3 c = positions[t.z];
        if (!finite_vertices(a, b, c))
            ++count.left_out;
        else if (!has_area(a, b, c))
            ++count.zero_area;
    }
    return count;
}

bool has_area(vec3 a, vec3 b, vec3 c) {
    if (!finite_vertices(a, b, c)) return false;
    __extension__ typedef __int128 Wide;
    const auto edge = [&](vec3 to, int axis) { return Wide{on_grid(to[axis]) - on_grid(a[axis])}; };
    const auto is_turned = [&](int i, int j) {
        return edge(b, i) * edge(c, j) != edge(b, j) * edge(c, i);
    };
    return is_turned(0, 1) || is_turned(1, 2) || is_turned(2, 0);
}

EdgeCounts count_edges(const Topology& topology, std::span<const vec3> positions) {
    std::vector<DirectedEdge> edges = edges_of(topology, positions);
    EdgeCounts counts{.twins = count_twins(edges)};
    const auto ends_of = [](const DirectedEdge& e) { return std::pair(e.lower, e.upper); };
    std::ranges::sort(edges, {}, ends_of);
    for (auto first = edges.begin(); first != edges.end();) {
        const auto last = std::find_if(
            first, edges.end(), [&](const auto& e) { return ends_of(e) != ends_of(*first); });
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
    const std::string twins =
        fmt::format("; {} triangles have a twin in the opposite direction", counts.twins);
    return fmt::format("{}{} open, {} of more than two triangles, {} turned{}",
                       counts.uneven == 0 ? "closed: " : "", counts.open, counts.shared,
                       counts.turned, counts.twins != 0 ? twins : "");
}

}  // namespace mray
