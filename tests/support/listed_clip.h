// A clip of keyframes that a test lists.
#pragma once

#include <algorithm>
#include <cassert>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "scenes/clip.h"
#include "scenes/sequence/streamed_clip.h"

namespace mray::test {

/// Keyframe k is frame k.
class ListedClip : public Clip {
public:
    ListedClip(Topology topology, std::vector<std::vector<vec3>> keyframes)
        : topology_(std::move(topology)), keyframes_(std::move(keyframes)) {
        topology_.vertex_count = static_cast<std::uint32_t>(keyframes_.front().size());
        for (const std::vector<vec3>& keyframe : keyframes_) {
            const WorldBounds bounds = bounds_of(keyframe);
            if (!bounds.empty()) bounds_.extend(bounds.lower, bounds.upper);
        }
    }

    const Topology& topology() const override { return topology_; }
    double first_frame() const override { return 0; }
    double last_frame() const override { return static_cast<double>(keyframes_.size() - 1); }
    WorldBounds bounds() const override { return bounds_; }
    const std::string& name() const override { return name_; }

    void positions(double frame, std::span<vec3> out) const override {
        assert(frame >= 0 && frame <= last_frame());
        const auto before = static_cast<std::size_t>(frame);
        const auto f = static_cast<float>(frame - std::floor(frame));
        const std::size_t after = f == 0 ? before : before + 1;
        for (std::size_t i = 0; i < out.size(); ++i) {
            const vec3 a = keyframes_[before][i];
            const vec3 b = keyframes_[after][i];
            for (int axis = 0; axis < 3; ++axis) out[i][axis] = interpolate(a[axis], b[axis], f);
        }
    }

private:
    std::string name_ = "listed";
    Topology topology_;
    std::vector<std::vector<vec3>> keyframes_;
    WorldBounds bounds_;
};

}  // namespace mray::test
