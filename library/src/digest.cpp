#include "library/src/digest.h"

#include <random>

#include "common/base/hash.h"
#include "common/bvh/builder/bvh_builder.h"
#include "common/interop/platform.h"
#include "common/scene/pose.h"
#include "library/src/device_impl.h"
#include "library/src/engine.h"
#include "library/src/scene/errors.h"
#include "morphray/images.hpp"
#include "morphray/scene.hpp"

namespace morphray {
namespace detail {
namespace {

using mray::vec3;

constexpr std::uint32_t kGridSide = 32;
constexpr std::uint32_t kVertices = kGridSide * kGridSide;

/// A closed grid, then twins and a triangle without an area, which enclose nothing.
std::vector<std::uint32_t> make_triangles() {
    std::vector<std::uint32_t> triangles;
    for (std::uint32_t i = 0; i < kVertices; ++i) {
        const std::uint32_t right = i / kGridSide * kGridSide + (i + 1) % kGridSide;
        const std::uint32_t next = (i + kGridSide) % kVertices;
        const std::uint32_t next_right = (right + kGridSide) % kVertices;
        triangles.insert(triangles.end(), {i, next, right, right, next, next_right});
    }
    triangles.insert(triangles.end(), {0, 1, kGridSide, kGridSide, 1, 0, 2, 2, 3});
    return triangles;
}

/// A torus around the y axis. It and its sections are squares, so many triangles share a plane.
vec3 place_on_torus(std::uint32_t vertex) {
    // A cosine of straight lines, in quarters of its period.
    const auto wave = [](std::uint32_t i, std::uint32_t quarters) {
        return std::abs(static_cast<float>((i + quarters * kGridSide / 4) % kGridSide) * 0.125f -
                        2) -
               1;
    };
    const std::uint32_t x = vertex % kGridSide;
    const std::uint32_t y = vertex / kGridSide;
    const float radius = 2 + 0.75f * wave(y, 0);
    return {radius * wave(x, 0), 0.75f * wave(y, 1), radius * wave(x, 1)};
}

/// Every number and call here is part of kDigest. Floats are only added, subtracted and multiplied,
/// and the standard defines the numbers of std::mt19937.
class Digest {
public:
    Digest(std::uint32_t questions, const DigestStep& step) : questions_(questions), step_(step) {}

    std::uint64_t compute(const Device& device) {
        std::vector<vec3> guest;
        for (std::uint32_t i = 0; i < kVertices; ++i) {
            body_.push_back(place_on_torus(i));
            guest.push_back(0.5f * body_.back());
            sheet_.push_back(0.25f * vec3(i % kGridSide, 1.5f, i / kGridSide) - vec3(4, 0, 4));
        }
        guest.back().x = std::numeric_limits<float>::quiet_NaN();
        const std::span all(triangles_);
        const std::span some = all.first(std::size_t{3} * kVertices);
        const std::vector<MeshView> meshes = {
            {.positions = packed(body_), .triangles = all, .appearance = {.smooth = all}},
            {.positions = packed(sheet_), .triangles = some, .appearance = {.smooth = some}}};
        Scene scene = Scene::build(meshes, device,
                                   {.bounds = Box{{-6, -6, -6}, {6, 6, 6}}, .update = Every{2}});
        add_answers(scene, Rays::shadow);
        // A part is refitted; then all is built again; then a mesh comes, which is a build, too.
        move(std::span(sheet_).first(kVertices / 4));
        scene.update(1, 0, kVertices / 4);
        add_answers(scene, Rays::ao);
        for (const Rays rays : {Rays::shadow, Rays::ao}) {
            move(body_);
            move(sheet_);
            if (rays == Rays::ao) scene.attach({packed(guest), all});
            scene.update();
            add_answers(scene, rays);
        }
        // A refit, for which a device moves the bodies itself.
        const Transform turned{
            {{{0.75, -0.625, 0, 0.5}, {0.625, 0.75, 0.125, -0.5}, {0, -0.25, 0.875, 0.125}}}};
        scene.update(std::array{MeshPose{0, turned}, MeshPose{1, turned}});
        add_answers(scene, Rays::primary);
        if (step_) {
            refit_point("signs of zeros", device, vec3(0.0f, -0.0f, 0.0f));
            refit_point("denormals", device, vec3(0x1p-140f));
        }
        return hasher_.digest();
    }

private:
    vec3 random_place() {
        vec3 place;
        // A float has 24 bits.
        for (int axis = 0; axis < 3; ++axis)
            place[axis] = static_cast<float>(random_() >> 8) * 0x1p-21f - 4;
        return place;
    }

    void move(std::span<vec3> positions) {
        for (vec3& p : positions) p += 0.125f * vec3(p.y, p.z, -p.x) + 0.015625f * random_place();
    }

    void end_step(const char* what) {
        if (step_) step_(what, hasher_.digest());
    }

    /// Adds the answers to all rays or points, which query(answers) finds.
    template <class Answer, class Query>
    void add(const char* what, Query query) {
        std::vector<Answer> answers(questions_);
        query(std::span(answers));
        hasher_.add(answers);
        end_step(what);
    }

    void add_answers(const Scene& scene, Rays rays_of_image) {
        ask(scene);
        render(scene, rays_of_image);
        if (!step_) return;
        if (rays_of_image == Rays::ao) render_lit(scene);
        end_tree_step("boxes and leaves", engine::backend(scene));
    }

    /// NaNs of other processors may have other bits, so trees are no part of kDigest.
    void end_tree_step(const char* what, mray::Backend& backend) {
        mray::Bvh tree;
        backend.read_tree(tree);
        step_(what, mray::bvh_hash(tree));
    }

