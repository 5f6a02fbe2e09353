#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <optional>

#include <glm/geometric.hpp>

#include "common/interop/closest_rule.h"
#include "common/interop/transform.h"
#include "common/scene/exact_crossing.h"
#include "morphray/morphray.hpp"
#include "tests/fuzz/judge.h"

namespace mray::fuzz {
namespace {

using morphray::ClosestPoint;
using morphray::Device;
using morphray::FillRule;
using morphray::Scene;
using morphray::Vec3;

// Crossings by exact integers that a case may take: some milliseconds.
constexpr std::size_t kMostExact = 3000;

/// A turn, a mirror and a shear with a shift.
constexpr Transform kTransform{
    {0.6f, -0.8f, 0, 0.1f}, {0.7f, 0.6f, -0.1f, 0}, {0, 0.3f, -1.1f, -0.03f}};

morphray::Transform to_public(const Transform& transform) {
    const auto row = [](const vec4& r) { return std::array<double, 4>{r.x, r.y, r.z, r.w}; };
    return {{row(transform.x), row(transform.y), row(transform.z)}};
}

bool is_finite(const Vec3& p) {
    return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z);
}
vec3 to_vec(const Vec3& p) { return {p.x, p.y, p.z}; }

std::vector<Vec3> to_world(std::span<const vec3> points) {
    std::vector<Vec3> world;
    for (const vec3& p : points) world.push_back({p.x, p.y, p.z});
    return world;
}

/// The crossings of a half-line from a point, and whether it lies on a triangle.
struct ExactWinding {
    std::int32_t winding = 0;
    std::uint32_t crossings = 0;
    bool is_on_surface = false;

    ExactWinding(const Vec3& p, std::span<const uvec3> triangles, std::span<const Vec3> vertices) {
        for (const uvec3& t : triangles) {
            const Vec3& a = vertices[t.x];
            const Vec3& b = vertices[t.y];
            const Vec3& c = vertices[t.z];
            if (!is_finite(a) || !is_finite(b) || !is_finite(c)) continue;
            const ExactCrossing crossing =
                exact_crossing(to_vec(p), to_vec(a), to_vec(b), to_vec(c));
            winding += crossing.sign;
            crossings += crossing.sign != 0;
            is_on_surface |= crossing.is_on_triangle;
        }
    }
    bool is_inside(FillRule rule) const {
        return is_on_surface || (rule == FillRule::nonzero ? winding != 0 : crossings % 2 == 1);
    }
};

/// The answers about a point.
struct PointAnswer {
    std::int32_t winding = 0;
    bool is_nonzero = false;
    bool is_odd = false;
    float distance = 0;
    ClosestPoint closest;

    bool operator==(const PointAnswer& other) const {
        return winding == other.winding && is_nonzero == other.is_nonzero &&
               is_odd == other.is_odd && closest == other.closest &&
               std::bit_cast<std::uint32_t>(distance) ==
                   std::bit_cast<std::uint32_t>(other.distance);
    }
};

std::vector<PointAnswer> point_answers(const Scene& scene, std::span<const Vec3> points,
                                       const morphray::QueryOptions& options = {}) {
    constexpr float kFar = std::numeric_limits<float>::infinity();
    std::vector<std::int32_t> windings(points.size());
    std::vector<std::uint8_t> nonzero(points.size());
    std::vector<std::uint8_t> odd(points.size());
    std::vector<float> distances(points.size());
    std::vector<ClosestPoint> closest(points.size());
    scene.winding(points, windings, options);
    scene.contains(points, nonzero, FillRule::nonzero, options);
    scene.contains(points, odd, FillRule::odd, options);
    scene.signed_distance(points, distances, FillRule::nonzero, kFar, options);
    scene.closest_points(points, closest, kFar, options);
    std::vector<PointAnswer> answers;
    for (std::size_t i = 0; i < points.size(); ++i)
        answers.push_back({windings[i], nonzero[i] != 0, odd[i] != 0, distances[i], closest[i]});
    return answers;
}

/// Whether an answer may be right. `slack` is what Scene::signed_distance() promises.
bool is_sound(const PointAnswer& answer, const Vec3& point,
              const std::optional<ExactWinding>& exact, double slack) {
    if (!is_finite(point)) {
        return answer.winding == 0 && !answer.is_nonzero && !answer.is_odd &&
               std::isnan(answer.distance) && !answer.closest;
    }
    if (exact) {
        if (answer.winding != exact->winding || answer.is_odd != exact->is_inside(FillRule::odd) ||
            answer.is_nonzero != exact->is_inside(FillRule::nonzero))
            return false;
        if (exact->is_on_surface) return answer.distance == 0;
    }
    if (answer.is_nonzero != std::signbit(answer.distance) && answer.distance != 0) return false;
    const bool is_zero_on_surface = !exact && answer.distance == 0;
    const double distance = std::abs(answer.distance);
    return distance == answer.closest.distance || is_zero_on_surface ||
           std::abs(distance - answer.closest.distance) <= slack;
}

class WorldCheck {
public:
    explicit WorldCheck(const FuzzCase& fuzz_case)
        : fuzz_case_(fuzz_case), points_(to_world(fuzz_case.points)) {
        const std::vector<vec3> built =
            world_positions(fuzz_case, static_cast<double>(fuzz_case.build_at));
        built_ = to_world(built);
        std::vector<vec3> positions = world_positions(fuzz_case, fuzz_case.frame);
        rest_ = to_world(positions);
        has_matrix_ = (fuzz_case.triangles.size() + fuzz_case.points.size()) % 2 == 0;
        if (has_matrix_) {
            for (vec3& p : positions) p = transform_point(kTransform, p);
        }
        const std::vector<IndexRange> used =
            used_vertices(fuzz_case.triangles, fuzz_case.poses.front().size());
        const PoseExtent pose(positions, used);
        PoseExtent both(built, used);
        both.extend(pose);
        bounds_ = both.bounds(both.limit());
        space_ = space_of_pose(bounds_, pose);
        for (vec3& p : positions)
            if (!space_.keeps(p)) p = vec3(std::numeric_limits<float>::quiet_NaN());
        vertices_ = to_world(positions);
        for (const uvec3& t : fuzz_case.triangles) indices_.insert(indices_.end(), {t.x, t.y, t.z});
    }

