#include "scenes/gltf/gltf_animation.h"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cmath>

#include "common/text/text.h"
#include "scenes/gltf/gltf_scene.h"
#include "scenes/gltf/pose.h"

namespace mray {
namespace {

// Times are floats: the frame of 49 / 24 s may come out as 48.999999.
constexpr double kFrameRounding = 0x1p-22;

class GltfAnimation : public Animation {
public:
    GltfAnimation(const std::filesystem::path& path, const std::string& name,
                  const AnimationOptions& options)
        : Animation(name),
          file_(escape(path)),
          is_lenient_(options.lenient),
          scene_(gltf::read_gltf_scene(path, options)),
          skinning_(scene_),
          frames_a_second_(options.fps.value_or(kDefaultFps)) {
        topology_ = std::move(scene_.topology);
        smooth_corners_ = scene_.smooth;
        textures_ = std::move(scene_.textures);
        animations_ = std::move(scene_.animations);
        const double frames = scene_.animation.seconds * frames_a_second_;
        const double whole = std::round(frames);
        last_frame_ = std::abs(frames - whole) <= kFrameRounding * whole ? whole : frames;
        if (last_frame_ > 0) fps_ = frames_a_second_;
        std::vector<vec3> first(topology_.vertex_count);
        origin_ = find_origin(first);
        place(0, 0, first, options.warn);
        std::vector<std::uint32_t> begins;
        for (const gltf::PlacedSet& placed : scene_.placed_sets)
            begins.push_back(placed.first_vertex);
        set_bounds(first, begins);
    }

    void positions(double frame, std::span<vec3> out) const override {
        assert(out.size() == topology_.vertex_count);
        // NaN becomes the first frame.
        const double within = frame > 0 ? std::min(frame, last_frame_) : 0.0;
        const double seconds = within == last_frame_
                                   ? scene_.animation.seconds
                                   : std::min(within / frames_a_second_, scene_.animation.seconds);
        place(within, seconds, out, {});
    }

private:
    void place(double frame, double seconds, std::span<vec3> out, const WarnFunction& warn) const {
        if (skinning_.place(gltf::pose_at(scene_, seconds, origin_), out)) return;
        const std::optional<Warning> warning =
            MeshRules::check_frame(file_, frame, out, is_lenient_);
        if (warning && warn) warn(*warning);
    }
    /// Uses the memory of `places`.
    Origin find_origin(std::span<vec3> places) const {
        std::vector<glm::dvec3> points(places.size());
        Origin origin;
        // Places from about their centre have the digits that those from 0 may lack.
        for (int i = 0; i < 2; ++i) {
            if (i == 1) origin = centre_of(points);
            skinning_.place(gltf::pose_at(scene_, 0, origin), places);
            std::ranges::transform(places, points.begin(),
                                   [&](const vec3& p) { return origin.from_world(glm::dvec3(p)); });
        }
        return origin_of(points);
    }

    std::string file_;  // in messages
    bool is_lenient_;
    gltf::GltfScene scene_;
    gltf::Skinning skinning_;
    double frames_a_second_;
};

}  // namespace

bool has_gltf_name(const std::filesystem::path& path) {
    const std::string extension = lower_case(path.extension().native());
    return extension == ".gltf" || extension == ".glb";
}

std::unique_ptr<Animation> open_gltf(const std::filesystem::path& path, const std::string& name,
                                     const AnimationOptions& options) {
    return std::make_unique<GltfAnimation>(path, name, options);
}

}  // namespace mray