    /// Refits the box of a triangle that is this point, in a tree of that alone.
    void refit_point(const char* what, const Device& device, const vec3& point) {
        mray::Topology topology{.triangles = {{0, 1, 2}}, .albedo = {0}, .vertex_count = 3};
        const mray::Pose pose(std::vector<vec3>(3, point));
        const std::unique_ptr<mray::Backend> backend = DeviceImpl::of(device).make_backend();
        backend->set_scene(topology, pose, mray::build_bvh(topology, pose.positions()));
        backend->refit(mray::RefitExtent::kAll);
        end_tree_step(what, *backend);
    }

    void ask(const Scene& scene) {
        std::vector<Ray> rays;
        std::vector<Vec3> points;
        for (std::uint32_t i = 0; i < questions_; ++i) {
            const std::vector<vec3>& positions = i % 2 == 0 ? body_ : sheet_;
            const std::uint32_t* const triangle = &triangles_[random_() % (2 * kVertices) * 3];
            const vec3 a = positions[triangle[0]];
            const vec3 edge = 0.5f * (a + positions[triangle[1]]);
            const vec3 inner = 0.5f * (edge + positions[triangle[2]]);
            const vec3 targets[] = {a, edge, inner, random_place()};
            const vec3 target = targets[random_() % 4];
            // Some rays are parallel to an axis. The target is where t is 1.
            const vec3 org = i % 16 < 4 ? vec3(target.x, target.y, 4) : random_place();
            const vec3 dir = target - org;
            rays.push_back({.org = {org.x, org.y, org.z}, .dir = {dir.x, dir.y, dir.z}});
            if (i % 5 == 0) rays.back().tnear = 1;
            if (i % 7 == 0) rays.back().tfar = 1;
            points.push_back({target.x, target.y, target.z});
        }
        std::vector<Hit> first;
        add<Hit>("closest hits", [&](auto hits) {
            scene.intersect(rays, hits);
            first.assign(hits.begin(), hits.end());
        });
        add<std::uint8_t>("any hits", [&](auto occluded) { scene.occluded(rays, occluded); });
        add<std::uint64_t>("counts", [&](auto counts) { scene.count(rays, counts); });
        for (const Crossing crossing : {Crossing::once, Crossing::each, Crossing::owner}) {
            const AllHits all = scene.intersect_all(rays, {crossing, 5});
            hasher_.add(all.offsets).add(all.hits).add(all.left_out);
        }
        end_step("all hits");
        for (std::size_t i = 0; i < rays.size(); i += 50)
            hasher_.add(std::array{scene.intersect(rays[i], first[i], Crossing::owner)});
        end_step("next hits");
        add<std::int32_t>("windings", [&](auto windings) { scene.winding(points, windings); });
        add<std::uint8_t>("insides", [&](auto in) { scene.contains(points, in, FillRule::odd); });
        add<float>("distances", [&](auto out) { scene.signed_distance(points, out); });
        std::vector<ClosestPoint> closest(questions_);
        scene.closest_points(points, closest);
        // Without their padding.
        for (const ClosestPoint& c : closest) {
            hasher_.add(std::array{c.point.x, c.point.y, c.point.z, c.distance, c.u, c.v});
            hasher_.add(std::array{c.prim_id, c.geom_id, static_cast<std::uint32_t>(c.feature)});
        }
        end_step("closest points");
    }

    void render(const Scene& scene, Rays rays) {
        // The camera's floats do not depend on the last bits of a library's tangent of 45 degrees.
        View view{.eye = Point{0.5, 2, 1},
                  .target = Point{0, 0, 0},
                  .fov = 90,
                  .light = Point{-3, 4, 5},
                  .width = 96,
                  .height = 64,
                  .rays = rays,
                  .ao_count = 3,
                  .ao_distance = 1};
        const Image image = scene.render(view);
        hasher_.add(image.hits);
        end_step("hits of images");
        hasher_.add(image.occlusion);
        end_step("occlusion");
        hasher_.add(image.pixels);
        end_step("colours");
        // Some words of hits alone, which devices that share no memory with the host pack.
        view.rays = Rays::primary;
        std::vector<float> depth(image.pixels.size());
        std::vector<std::uint32_t> prim_id(image.pixels.size());
        std::vector<std::array<float, 2>> uv(image.pixels.size());
        ImageStack depths{.depth = depth};
        ImageStack others{.prim_id = prim_id, .uv = uv};
        scene.render({&view, 1}, depths);
        scene.render({&view, 1}, others);
        hasher_.add(depth).add(prim_id).add(uv);
        end_step("depths");
    }

    /// No part of kDigest either.
    void render_lit(const Scene& scene) {
        mray::Hasher hasher;
        for (const Shading shading :
             {Shading::plain, Shading::lit, Shading::normal, Shading::depth, Shading::prim}) {
            const Image image = scene.render(
                {.width = 48, .height = 32, .shading = shading, .samples = 4, .linear = true});
            hasher.add(image.hits).add(image.occlusion).add(image.pixels).add(image.linear);
        }
        step_("lit images", hasher.digest());
    }

    const std::uint32_t questions_;
    const DigestStep& step_;
    const std::vector<std::uint32_t> triangles_ = make_triangles();
    std::vector<vec3> body_;
    std::vector<vec3> sheet_;
    std::mt19937 random_{1};
    mray::Hasher hasher_;
};

}  // namespace

std::uint64_t compute_digest(const Device& device, std::uint32_t questions,
                             const DigestStep& step) {
    return Digest(questions, step).compute(device);
}

}  // namespace detail

const std::uint64_t kDigest = 0x9FB61E2C84283B2D;

std::uint64_t digest(const Device& device) {
    constexpr std::uint32_t kQuestions = 2200;
    return detail::with_public_errors([&] { return detail::compute_digest(device, kQuestions); });
}

}  // namespace morphray