    const std::vector<AnswerDifference>& run() {
        // Its positions move.
        std::vector<Vec3> positions = built_;
        morphray::SceneOptions options;
        if (!bounds_.empty()) {
            const auto point = [](const glm::dvec3& p) { return morphray::Point{p.x, p.y, p.z}; };
            options.bounds = morphray::Box{point(bounds_.lower), point(bounds_.upper)};
        }
        constexpr std::array kPolicies = {"refit", "rebuild", "auto"};
        options.update = morphray::parse_update_policy(
            kPolicies[(fuzz_case_.triangles.size() + fuzz_case_.rays.size()) % kPolicies.size()]);
        Scene scene = Scene::build(morphray::MeshView{morphray::packed(positions), indices_},
                                   Device::cpu({.threads = 1}), options);
        // An exploding solver, which comes back.
        for (std::size_t i = 0; i < positions.size(); i += 3) positions[i].y = 1e37f;
        scene.update();
        positions = rest_;
        if (has_matrix_) {
            scene.update(0, to_public(kTransform));
        } else {
            scene.update();
        }
        const Scene brute = Scene::build(morphray::MeshView{morphray::packed(vertices_), indices_},
                                         Device::brute_force({.threads = 1}), options);
        check_points(scene, brute);
        check_rays(scene, brute);
        return differences_.all;
    }

private:
    /// Whether a point is so near that the interface answers for it.
    bool is_near(const Vec3& p) const {
        return is_finite(p) && largest_component(space_.to_scene(to_vec(p))) < kOriginExtent;
    }

    void check_points(const Scene& scene, const Scene& brute) {
        const std::vector<PointAnswer> answers = point_answers(scene, points_);
        const std::vector<PointAnswer> expected = point_answers(brute, points_);
        const std::size_t exact_points =
            kMostExact / std::max<std::size_t>(1, fuzz_case_.triangles.size());
        for (std::size_t i = 0; i < points_.size(); ++i) {
            std::optional<ExactWinding> exact;
            if (i < exact_points && is_near(points_[i]))
                exact.emplace(points_[i], fuzz_case_.triangles, vertices_);
            if (!is_sound(answers[i], points_[i], exact,
                          slack_of(answers[i].closest, points_[i]))) {
                differences_.add(Asked::kWindings, i);
            } else if (!(answers[i] == expected[i])) {
                differences_.add(Asked::kClosestPoints, i);
            }
        }
        check_reaches(scene, answers);
        // Without the closest triangle of each.
        std::vector<morphray::Primitive> excluded;
        for (const PointAnswer& answer : answers)
            excluded.push_back({answer.closest.prim_id, answer.closest.geom_id});
        const std::vector<PointAnswer> rest = point_answers(scene, points_, {.excluded = excluded});
        const std::vector<PointAnswer> expected_rest =
            point_answers(brute, points_, {.excluded = excluded});
        for (std::size_t i = 0; i < points_.size(); ++i)
            if (!(rest[i] == expected_rest[i])) differences_.add(Asked::kClosestPoints, i);
    }

    double farthest_corner(const uvec3& t, const Vec3& point) const {
        double farthest = 0;
        for (const std::uint32_t vertex : {t.x, t.y, t.z}) {
            const glm::dvec3 way =
                glm::dvec3(to_vec(vertices_[vertex])) - glm::dvec3(to_vec(point));
            farthest = std::max(farthest, glm::length(way));
        }
        return farthest;
    }

