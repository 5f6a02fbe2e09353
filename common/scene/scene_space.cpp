#include "common/scene/scene_space.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include <glm/common.hpp>

#include "common/base/errors.h"
#include "common/interop/arithmetic.h"
#include "common/scene/camera_setup.h"

namespace mray {
namespace {

double largest_of(const dvec3& v) {
    return std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)});
}

constexpr int kExtentExponent = 20;
static_assert(kSceneExtent == 1 << kExtentExponent);

// Sterbenz: x - c is exact for floats with c/2 <= x <= 2c. The midpoint c of [lower, upper] has
// that for both ends if upper <= 3 * lower (or mirrored); rounding c to float needs a little room.
double exact_centre(double lower, double upper) {
    const double nearer = std::min(std::abs(lower), std::abs(upper));
    const double farther = std::max(std::abs(lower), std::abs(upper));
    if (lower * upper <= 0 || farther > 2.9 * nearer) return 0;
    return static_cast<float>((lower + upper) / 2);
}

/// Rounds once to a float on the grid. Values below it must not become denormals on the way.
float to_grid(double scaled) {
    return std::abs(scaled) < 0x1p-60 ? 0.0f : snap_coordinate(static_cast<float>(scaled));
}

/// Whether a corner of bounds of floats is in the range of scene space.
bool holds(const SceneSpace& space, const dvec3& corner) {
    return largest_of(space.to_scene(vec3(corner))) <= kSceneExtent;
}

/// The error of a - b as it is rounded (D. E. Knuth's two-sum).
double difference_error(double a, double b) {
    const double rounded = a - b;
    const double of_b = rounded - a;
    return (a - (rounded - of_b)) - (b + of_b);
}

/// Moves `org`, which has the rounding error `error`, along `dir` to where the ray is close to
/// scene space, and adds t there to `t`. Returns false for a ray that leads past. The new origin is
/// off by roundings of its own coordinates, not of those far away: a step is rounded once.
bool approach(dvec3& org, dvec3 error, const dvec3& dir, double& t) {
    double size = largest_of(org);
    while (size > kFarOrigin) {
        const double middle = -(org.x * dir.x + org.y * dir.y + org.z * dir.z) /
                              (dir.x * dir.x + dir.y * dir.y + dir.z * dir.z);
        // Before the scene, however the middle is rounded.
        const double step = middle - (4 * kSceneExtent + 0x1p-48 * size);
        if (!(step > 0 && std::isfinite(step))) return false;
        for (int axis = 0; axis < 3; ++axis)
            org[axis] = std::fma(dir[axis], step, org[axis]) + error[axis];
        error = dvec3(0, 0, 0);
        t += step;
        // |dir| < sqrt(12), and the scene is within sqrt(3) extents of its centre.
        const double left = largest_of(org);
        if (!(left <= 16 * kSceneExtent + 0x1p-40 * size)) return false;
        size = left;
    }
    return true;
}

/// A little less than how far a number is from those that round to another float.
double rounding_of(double t) {
    const auto rounded = static_cast<float>(std::min(t, 0x1p+127));
    const float next = std::nextafter(rounded, std::numeric_limits<float>::infinity());
    return (double{next} - double{rounded}) * (31.0 / 64);
}

/// The i of the least power of two, 2^(i - 127), that is not below `size`; 0 for 0.
std::size_t bin_of(float size) { return (std::bit_cast<std::uint32_t>(size) + 0x007FFFFF) >> 23; }

constexpr double kCoarse = 1e-6;
// Of coordinates that are used; those beyond it may overflow in differences of floats.
constexpr double kMostUsed = 1e30;

/// False for NaN, too.
bool is_used(const dvec3& p) {
    return std::abs(p.x) <= kMostUsed && std::abs(p.y) <= kMostUsed && std::abs(p.z) <= kMostUsed;
}

/// Visits the points that are used and not as far away as PoseExtent::limit() says.
template <class Visit>
void for_each_near(std::span<const dvec3> points, Visit visit) {
    std::vector<double> sizes;
    for (const dvec3& p : points)
        if (is_used(p) && largest_of(p) > 0) sizes.push_back(largest_of(p));
    double limit = 0;
    if (!sizes.empty()) {
        const auto middle = sizes.begin() + static_cast<std::ptrdiff_t>(sizes.size() / 2);
        std::nth_element(sizes.begin(), middle, sizes.end());
        limit = std::ldexp(1.0, std::ilogb(*middle) + 1 + kFarExponent);
    }
    for (const dvec3& p : points)
        if (is_used(p) && largest_of(p) <= limit) visit(p);
}

