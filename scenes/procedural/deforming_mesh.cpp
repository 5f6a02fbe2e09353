#include "scenes/procedural/deforming_mesh.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cassert>
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

class ProceduralClip final : public Clip {
public:
    ProceduralClip(std::string name, DeformingMesh mesh)
        : name_(std::move(name)), mesh_(std::move(mesh)) {
        std::vector<vec3> first(mesh_.topology.vertex_count);
        move_in_parallel(mesh_, 0, first);
        bounds_ = reference_bounds(first);
    }

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
