#include "app/animation/animation_scene.h"

#include "app/animation/devices.h"
#include "app/animation/frames.h"
#include "app/base/image_files.h"
#include "common/image/depth.h"
#include "library/src/engine.h"

namespace mray::app {
namespace {

std::span<const std::uint32_t> indices_of(std::span<const uvec3> threes) {
    static_assert(sizeof(uvec3) == 3 * sizeof(std::uint32_t));
    return {reinterpret_cast<const std::uint32_t*>(threes.data()), 3 * threes.size()};
}

/// The vertices of the first frame that are not left out, in world space.
std::vector<vec3> first_vertices(const Animation& animation) {
    const Topology& topology = animation.topology();
    std::vector<vec3> all(topology.vertex_count);
    animation.positions(animation.first_frame(), all);
    std::vector<vec3> kept;
    const std::vector<IndexRange> used = used_vertices(topology);
    const SceneSpace space = space_of_pose(animation.bounds(), PoseExtent(all, used));
    for (const IndexRange& range : used)
        std::copy_if(&all[range.begin], all.data() + range.end, std::back_inserter(kept),
                     [&](const vec3& p) { return space.keeps(p); });
    return kept;
}

/// The corners of a square below these bounds, four times as large; empty for empty bounds.
std::vector<vec3> ground_below(const WorldBounds& bounds, const Point& up) {
    using glm::dvec3;
    if (bounds.empty()) return {};
    // Deep enough that a part of the scene at its very bottom is in front of it.
    constexpr double kDepth = 1e-3;
    constexpr double kReach = 4;
    const dvec3 n = direction_of(to_dvec3(up));
    if (n == dvec3(0.0)) return {};
    const dvec3 half = (bounds.upper - bounds.lower) / 2.0;
    const dvec3 centre = bounds.lower + half;
    const double size = glm::length(half);
    const double depth = glm::dot(glm::abs(n), half) + kDepth * size;
    const dvec3 aside = std::abs(n.y) > 0.5 ? dvec3(1, 0, 0) : dvec3(0, 1, 0);
    const dvec3 x = glm::normalize(glm::cross(aside, n)) * (kReach * size);
    const dvec3 z = glm::cross(x, n);
    const dvec3 middle = centre - depth * n;
    std::vector<vec3> corners;
    for (const dvec3& corner : {middle - x - z, middle - x + z, middle + x + z, middle + x - z})
        corners.emplace_back(corner);
    return corners;
}

}  // namespace

Warning warning_of_far(const Animation& animation, std::uint64_t vertices) {
    return {
        escape(animation.name()),
        fmt::format("{} of {} vertices are left out with their triangles: more than 2^{} times as "
                    "far from the origin as most",
                    vertices, animation.topology().vertex_count, kFarExponent)};
}

morphray::View world_view(morphray::View view, const Animation& animation) {
    ViewSpec spec = morphray::engine::to_spec(view, to_point(animation.origin().at));
    const bool is_free = !view.eye && !view.target;
    if (is_free && !animation.is_builtin()) {
        spec = frame_object(spec, first_vertices(animation));
    } else if (const std::optional<InsideView> inside = animation.inside_view()) {
        if (is_free) {
            spec.eye = inside->eye;
            spec.target = inside->target;
        }
        if (!spec.light) spec.light = inside->light;
    }
    const ResolvedView resolved = resolve_view(spec, animation.bounds());
    view.eye = resolved.eye;
    view.target = resolved.target;
    view.light = resolved.light;
    // Throws if the view is impossible.
    spec = morphray::engine::to_spec(view, {});
    spec.ao_count = std::max(spec.ao_count, 1u);
    make_image_params(spec, animation.bounds(), SceneSpace(animation.bounds()));
    return view;
}

std::string scale_text(const morphray::View& world, const Animation& animation) {
    if (world.shading != morphray::Shading::depth) return {};
    const DepthRange depths = depth_range(*world.eye, *world.target, animation.bounds());
    return fmt::format("depths: {:.4g} (white) to {:.4g} (dark grey)", depths.near,
                       depths.near + depths.range);
}

bool has_ground(const std::optional<bool>& option, const morphray::View& world,
                const Animation& animation) {
    if (option) return *option;
    if (animation.is_builtin() || world.shading != morphray::Shading::lit) return false;
    const std::vector<vec3> ground = ground_below(animation.bounds(), world.up);
    if (ground.empty()) return false;
    return glm::dot(to_dvec3(*world.eye) - glm::dvec3(ground.front()), to_dvec3(world.up)) > 0;
}

AnimationScene::AnimationScene(const morphray::Device& device, const Options& options,
                               const Animation& animation, double first_frame,
                               const Messages& messages, const std::atomic<bool>& cancel)
    : animation_(animation),
      messages_(messages),
      used_(used_vertices(animation.topology())),
      positions_(animation.topology().vertex_count),
      up_(options.view.up),
      current_(options.tree.build_at.value_or(first_frame)) {
    if (options.ground.value_or(false)) ground_ = ground_below(animation.bounds(), up_);
    call_library([&] {
        morphray::SceneOptions scene_options = {
            .update = morphray::parse_update_policy(text_of(options.tree.update)),
            .record_cost_ratio = options.tree.record_cost_ratio,
            .cancel = &cancel};
        if (const WorldBounds bounds = animation.bounds(); !bounds.empty())
            scene_options.bounds = {to_point(bounds.lower), to_point(bounds.upper)};
        deform_ms_ = place(current_);
        std::vector<Image> images;
        if (animation.textures() != nullptr && options.view.shading == morphray::Shading::lit)
            images = read_textures(*animation.textures(), options.source.lenient, messages);
        std::vector<morphray::TextureView> textures;
        for (std::size_t i = 0; i < images.size(); ++i) {
            const TextureFile& file = animation.textures()->files[i];
            textures.push_back({.texels = images[i].pixels,
                                .width = images[i].width,
                                .height = images[i].height,
                                .wrap = file.clamp ? morphray::Wrap::clamp : morphray::Wrap::repeat,
                                .alpha_cutoff = file.alpha_cutoff});
        }
        scene_ = morphray::Scene::build(meshes(textures), device, scene_options);
        update_ = scene_->last_update();
    });
    warn_of_left_out();
}

void AnimationScene::warn_of_left_out() {
    std::uint64_t far = 0;
    std::uint64_t small = 0;
    for (const morphray::LeftOut& mesh : update_.left_out) {
        far += mesh.too_far;
        small += mesh.too_small;
    }
    if (far + small == 0 || std::exchange(has_warned_, true)) return;
    if (far > 0) messages_.warn(warning_of_far(animation_, far));
    if (small > 0)
        messages_.warn({escape(animation_.name()),
                        fmt::format("{} of {} triangles are never hit: their area is lost in steps "
                                    "of 2^-60 of the scene's size",
                                    small, animation_.topology().triangles.size())});
}

/// The animation's mesh, with these textures, and the ground, if there is one.
std::vector<morphray::MeshView> AnimationScene::meshes(
    std::span<const morphray::TextureView> textures) const {
    const Topology& topology = animation_.topology();
    std::vector<morphray::MeshView> meshes = {
        {.positions = morphray::packed(positions_),
         .triangles = indices_of(topology.triangles),
         .appearance = {.albedo = topology.albedo,
                        .smooth = indices_of(animation_.smooth_corners())}}};
    if (!textures.empty()) {
        meshes.front().appearance.textures = textures;
        const std::vector<Texcoords>& texcoords = animation_.textures()->texcoords;
        static_assert(sizeof(Texcoords) == 6 * sizeof(float));
        meshes.front().appearance.texcoords = {reinterpret_cast<const float*>(texcoords.data()),
                                               6 * texcoords.size()};
        meshes.front().appearance.texture_ids = animation_.textures()->texture_ids;
    }
    if (!ground_.empty()) {
        static constexpr std::uint32_t kTriangles[] = {0, 1, 2, 0, 2, 3};
        meshes.push_back({.positions = morphray::packed(ground_),
                          .triangles = kTriangles,
                          .deforms = !animation_.is_builtin(),
                          .appearance = {.shadow_catcher = true}});
    }
    return meshes;
}

double AnimationScene::place(double frame) {
    const Stopwatch watch;
    animation_.positions(frame, positions_);
    if (!ground_.empty() && !animation_.is_builtin()) {
        WorldBounds bounds = animation_.bounds();
        const PoseExtent pose(positions_, used_);
        bounds.extend(pose.bounds(pose.limit(bounds)));
        std::ranges::copy(ground_below(bounds, up_), ground_.begin());
    }
    return watch.ms();
}

// The library reads positions_ in its updates only.
void AnimationScene::prepare(double frame) {
    if (prepared_) return;
    prepared_ = frame;
    reading_ = std::async(std::launch::async, [this, frame] { return place(frame); });
}

void AnimationScene::advance(double frame) {
    if (std::exchange(is_fresh_, false) && frame == current_) return;
    current_ = frame;
    const std::optional<double> prepared = std::exchange(prepared_, std::nullopt);
    if (prepared) reading_.wait();
    deform_ms_ = prepared == frame ? reading_.get() : place(frame);
    call_library([&] { update_ = scene_->update(); });
    warn_of_left_out();
}

double AnimationScene::deform(double frame) {
    const Stopwatch watch;
    place(frame);
    morphray::engine::read_positions(*scene_);
    const double ms = watch.ms();
    update_ = call_library([&] { return scene_->last_update(); });
    warn_of_left_out();
    return ms;
}

void AnimationScene::render(const morphray::View& view, morphray::Image& image) {
    call_library([&] {
        scene_->render(view, image);
        update_ = scene_->last_update();
    });
}

std::string AnimationScene::refitted_on() const {
    const bool was_built =
        update_.step == morphray::Step::build || update_.step == morphray::Step::rebuild;
    if (was_built) return {};
    return scene_->device().name() == "vulkan" ? "vulkan" : "cpu";
}

PosedAnimation pose_animation(const Options& options, const Messages& messages) {
    PosedAnimation posed{open_animation(options.source, messages), nullptr};
    const Animation& animation = *posed.animation;
    const double frame = select_frame(options, animation);
    {
        const Progress progress("building the tree", 0, messages);
        posed.scene = std::make_unique<AnimationScene>(open_device(options.backend, messages),
                                                       options, animation, frame, messages);
    }
    const Topology& topology = animation.topology();
    const std::uint64_t bad = count_not_finite(topology, posed.scene->positions());
    if (bad > 0)
        messages.warn({escape(animation.name()),
                       fmt::format("{} of {} triangles are not finite; they are never hit", bad,
                                   topology.triangles.size())});
    return posed;
}

}  // namespace mray::app
