#include "common/scene/scene_keyframes.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "common/interop/arithmetic.h"
#include "common/scene/interpolate.h"

namespace mray {
namespace {

// Interpolating in units of scene space, then centring, gives the bits of interpolating in world
// space and moving the result into scene space.
//
// 1. All operations of interpolate() commute with a factor of 2^e, as long as nothing overflows or
//    becomes a denormal. kMostExtent excludes the former in both spaces.
// 2. A denormal of world space is 2^(e-126) in scene space, at most 2^-76 for e <= kMostExponent; a
//    denormal of scene space is 2^-126. So the two sides can differ only in inputs and results
//    below 2^-76 in magnitude, called tiny. A float of 2^-50 or more plus or minus something tiny
//    is that float: half of the spacing next to it is at least 2^-75. A denormal f makes D * f
//    tiny, D being at most 2^21. Let a and b be in units of scene space.
// 3. |a| >= 2^-50: D = fl(b - a) is -a if b is tiny, otherwise the same on both sides or tiny; so
//    p = fl(D * f) is the same or tiny; so fl(a + p) is the same (a, if p is tiny) or tiny.
// 4. |a| < 2^-50 <= |b|: D is b if a is tiny, otherwise the same or tiny, and so is p. If |p| >=
//    2^-50, fl(a + p) is the same (p, if a is tiny); otherwise it is below 2^-48 on both sides.
// 5. Both below 2^-50: all results are below 4 * 2^-50.
// 6. So a result r is the same on both sides, or below 2^-48 on both. In the first case r - centre
//    is exact: centre is 0, or r lies in bounds for which Sterbenz's lemma holds (SceneSpace). In
//    the second case both sides snap to 0: an r that small is in such bounds only if the centre is
//    below 2^-47. Coordinates that SceneSpace takes for 0 before it snaps are snapped to 0 here.
//
// A vertex with a coordinate that is not finite in either keyframe has no place between them.
constexpr int kMostExponent = 50;

// 2^126: no difference of two coordinates overflows.
constexpr float kMostExtent = 0x1p126f;

bool is_finite(vec3 p) { return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z); }

bool is_within_extent(const WorldBounds& bounds, int exponent) {
    double largest = 0;
    for (int axis = 0; axis < 3; ++axis) {
        largest = std::max({largest, std::abs(bounds.lower[axis]), std::abs(bounds.upper[axis])});
    }
    return std::max(largest, std::ldexp(largest, exponent)) <= double{kMostExtent};
}

}  // namespace

SceneKeyframes::SceneKeyframes(const Clip& clip, const SceneSpace& space)
    : clip_(clip),
      is_usable_(!clip.bounds().empty() && space.exponent() <= kMostExponent &&
                 is_within_extent(clip.bounds(), space.exponent())) {
    if (!is_usable_) return;
    scale_ = std::ldexp(1.0f, space.exponent());
    for (int axis = 0; axis < 3; ++axis) {
        centre_[axis] = static_cast<float>(space.length_to_scene(space.centre(axis)));
    }
}

std::optional<KeyframeBlend> SceneKeyframes::blend(double frame) const {
    if (!is_usable_) return std::nullopt;
    return clip_.keyframes_at(frame);
}

void SceneKeyframes::positions(const KeyframeBlend& blend, std::span<vec3> out) const {
    const KeyframePositions first = clip_.keyframe(blend.before);
    const KeyframePositions second =
        blend.after == blend.before ? first : clip_.keyframe(blend.after);
    const std::span<const vec3> before = *first;
    const std::span<const vec3> after = *second;
    assert(out.size() == before.size());
    for (std::size_t i = 0; i < out.size(); ++i) {
        const vec3 a = before[i] * scale_;
        const vec3 b = after[i] * scale_;
        const vec3 p(interpolate(a.x, b.x, blend.f), interpolate(a.y, b.y, blend.f),
                     interpolate(a.z, b.z, blend.f));
        const bool has_place = is_finite(before[i]) && is_finite(after[i]);
        out[i] = has_place ? snap_point(p - centre_) : vec3(kInvalidCoordinate);
    }
}

}  // namespace mray