    /// 2^-21 of the distance of the farthest corner of the closest triangle and of those that the
    /// rule finds, and a step of denormals.
    double slack_of(const ClosestPoint& closest, const Vec3& point) const {
        if (!closest) return 0;
        const vec3 p = space_.to_scene(to_vec(point));
        const auto corner = [&](std::uint32_t i) { return space_.to_scene(to_vec(vertices_[i])); };
        float least = std::numeric_limits<float>::infinity();
        double farthest = 0;
        for (const uvec3& t : fuzz_case_.triangles) {
            if (!is_finite(vertices_[t.x]) || !is_finite(vertices_[t.y]) ||
                !is_finite(vertices_[t.z]))
                continue;
            const float d2 = triangle_distance2(p, corner(t.x), corner(t.y), corner(t.z));
            if (d2 > least) continue;
            farthest = std::max(d2 < least ? 0 : farthest, farthest_corner(t, point));
            least = d2;
        }
        farthest =
            std::max(farthest, farthest_corner(fuzz_case_.triangles[closest.prim_id], point));
        return 0x1p-21 * farthest + std::numeric_limits<float>::denorm_min();
    }

    /// Asks within the distance of one point, and just less.
    void check_reaches(const Scene& scene, std::span<const PointAnswer> answers) {
        if (answers.empty()) return;
        const float one = answers[answers.size() / 2].closest.distance;
        for (const float reach : {one, std::nextafter(one, 0.0f), 0.0f}) {
            std::vector<ClosestPoint> found(points_.size());
            scene.closest_points(points_, found, reach);
            for (std::size_t i = 0; i < points_.size(); ++i) {
                const ClosestPoint& all = answers[i].closest;
                const ClosestPoint expected = all.distance <= reach ? all : ClosestPoint{};
                if (!(found[i] == expected)) differences_.add(Asked::kClosestPoints, i);
            }
        }
    }

    void check_rays(const Scene& scene, const Scene& brute) {
        std::vector<morphray::Ray> rays;
        for (const WorldRay& r : fuzz_case_.rays) {
            const auto f = [](double x) { return static_cast<float>(x); };
            rays.push_back({{f(r.org[0]), f(r.org[1]), f(r.org[2])},
                            f(r.tnear),
                            {f(r.dir[0]), f(r.dir[1]), f(r.dir[2])},
                            f(r.tfar)});
        }
        std::vector<std::uint64_t> counts(rays.size());
        for (const auto crossing :
             {morphray::Crossing::once, morphray::Crossing::each, morphray::Crossing::owner}) {
            const morphray::AllHits all = scene.intersect_all(rays, {.crossing = crossing});
            const morphray::AllHits expected = brute.intersect_all(rays, {.crossing = crossing});
            const morphray::AllHits one =
                scene.intersect_all(rays, {.crossing = crossing, .max_hits = 1});
            scene.count(rays, counts, crossing);
            for (std::size_t i = 0; i < rays.size(); ++i) {
                const auto hits = all.of_ray(i);
                if (!std::ranges::equal(hits, expected.of_ray(i)))
                    differences_.add(Asked::kAllHits, i);
                if (counts[i] != hits.size()) differences_.add(Asked::kHitCounts, i);
                const std::size_t listed = one.of_ray(i).size();
                if (listed != std::min<std::size_t>(1, hits.size()) ||
                    listed + one.left_out[i] != hits.size() ||
                    (listed == 1 && !(one.of_ray(i)[0] == hits[0])))
                    differences_.add(Asked::kAllHits, i);
                check_steps(scene, rays[i], i, crossing, hits);
            }
        }
    }

    /// From hit to hit.
    void check_steps(const Scene& scene, const morphray::Ray& ray, std::size_t i,
                     morphray::Crossing crossing, std::span<const morphray::Hit> hits) {
        if (hits.empty()) return;
        if (crossing != morphray::Crossing::owner && !(scene.intersect(ray) == hits[0]))
            differences_.add(Asked::kClosestHits, i);
        constexpr std::size_t kSteps = 8;
        for (std::size_t k = 0; k < std::min(kSteps, hits.size()); ++k) {
            const morphray::Hit next = scene.intersect(ray, hits[k], crossing);
            const bool is_last = k + 1 == hits.size();
            if (is_last ? bool{next} : !(next == hits[k + 1]))
                differences_.add(Asked::kNextHits, i);
        }
    }

    const FuzzCase& fuzz_case_;
    std::vector<Vec3> points_;
    std::vector<Vec3> built_;
    /// The pose, to which a matrix moves these positions in some cases.
    std::vector<Vec3> rest_;
    bool has_matrix_ = false;
    /// The pose with NaN for vertices that are left out.
    std::vector<Vec3> vertices_;
    std::vector<std::uint32_t> indices_;
    /// Those of both poses, and the space of the pose.
    WorldBounds bounds_;
    SceneSpace space_{WorldBounds{}};
    AnswerDifferences differences_;
};

}  // namespace

std::vector<AnswerDifference> check_world(const FuzzCase& fuzz_case) {
    return WorldCheck(fuzz_case).run();
}

}  // namespace mray::fuzz
