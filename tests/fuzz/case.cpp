#include "tests/fuzz/case.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <utility>

#include "common/base/errors.h"
#include "common/bvh/builder/bvh_builder.h"
#include "scenes/sequence/streamed_animation.h"

namespace mray::fuzz {
namespace {

/// Its poses, pose k at frame k.
class ListedAnimation final : public Animation {
public:
    ListedAnimation(Topology topology, std::vector<std::vector<vec3>> poses)
        : topology_(std::move(topology)), poses_(std::move(poses)) {
        const std::vector<IndexRange> used = used_vertices(topology_);
        PoseExtent all;
        for (const std::vector<vec3>& pose : poses_) all.extend(PoseExtent(pose, used));
        bounds_ = all.bounds(all.limit());
    }

    const Topology& topology() const override { return topology_; }
    double first_frame() const override { return 0; }
    double last_frame() const override { return static_cast<double>(poses_.size() - 1); }
    WorldBounds bounds() const override { return bounds_; }
    const std::string& name() const override { return name_; }

    void positions(double frame, std::span<vec3> out) const override {
        assert(frame >= 0 && frame <= last_frame());
        const auto before = static_cast<std::size_t>(frame);
        const auto f = static_cast<float>(frame - std::floor(frame));
        const std::size_t after = f == 0 ? before : before + 1;
        for (std::size_t i = 0; i < out.size(); ++i) {
            const vec3 a = poses_[before][i];
            const vec3 b = poses_[after][i];
            for (int axis = 0; axis < 3; ++axis) out[i][axis] = interpolate(a[axis], b[axis], f);
        }
    }

private:
    std::string name_ = "case";
    Topology topology_;
    std::vector<std::vector<vec3>> poses_;
    WorldBounds bounds_;
};

void require_sound(const FuzzCase& fuzz_case) {
    const auto refuse = [](const char* what) { throw Error(ErrorKind::kBadInput, what); };
    if (fuzz_case.poses.empty()) refuse("a case needs a pose");
    const std::size_t vertices = fuzz_case.poses.front().size();
    for (const auto& pose : fuzz_case.poses)
        if (pose.size() != vertices) refuse("all poses need the same number of vertices");
    for (const uvec3& t : fuzz_case.triangles)
        if (std::max({t.x, t.y, t.z}) >= vertices)
            refuse("a triangle names a vertex beyond the last");
    const double last = static_cast<double>(fuzz_case.poses.size() - 1);
    if (fuzz_case.build_at >= fuzz_case.poses.size() || !(fuzz_case.frame >= 0) ||
        fuzz_case.frame > last)
        refuse("a frame is beyond the last pose");
}

/// A colour that differs between triangles, so that one fetched for a wrong triangle shows.
Albedo albedo_of(std::size_t triangle) {
    return static_cast<Albedo>((triangle * 0x9E3779B97F4A7C15u) >> 40) | 0x404040u;
}

Topology topology_of(const FuzzCase& fuzz_case) {
    Topology topology;
    topology.triangles = fuzz_case.triangles;
    for (std::size_t i = 0; i < topology.triangles.size(); ++i)
        topology.albedo.push_back(albedo_of(i));
    topology.vertex_count = static_cast<std::uint32_t>(fuzz_case.poses.front().size());
    return topology;
}

std::vector<vec3> copy_of(std::span<const vec3> positions) {
    return {positions.begin(), positions.end()};
}

}  // namespace

FuzzScene::FuzzScene(const FuzzCase& fuzz_case) : frame_(fuzz_case.frame) {
    require_sound(fuzz_case);
    frames_ = std::make_unique<SceneFrames>(
        std::make_unique<ListedAnimation>(topology_of(fuzz_case), fuzz_case.poses));
    bounds_ = frames_->animation().bounds();
    const auto built_at = static_cast<double>(fuzz_case.build_at);
    built_positions_ = copy_of(frames_->positions(built_at));
    built_ = build_bvh(topology(), built_positions_, {.threads = 1});
    journey_.push_back(built_positions_);
    const double step = frame_ >= built_at ? 1 : -1;
    for (double f = built_at + step; (frame_ - f) * step > 0; f += step)
        journey_.push_back(copy_of(frames_->positions(f)));
    positions_ = copy_of(frames_->positions(frame_));
    if (frame_ != built_at) journey_.push_back(positions_);
    rebuilt_ = frame_ == built_at ? built_ : build_bvh(topology(), positions_, {.threads = 1});
}

std::vector<vec3> world_positions(const FuzzCase& fuzz_case, double frame) {
    const ListedAnimation animation(topology_of(fuzz_case), fuzz_case.poses);
    std::vector<vec3> positions(fuzz_case.poses.front().size());
    animation.positions(frame, positions);
    return positions;
}

std::vector<vec3> seen_positions(const FuzzCase& fuzz_case, double frame) {
    const ListedAnimation animation(topology_of(fuzz_case), fuzz_case.poses);
    std::vector<vec3> positions(fuzz_case.poses.front().size());
    animation.positions(frame, positions);
    const PoseExtent pose(positions, used_vertices(animation.topology()));
    const SceneSpace space = space_of_pose(animation.bounds(), pose);
    for (vec3& p : positions)
        if (!space.keeps(p)) p = vec3(std::numeric_limits<float>::quiet_NaN());
    return positions;
}

}  // namespace mray::fuzz
