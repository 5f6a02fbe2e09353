#include "app/commands/crosscheck/cross_checker.h"

#include <algorithm>
#include <cstring>
#include <iterator>
#include <limits>
#include <random>
#include <type_traits>

#include "common/bvh/box.h"
#include "common/scene/scene_space.h"

namespace mray::app {
namespace {

using glm::dvec3;

constexpr std::uint32_t kAllHits = std::numeric_limits<std::uint32_t>::max();

/// Places around a mesh. The standard library's distributions differ between libraries.
class Places {
public:
    Places(const Topology& topology, std::span<const vec3> positions)
        : triangles_(topology.triangles), positions_(positions) {
        for (const vec3& p : positions)
            if (is_finite_vertex(p)) box_.extend(p);
        if (box_.empty()) box_.extend({0, 0, 0});
    }

    /// In the box of the mesh, made larger by half on each side.
    vec3 in_room() {
        const dvec3 lower(box_.lower);
        const double x = unit();
        const double y = unit();
        const dvec3 part(x, y, unit());
        return space_.to_scene(vec3(lower + (dvec3(box_.upper) - lower) * (2.0 * part - 0.5)));
    }

    /// A vertex, a point of an edge, a point of a triangle, or a place in the room.
    vec3 any() {
        const auto kind = random_() % 4;
        if (kind == 3 || triangles_.empty()) return in_room();
        const uvec3 t = triangles_[random_() % triangles_.size()];
        const vec3 a = positions_[t.x];
        const vec3 b = positions_[t.y];
        const vec3 c = positions_[t.z];
        if (!is_finite_vertex(a) || !is_finite_vertex(b) || !is_finite_vertex(c)) return in_room();
        const double u = kind == 0 ? 0 : unit();
        const double v = kind == 2 ? unit() * (1 - u) : 0;
        const dvec3 from(a);
        return space_.to_scene(vec3(from + u * (dvec3(b) - from) + v * (dvec3(c) - from)));
    }

    Ray ray() {
        const dvec3 from(in_room());
        const dvec3 to(any());
        constexpr double kInfinity = std::numeric_limits<double>::infinity();
        return mray::to_scene(space_, {from, to - from, 0, kInfinity}).ray;
    }

private:
    /// In [0, 1).
    double unit() { return static_cast<double>(random_()) * 0x1p-32; }

    std::span<const uvec3> triangles_;
    std::span<const vec3> positions_;
    Box box_;
    /// The identity.
    SceneSpace space_{WorldBounds{}};
    std::mt19937 random_{1};
};

template <class T>
bool same_bits(const T& a, const T& b) {
    static_assert(std::is_trivially_copyable_v<T>);
    return std::memcmp(&a, &b, sizeof(T)) == 0;
}

void mark_hits(const HitLists& expected, const HitLists& actual, std::vector<bool>& differs) {
    auto e = expected.hits.begin();
    auto a = actual.hits.begin();
    for (std::size_t i = 0; i < differs.size(); ++i) {
        const auto e_end = e + expected.listed[i];
        const auto a_end = a + actual.listed[i];
        if (expected.total[i] != actual.total[i] || !std::equal(e, e_end, a, a_end, same_bits<Hit>))
            differs[i] = true;
        e = e_end;
        a = a_end;
    }
}

std::size_t count_true(const std::vector<bool>& values) {
    return static_cast<std::size_t>(std::ranges::count(values, true));
}

}  // namespace

CheckBatch pseudo_random_batch(const Topology& topology, std::span<const vec3> positions,
                               std::uint32_t count) {
    Places places(topology, positions);
    CheckBatch batch;
    for (std::uint32_t i = 0; i < count; ++i) {
        batch.rays.push_back(places.ray());
        batch.points.push_back(places.any());
    }
    return batch;
}

Answers answers_of(Backend& backend, const CheckBatch& batch) {
    Answers answers;
    backend.query(ListQuery{batch.rays, Crossing::kEach, kAllHits, answers.hits[0]});
    backend.query(ListQuery{batch.rays, Crossing::kOwner, kAllHits, answers.hits[1]});
    answers.windings.resize(batch.points.size());
    backend.query(WindingQuery{batch.points, answers.windings, answers.uncertain});
    std::ranges::sort(answers.uncertain);
    answers.closest.resize(batch.points.size());
    backend.query(ClosestQuery{batch.points, kAnyDistance2, answers.closest});
    return answers;
}

QueryDifference compare_answers(const Answers& expected, const Answers& actual) {
    std::vector<bool> hits(expected.hits[0].total.size());
    for (std::size_t i = 0; i < expected.hits.size(); ++i)
        mark_hits(expected.hits[i], actual.hits[i], hits);
    std::vector<bool> windings(expected.windings.size());
    std::vector<UncertainCrossing> only_one;
    std::ranges::set_symmetric_difference(expected.uncertain, actual.uncertain,
                                          std::back_inserter(only_one));
    for (const UncertainCrossing& crossing : only_one) windings[crossing.point] = true;
    QueryDifference difference;
    for (std::size_t i = 0; i < windings.size(); ++i) {
        if (expected.windings[i] != actual.windings[i]) windings[i] = true;
        if (!same_bits(expected.closest[i], actual.closest[i])) ++difference.closest;
    }
    difference.all_hits = count_true(hits);
    difference.winding = count_true(windings);
    return difference;
}

}  // namespace mray::app