WorldBounds extent_of(std::span<const dvec3> points) {
    WorldBounds extent;
    for_each_near(points, [&](const dvec3& p) { extent.extend({p, p}); });
    return extent;
}

/// The longest side; 0 of empty bounds.
double size_of(const WorldBounds& extent) {
    const dvec3 size = extent.upper - extent.lower;
    return std::max({size.x, size.y, size.z, 0.0});
}

/// The largest coordinate.
double reach_of(const WorldBounds& bounds) {
    return std::max(largest_of(bounds.lower), largest_of(bounds.upper));
}

float to_float(double x) {
    constexpr double kMost = std::numeric_limits<float>::max();
    constexpr float kInfinity = std::numeric_limits<float>::infinity();
    // The cast of a double beyond floats is undefined.
    if (x > kMost) return kInfinity;
    return x < -kMost ? -kInfinity : static_cast<float>(x);
}

}  // namespace

void WorldBounds::extend(const WorldBounds& other) {
    if (other.empty()) return;
    const bool was_empty = empty();
    lower = was_empty ? other.lower : glm::min(lower, other.lower);
    upper = was_empty ? other.upper : glm::max(upper, other.upper);
}

WorldBounds bounds_of(std::span<const vec3> points) {
    WorldBounds bounds;
    for (const vec3 p : points)
        if (all_finite(p)) bounds.extend({p, p});
    return bounds;
}

SceneSpace::SceneSpace(const WorldBounds& bounds, float limit) : limit_(limit) {
    if (bounds.empty()) return;
    double extent = 0;
    for (int axis = 0; axis < 3; ++axis) {
        centre_[axis] = exact_centre(bounds.lower[axis], bounds.upper[axis]);
        extent = std::max({extent, std::abs(bounds.lower[axis] - centre_[axis]),
                           std::abs(bounds.upper[axis] - centre_[axis])});
    }
    // All points coincide: their own size gives the scale.
    if (extent == 0) extent = largest_of(centre_);
    if (extent == 0) return;
    int exponent = 0;
    const double mantissa = std::frexp(extent, &exponent);  // extent = mantissa * 2^exponent
    if (mantissa == 0.5) --exponent;                        // exactly 2^20 is inside
    exponent_ = kExtentExponent - exponent;
    scale_ = std::ldexp(1.0, exponent_);
}

bool SceneSpace::keeps(vec3 world) const {
    return std::abs(world.x) <= limit_ && std::abs(world.y) <= limit_ &&
           std::abs(world.z) <= limit_;
}

vec3 SceneSpace::to_scene(vec3 world) const {
    if (!keeps(world)) return {kInvalidCoordinate, kInvalidCoordinate, kInvalidCoordinate};
    vec3 scene;
    for (int axis = 0; axis < 3; ++axis) {
        // Exact: floats and the scale of their extent are within 2^+-170.
        scene[axis] = to_grid((static_cast<double>(world[axis]) - centre_[axis]) * scale_);
    }
    return scene;
}

void SceneSpace::to_scene(std::span<const vec3> world, std::span<vec3> scene) const {
    for (std::size_t i = 0; i < world.size(); ++i) scene[i] = to_scene(world[i]);
}

vec3 SceneSpace::to_world(vec3 scene) const {
    vec3 world;
    for (int axis = 0; axis < 3; ++axis) {
        // Exact, as is the product in to_scene().
        world[axis] = static_cast<float>(static_cast<double>(scene[axis]) / scale_ + centre_[axis]);
    }
    return world;
}

vec3 SceneSpace::point_to_scene(const dvec3& world, const char* what) const {
    vec3 scene;
    for (int axis = 0; axis < 3; ++axis) {
        const double scaled = length_to_scene(world[axis] - centre_[axis]);
        if (!(std::abs(scaled) <= kOriginExtent)) {
            throw Error(ErrorKind::kBadInput, std::string(what) +
                                                  " is not finite or is more than a million scene "
                                                  "sizes away; move it closer");
        }
        scene[axis] = to_grid(scaled);
    }
    return scene;
}

