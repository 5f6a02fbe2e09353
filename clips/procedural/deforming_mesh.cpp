#include "clips/procedural/deforming_mesh.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_reduce.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <utility>
#include <vector>

namespace mray {
namespace {

// Vertices that one task moves: some 0.1 ms of work.
constexpr std::uint32_t kGrain = 4096;

void move_in_parallel(const DeformingMesh& mesh, double frame, std::span<vec3> out) {
    tbb::parallel_for(tbb::blocked_range<std::uint32_t>(0, mesh.topology.vertex_count, kGrain),
                      [&](const tbb::blocked_range<std::uint32_t>& block) {
                          mesh.move(frame, {block.begin(), block.end()}, out);
                      });
}

WorldBounds bounds_in_parallel(std::span<const vec3> points) {
    return tbb::parallel_reduce(
        tbb::blocked_range<std::size_t>(0, points.size(), kGrain), WorldBounds{},
        [&](const tbb::blocked_range<std::size_t>& block, WorldBounds bounds) {
            vec3 lower = points[block.begin()];
            vec3 upper = lower;
            for (std::size_t i = block.begin(); i < block.end(); ++i) {
                for (int axis = 0; axis < 3; ++axis) {
                    lower[axis] = std::min(lower[axis], points[i][axis]);
                    upper[axis] = std::max(upper[axis], points[i][axis]);
                }
            }
            const double block_lower[3] = {lower.x, lower.y, lower.z};
            const double block_upper[3] = {upper.x, upper.y, upper.z};
            bounds.extend(block_lower, block_upper);
            return bounds;
        },
        [](WorldBounds a, const WorldBounds& b) {
            if (!b.empty()) a.extend(b.lower, b.upper);
            return a;
        });
}

WorldBounds bounds_over_clip(const DeformingMesh& mesh) {
    WorldBounds bounds;
    std::vector<vec3> positions(mesh.topology.vertex_count);
    const int last_frame = static_cast<int>(mesh.last_frame);
    for (int frame = 0; frame <= last_frame; ++frame) {
        move_in_parallel(mesh, frame, positions);
        const WorldBounds at_frame = bounds_in_parallel(positions);
        if (!at_frame.empty()) bounds.extend(at_frame.lower, at_frame.upper);
    }
    double largest = 0;
    for (int axis = 0; axis < 3; ++axis) {
        largest = std::max({largest, std::abs(bounds.lower[axis]), std::abs(bounds.upper[axis])});
    }
    // Both the whole frames and the one in question were rounded, each by at most 2^-24 of largest.
    const double margin = mesh.acceleration / 8 + largest * 0x1p-22;
    for (int axis = 0; axis < 3; ++axis) {
        bounds.lower[axis] -= margin;
        bounds.upper[axis] += margin;
    }
    return bounds;
}

class ProceduralClip final : public Clip {
public:
    ProceduralClip(std::string name, DeformingMesh mesh)
        : name_(std::move(name)), mesh_(std::move(mesh)), bounds_(bounds_over_clip(mesh_)) {}

    const Topology& topology() const override { return mesh_.topology; }
    std::span<const uvec3> smooth_corners() const override { return mesh_.topology.triangles; }
    double first_frame() const override { return 0; }
    double last_frame() const override { return mesh_.last_frame; }
    void positions(double frame, std::span<vec3> out) const override {
        assert(out.size() == mesh_.topology.vertex_count);
        move_in_parallel(mesh_, std::clamp(frame, 0.0, mesh_.last_frame), out);
    }
    WorldBounds bounds() const override { return bounds_; }
    std::optional<InsideView> inside_view() const override { return mesh_.inside_view; }
    const std::string& name() const override { return name_; }

private:
    std::string name_;
    DeformingMesh mesh_;
    WorldBounds bounds_;
};

}  // namespace

std::unique_ptr<Clip> make_clip(std::string name, DeformingMesh mesh) {
    return std::make_unique<ProceduralClip>(std::move(name), std::move(mesh));
}

}  // namespace mray
