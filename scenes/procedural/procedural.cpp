#include "scenes/procedural/procedural.h"

#include <fmt/format.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <utility>
#include <vector>

#include "common/base/errors.h"
#include "common/text/text.h"
#include "scenes/procedural/body_scenes.h"
#include "scenes/procedural/surface_scenes.h"

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

class ProceduralAnimation final : public Animation {
public:
    ProceduralAnimation(std::string name, DeformingMesh mesh)
        : name_(std::move(name)), mesh_(std::move(mesh)) {
        std::vector<vec3> first(mesh_.topology.vertex_count);
        move_in_parallel(mesh_, 0, first);
        bounds_ = reference_bounds(mesh_.topology, first);
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
    bool is_builtin() const override { return true; }
    const std::string& name() const override { return name_; }

private:
    std::string name_;
    DeformingMesh mesh_;
    WorldBounds bounds_;
};

constexpr std::array kScenes = {
    ProceduralScene{"cloth", "a sheet that comes down waving over a ball", 60000, make_cloth},
    ProceduralScene{"twist", "a column of boxes twisted by up to 4 turns", 40000, make_twist},
    ProceduralScene{"herd", "animals walking on static hills", 80000, make_herd},
    ProceduralScene{"shuffle", "a torus whose triangles change places", 40000, make_shuffle},
    ProceduralScene{"soup", "separate small triangles in motion", 30000, make_soup},
    ProceduralScene{"spikes", "a closed ball with pulsing spikes", 60000, make_spikes},
    ProceduralScene{"orbits", "balls on crossing orbits", 40000, make_orbits},
    ProceduralScene{"teleport", "balls that jump elsewhere all at once", 40000, make_teleport},
    ProceduralScene{"hall", "a hall from inside: columns, cables, banners", 80000, make_hall},
};

}  // namespace

std::span<const ProceduralScene> procedural_scenes() { return kScenes; }

std::unique_ptr<Animation> make_procedural(const std::string& name, std::uint64_t triangles) {
    const auto* const scene =
        std::find_if(kScenes.begin(), kScenes.end(),
                     [&](const ProceduralScene& known) { return name == known.name; });
    if (scene == kScenes.end()) {
        throw Error(ErrorKind::kBadArgument,
                    "there is no built-in scene {}; `morphray info` lists them", quote(name));
    }
    if (triangles > kMaxTriangles) {
        throw Error(ErrorKind::kLimit,
                    "{} triangles are too many for the built-in scene '{}'; ask for {} at most",
                    triangles, name, kMaxTriangles);
    }
    if (triangles == 0) triangles = scene->default_triangles;
    return std::make_unique<ProceduralAnimation>(name, scene->make(triangles));
}

}  // namespace mray