PoseExtent::PoseExtent(std::span<const vec3> world, std::span<const IndexRange> used) {
    for (const IndexRange& range : used) add(world.subspan(range.begin, range.end - range.begin));
}

void PoseExtent::add(std::span<const vec3> world) {
    for (const vec3& p : world) {
        // glm::abs() leaves -0, whose bits are no size.
        const vec3 size(std::abs(p.x), std::abs(p.y), std::abs(p.z));
        const float largest = std::max(std::max(size.x, size.y), size.z);
        // The sum decides faster, but may overflow.
        if (!std::isfinite(size.x + size.y + size.z) && !all_finite(p)) continue;
        Bin& bin = bins_[bin_of(largest)];
        ++bin.count;
        bin.lower = glm::min(bin.lower, p);
        bin.upper = glm::max(bin.upper, p);
    }
}

void PoseExtent::extend(const PoseExtent& other) {
    for (std::size_t i = 0; i < bins_.size(); ++i) {
        bins_[i].count += other.bins_[i].count;
        bins_[i].lower = glm::min(bins_[i].lower, other.bins_[i].lower);
        bins_[i].upper = glm::max(bins_[i].upper, other.bins_[i].upper);
    }
}

float PoseExtent::limit(const WorldBounds& reference) const {
    constexpr float kMost = std::numeric_limits<float>::max();
    // Without bin 0: vertices at 0 say nothing about the size.
    std::array<std::uint64_t, 256> up_to = {};
    for (std::size_t i = 1; i < up_to.size(); ++i) up_to[i] = up_to[i - 1] + bins_[i].count;
    const auto bin_at = [&](auto place) { return static_cast<std::size_t>(place - up_to.begin()); };
    const std::size_t last = bin_at(std::ranges::lower_bound(up_to, up_to.back()));
    const std::size_t bulk =
        std::min(last, bin_at(std::ranges::upper_bound(up_to, up_to.back() / 2)));
    std::size_t kept = bulk + kFarExponent;
    if (!reference.empty()) {
        const SceneSpace space(reference);
        const double reach = largest_of({space.centre(0), space.centre(1), space.centre(2)}) +
                             space.length_to_world(kSceneExtent);
        const std::size_t held = bin_of(static_cast<float>(std::min(reach, double{kMost})));
        if (bulk > held + kLostExponent && up_to[held] > 0) kept = held + kFarExponent;
        kept = std::max(kept, held);
    }
    if (last <= kept) return kMost;
    return static_cast<float>(std::ldexp(1.0, static_cast<int>(kept) - 127));
}

WorldBounds PoseExtent::bounds(float limit) const {
    WorldBounds bounds;
    for (std::size_t i = 0; i <= bin_of(limit); ++i)
        if (bins_[i].count > 0) bounds.extend({bins_[i].lower, bins_[i].upper});
    return bounds;
}

std::uint64_t PoseExtent::count_beyond(float limit) const {
    std::uint64_t count = 0;
    for (std::size_t i = bin_of(limit) + 1; i < bins_.size(); ++i) count += bins_[i].count;
    return count;
}

WorldBounds bounds_of_parts(const PoseExtent& all, std::vector<WorldBounds> parts) {
    std::erase_if(parts, [](const WorldBounds& b) { return b.empty() || reach_of(b) == 0; });
    float limit = all.limit();
    if (parts.size() > 1) {
        const auto middle = parts.begin() + static_cast<std::ptrdiff_t>((parts.size() - 1) / 2);
        std::ranges::nth_element(parts, middle, {}, reach_of);
        limit = std::min(limit, all.limit(*middle));
    }
    return all.bounds(limit);
}

SceneSpace space_of_pose(const WorldBounds& reference, const PoseExtent& pose) {
    if (reference.empty()) {
        const float limit = pose.limit();
        return SceneSpace(pose.bounds(limit), limit);
    }
    const float limit = pose.limit(reference);
    const SceneSpace space(reference, limit);
    const WorldBounds bounds = pose.bounds(limit);
    if (bounds.empty() || (holds(space, bounds.lower) && holds(space, bounds.upper))) return space;
    WorldBounds both = reference;
    both.extend(bounds);
    return SceneSpace(both, limit);
}

