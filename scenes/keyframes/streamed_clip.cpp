#include "scenes/keyframes/streamed_clip.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <mutex>
#include <utility>

#include "scenes/interpolate.h"
#include "scenes/keyframes/keyframe_cache.h"

namespace mray {
namespace {

/// A frame between two keyframes, by their indices: its positions are interpolate() of theirs at f
/// in [0, 1). A keyframe is between itself and itself, at 0.
struct KeyframeBlend {
    std::size_t before = 0;
    std::size_t after = 0;
    float f = 0;
};

class StreamedClip : public Clip {
public:
    StreamedClip(ClipParts parts, std::unique_ptr<KeyframeSource> source,
                 const ClipOptions& options)
        : parts_(std::move(parts)),
          source_(std::move(source)),
          warn_(options.warn),
          cache_(source_->count(), topology().vertex_count) {
        parts_.first.faces = {};
        std::vector<vec3> positions = std::exchange(parts_.first.positions, {});
        if (parts_.has_first_keyframe)
            cache_.add(0, std::make_shared<std::vector<vec3>>(std::move(positions)));
        bounds_ = reference_bounds(*keyframe(0));
    }

    const Topology& topology() const override { return parts_.first.topology; }
    std::span<const uvec3> smooth_corners() const override {
        return parts_.first.smooth.empty() ? topology().triangles : parts_.first.smooth;
    }
    const SceneTextures* textures() const override {
        return parts_.first.textures.files.empty() ? nullptr : &parts_.first.textures;
    }
    double first_frame() const override { return source_->frame(0); }
    double last_frame() const override { return source_->frame(source_->count() - 1); }
    WorldBounds bounds() const override { return bounds_; }
    const std::string& name() const override { return parts_.name; }

    void positions(double frame, std::span<vec3> out) const override {
        assert(out.size() == topology().vertex_count);
        const KeyframeBlend blend = blend_at(frame);
        if (blend.before == blend.after) {
            copy_keyframe(blend.before, out);
            return;
        }
        const KeyframePositions a = keyframe(blend.before);
        const KeyframePositions b = keyframe(blend.after);
        for (std::size_t i = 0; i < out.size(); ++i) {
            for (int axis = 0; axis < 3; ++axis)
                out[i][axis] = interpolate((*a)[i][axis], (*b)[i][axis], blend.f);
        }
    }

private:
    KeyframePositions keyframe(std::size_t index) const {
        if (KeyframePositions kept = cache_.find(index)) return kept;
        auto positions = std::make_shared<std::vector<vec3>>(topology().vertex_count);
        read(index, *positions);
        cache_.add(index, positions);
        return positions;
    }

    void copy_keyframe(std::size_t index, std::span<vec3> out) const {
        KeyframePositions kept = cache_.keeps_all() ? keyframe(index) : cache_.find(index);
        if (kept == nullptr) {
            read(index, out);
        } else {
            std::copy(kept->begin(), kept->end(), out.begin());
        }
    }

    void read(std::size_t keyframe, std::span<vec3> out) const {
        const std::optional<Warning> warning = source_->read(keyframe, out);
        if (!warning || !warn_) return;
        const std::scoped_lock lock(warn_mutex_);
        warn_(*warning);
    }

    // The last keyframe at or before a frame of the clip.
    std::size_t at_or_before(double frame) const {
        std::size_t first = 0;
        std::size_t count = source_->count();
        while (count > 1) {
            const std::size_t half = count / 2;
            const bool is_later = source_->frame(first + half) > frame;
            if (!is_later) first += half;
            count = is_later ? half : count - half;
        }
        return first;
    }

    KeyframeBlend blend_at(double frame) const {
        // NaN becomes the first frame.
        if (!(frame > first_frame())) frame = first_frame();
        frame = std::min(frame, last_frame());

        const double base = parts_.holds ? std::floor(frame) : frame;
        const std::size_t before = at_or_before(base);
        const std::size_t after =
            parts_.holds ? at_or_before(base + 1) : std::min(before + 1, source_->count() - 1);
        const double from = parts_.holds ? base : source_->frame(before);
        const double to = parts_.holds ? base + 1 : source_->frame(after);
        const float f = frame == from ? 0.0f : static_cast<float>((frame - from) / (to - from));
        if (f == 0.0f || before == after) return {before, before, 0.0f};
        // Closer to the next keyframe than a float can tell.
        if (f >= 1.0f) return {after, after, 0.0f};
        return {before, after, f};
    }

    ClipParts parts_;
    std::unique_ptr<KeyframeSource> source_;
    WarnFunction warn_;
    mutable KeyframeCache cache_;
    WorldBounds bounds_;
    mutable std::mutex warn_mutex_;
};

}  // namespace

std::unique_ptr<Clip> stream_keyframes(ClipParts parts, std::unique_ptr<KeyframeSource> source,
                                       const ClipOptions& options) {
    return std::make_unique<StreamedClip>(std::move(parts), std::move(source), options);
}

}  // namespace mray
