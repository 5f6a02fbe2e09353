#include "common/scene/scene_keyframes.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "common/interop/keyframes.h"

namespace morphray {
namespace {

// Why interpolating in units of scene space gives the bits of interpolating in the user's and
// moving the result into scene space:
//
// All operations of interpolate() commute with a factor of 2^e as long as nothing overflows, which
// kKeyframeExtent excludes in both spaces, or becomes a denormal: in world space (2^(e-126) in
// scene space, at most 2^-76 for e <= kMostExponent) or in scene space (2^-126), where a device may
// also flush it. So either side may take what is below 2^-76 in magnitude, an input or a result,
// for something else below 2^-76; everything else is the same on both. Call that *tiny*. A float of
// 2^-50 or more plus or minus something tiny is that float: half of the spacing next to it is at
// least 2^-75. An f that is a denormal makes D * f tiny, D being at most 2^21. Let a and b be in
// units of scene space.
//
// - |a| >= 2^-50. D = fl(b - a) is -a where b is tiny, else the same on both sides or tiny; so
//   p = fl(D * f) is the same or tiny; so fl(a + p) is the same (a, if p is tiny) or tiny.
// - |a| < 2^-50 <= |b|. D is b where a is tiny, else the same or tiny, and p likewise. If |p| >=
//   2^-50, then fl(a + p) is the same (p, if a is tiny); if not, it is below 2^-48 on both sides.
// - Both below 2^-50: so is everything else, times 4.
//
// Thus a result r is the same on both sides, or below 2^-48 on both. In the first case r - centre
// is exact: centre is 0, or r lies in bounds where Sterbenz's lemma holds (SceneSpace). In the
// second, 0 is what both snap to: an r that small is in such bounds only if the centre is below
// 2^-47. What SceneSpace takes for 0 before it snaps, snapping takes for 0.
//
// A vertex with a coordinate that is not finite in either keyframe has none between them: f > 0.
constexpr int kMostExponent = 50;

bool is_finite(vec3 p) { return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z); }

bool is_within_extent(const WorldBounds& bounds, int exponent) {
    double largest = 0;
    for (int axis = 0; axis < 3; ++axis) {
        largest = std::max({largest, std::abs(bounds.lower[axis]), std::abs(bounds.upper[axis])});
    }
    return std::max(largest, std::ldexp(largest, exponent)) <= double{kKeyframeExtent};
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

vec3 SceneKeyframes::scaled(vec3 user) const {
    return is_finite(user) ? user * scale_ : vec3(kNoKeyframe, kNoKeyframe, kNoKeyframe);
}

void SceneKeyframes::write(std::size_t keyframe, std::span<vec3> out) const {
    const std::span<const vec3> user = clip_.keyframe(keyframe);
    assert(out.size() == user.size());
    for (std::size_t i = 0; i < out.size(); ++i) out[i] = scaled(user[i]);
}

void SceneKeyframes::positions(const KeyframeBlend& blend, std::span<vec3> out) const {
    const std::span<const vec3> before = clip_.keyframe(blend.before);
    const std::span<const vec3> after = clip_.keyframe(blend.after);
    assert(out.size() == before.size());
    for (std::size_t i = 0; i < out.size(); ++i) {
        out[i] = between_keyframes(scaled(before[i]), scaled(after[i]), blend.f, centre_);
    }
}

}  // namespace morphray