SceneRay to_scene(const SceneSpace& space, const WorldRay& world) {
    SceneRay result;
    if (!all_finite(world.org) || !all_finite(world.dir)) return result;
    const double largest = largest_of(world.dir);
    if (largest == 0 || !(world.tnear <= world.tfar) || !(world.tfar >= 0)) return result;
    int dir_exponent = std::ilogb(largest);
    // A value that rounds up to 2 takes the next exponent.
    if (static_cast<float>(std::ldexp(largest, -dir_exponent)) == 2.0f) ++dir_exponent;
    dvec3 org, error, dir;
    for (int axis = 0; axis < 3; ++axis) {
        org[axis] = space.length_to_scene(world.org[axis] - space.centre(axis));
        error[axis] = space.length_to_scene(difference_error(world.org[axis], space.centre(axis)));
        dir[axis] = std::ldexp(world.dir[axis], -dir_exponent);
        result.ray.dir[axis] = snap_direction_component(
            std::abs(dir[axis]) < 0x1p-60 ? 0.0f : static_cast<float>(dir[axis]));
    }
    double start = 0;
    if (!approach(org, error, dir, start)) return result;
    for (int axis = 0; axis < 3; ++axis) result.ray.org[axis] = to_grid(org[axis]);
    // org + t * dir in both spaces: t_scene * 2^-dir_exponent... = t_world * 2^exponent *
    // 2^dir_exponent.
    result.t_exponent = -(space.exponent() + dir_exponent);
    result.t_start = std::ldexp(start, result.t_exponent);
    // From far away t is rounded to fewer digits, and that one is in the interval.
    const auto rounding = [&](double t) { return start != 0 ? rounding_of(t) : 0; };
    const double near = std::max(world.tnear, 0.0);
    const double tnear = std::ldexp(near - rounding(near), -result.t_exponent) - start;
    const double tfar = std::ldexp(world.tfar + rounding(world.tfar), -result.t_exponent) - start;
    const auto in_floats = [](double t) {
        return static_cast<float>(std::clamp(t, 0.0, static_cast<double>(kInfiniteT)));
    };
    result.ray.tnear = in_floats(tnear);
    result.ray.tfar = in_floats(tfar);
    if (result.ray.tnear < 0x1p-100f) result.ray.tnear = 0;
    if (result.ray.tfar < 0x1p-100f) return result;
    result.valid = true;
    return result;
}

vec3 Origin::to_world(const dvec3& given) const {
    return {to_float(given.x - at.x), to_float(given.y - at.y), to_float(given.z - at.z)};
}

std::vector<vec3> Origin::to_world(std::span<const dvec3> given) const {
    std::vector<vec3> world(given.size());
    std::ranges::transform(given, world.begin(), [&](const auto& p) { return to_world(p); });
    return world;
}

double Origin::rounding_of(std::span<const dvec3> given) const {
    double most = 0;
    for_each_near(given, [&](const dvec3& p) {
        const dvec3 moved = glm::abs(dvec3(to_world(p)) - (p - at));
        most = std::max({most, moved.x, moved.y, moved.z});
    });
    return most;
}

bool Origin::rounds_coarsely(std::span<const dvec3> given) const {
    const WorldBounds extent = extent_of(given);
    const double most = kCoarse * size_of(extent);
    const dvec3 far = glm::max(glm::abs(extent.lower - at), glm::abs(extent.upper - at));
    // Half a step of the floats of that size, at least half of the least float.
    if (std::max({far.x, far.y, far.z, 0x1p-126}) * 0x1p-24 <= most) return false;
    return rounding_of(given) > most;
}

Origin centre_of(std::span<const dvec3> given) {
    const WorldBounds extent = extent_of(given);
    const double size = size_of(extent);
    if (!(size > 0)) return {};
    const double step = std::ldexp(1.0, std::ilogb(size));
    return {glm::round((extent.lower + extent.upper) / (2 * step)) * step};
}

Origin origin_of(std::span<const dvec3> given) {
    if (!Origin().rounds_coarsely(given)) return {};
    const Origin centre = centre_of(given);
    // Points may be too close together for any.
    return centre.rounds_coarsely(given) ? Origin() : centre;
}

}  // namespace mray
