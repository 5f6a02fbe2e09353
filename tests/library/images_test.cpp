// Images with several samples a pixel, lit, smooth, textured, with holes or in false colours, their
// files of hits, images that are cancelled, and the boxes of a tree.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <functional>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include <glm/geometric.hpp>

#include "tests/library/holed_scene.h"
#include "tests/library/scenes.h"
#include "tests/support/temporary_folder.h"

namespace mray::test {
namespace {

using morphray::Box;
using morphray::Device;
using morphray::Hit;
using morphray::Image;
using morphray::MeshView;
using morphray::Point;
using morphray::Ray;
using morphray::Scene;
using morphray::Shading;
using morphray::View;

morphray::MeshView smooth_view(const UserMesh& mesh) {
    morphray::MeshView view = mesh.view();
    view.appearance.smooth = mesh.triangles;
    return view;
}

View view_of(Shading shading, std::uint32_t samples) {
    return {.width = 45, .height = 31, .shading = shading, .samples = samples, .ao_count = 3};
}

TEST(Shading, IsTheSameOnEveryDeviceAndForAnyTree) {
    UserMesh mesh(torus(30, 20));
    Scene scene = Scene::build(smooth_view(mesh));
    const Scene brute = scene.on(Device::brute_force());
    const Scene scalar = scene.on(Device::cpu({.threads = 1, .simd = "off"}));
    for (const Shading shading :
         {Shading::plain, Shading::lit, Shading::normal, Shading::depth, Shading::prim}) {
        for (const std::uint32_t samples : {1u, 4u, 16u}) {
            const View view = view_of(shading, samples);
            const Image image = scene.render(view);
            for (const Scene* other : {&brute, &scalar}) {
                const morphray::Comparison same = morphray::compare(image, other->render(view));
                EXPECT_TRUE(same.equal()) << morphray::describe(same);
                EXPECT_EQ(same.compared, std::uint64_t{45} * 31 * samples);
            }
        }
    }
}

TEST(Shading, SmoothNormalsMakeMoreColoursThanTriangles) {
    const UserMesh mesh(torus(12, 8));
    const auto colours = [&](const morphray::MeshView& shaded, bool flat) {
        View view = view_of(Shading::normal, 1);
        view.flat = flat;
        const Image image = Scene::build(shaded).render(view);
        return std::set<std::uint32_t>(image.pixels.begin(), image.pixels.end());
    };
    const std::set<std::uint32_t> flat = colours(mesh.view(), false);
    EXPECT_EQ(colours(smooth_view(mesh), true), flat);
    EXPECT_GT(colours(smooth_view(mesh), false).size(), 3 * flat.size());
}

TEST(Shading, SeveralMeshesKeepTheirOwnNormals) {
    const UserMesh mesh(torus(30, 20));
    UserMesh plane;
    plane.points = {{-3, -3, -1}, {3, -3, -1}, {3, 3, -1}, {-3, 3, -1}};
    plane.triangles = {0, 1, 2, 0, 2, 3};
    const View view = view_of(Shading::normal, 1);
    const std::vector<morphray::MeshView> meshes = {plane.view(), smooth_view(mesh)};
    const std::vector<morphray::MeshView> reversed = {smooth_view(mesh), plane.view()};
    EXPECT_EQ(Scene::build(meshes).render(view).pixels, Scene::build(reversed).render(view).pixels);
}

TEST(Shading, TracesTheRaysOfPlainImages) {
    UserMesh mesh(torus(30, 20));
    const Scene scene = Scene::build(smooth_view(mesh));
    View lit = view_of(Shading::lit, 1);
    // Smooth surfaces have shadows of their own.
    lit.flat = true;
    View plain = view_of(Shading::plain, 1);
    const Image both = scene.render(lit);
    lit.ao_count = 0;
    const Image shadowed = scene.render(lit);
    plain.rays = morphray::Rays::shadow;
    const Image shadows = scene.render(plain);
    EXPECT_EQ(shadowed.hits_hash, shadows.hits_hash);
    EXPECT_EQ(shadowed.ray_count, shadows.ray_count);
    plain.rays = morphray::Rays::ao;
    const Image sky = scene.render(plain);
    for (std::size_t i = 0; i < sky.occlusion.size(); ++i)
        EXPECT_EQ(both.occlusion[i], shadows.occlusion[i] + sky.occlusion[i]) << i;
}

TEST(Shading, RefusesWhatItCannotDo) {
    const UserMesh mesh(torus(6, 4));
    const Scene scene = Scene::build(mesh.view());
    const auto render = [&](const View& view) { return error_of([&] { scene.render(view); }); };
    for (const std::uint32_t samples : {0u, 2u, 3u, 9u, 100u})
        EXPECT_EQ(render(view_of(Shading::lit, samples)), "bad_argument");
    View large = view_of(Shading::plain, 64);
    large.width = 9000;
    EXPECT_EQ(render(large), "limit");
    large.width = 0xFFFFFFFFu;
    EXPECT_EQ(render(large), "limit");
    View none = view_of(Shading::lit, 1);
    none.ao_count = 0;
    EXPECT_EQ(render(none), "none");
    none.shading = Shading::plain;
    EXPECT_EQ(render(none), "bad_argument");
    EXPECT_EQ(render(view_of(static_cast<Shading>(17), 1)), "bad_argument");

    morphray::MeshView wrong = mesh.view();
    wrong.appearance.smooth = std::span(mesh.triangles).first(3);
    EXPECT_EQ(error_of([&] { Scene::build(wrong); }), "bad_argument");
    const std::vector<std::uint32_t> high(mesh.triangles.size(),
                                          static_cast<std::uint32_t>(mesh.triangles.size()));
    wrong.appearance.smooth = high;
    EXPECT_EQ(error_of([&] { Scene::build(wrong); }), "bad_argument");
}

TEST(Textures, ImageIsUprightFromItsTopRowDown) {
    UserMesh square;
    square.points = {{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}};
    square.triangles = {0, 1, 2, 0, 2, 3};
    const std::vector<float> texcoords = {0, 0, 1, 0, 1, 1, 0, 0, 1, 1, 0, 1};
    // Red and green above, blue and white below.
    const std::vector<std::uint32_t> texels = {0x0000FF, 0x00FF00, 0xFF0000, 0xFFFFFF};
    const std::vector<morphray::TextureView> textures = {
        {.texels = texels, .width = 2, .height = 2, .wrap = morphray::Wrap::clamp}};
    morphray::MeshView mesh = square.view();
    mesh.appearance.textures = textures;
    mesh.appearance.texcoords = texcoords;
    const Image image = Scene::build(mesh).render({.eye = morphray::Point{0, 0, 4},
                                                   .target = morphray::Point{0, 0, 0},
                                                   .fov = 2 * std::atan(0.25) * 180 / M_PI,
                                                   .light = morphray::Point{0, 0, 1000},
                                                   .width = 32,
                                                   .height = 32,
                                                   .shading = Shading::lit});
    const auto at = [&](std::size_t x, std::size_t y) { return image.pixels[32 * y + x]; };
    const auto is_on = [](std::uint32_t pixel, int k) { return (pixel >> (8 * k) & 0xFF) > 128; };
    for (int k = 0; k < 3; ++k) {
        EXPECT_EQ(is_on(at(4, 4), k), k == 0);
        EXPECT_EQ(is_on(at(27, 4), k), k == 1);
        EXPECT_EQ(is_on(at(4, 27), k), k == 2);
        EXPECT_TRUE(is_on(at(27, 27), k));
    }
}

/// A coarse ball around the origin with its smooth normals, in doubles: the sums of the triangles'
/// normals times the angles of their corners.
struct Ball {
    explicit Ball(int levels) : mesh(icosphere(levels)), normals(mesh.points.size(), dvec3(0)) {
        for (std::size_t i = 0; i < mesh.triangles.size(); i += 3) {
            const dvec3 a = corner(i);
            const dvec3 n = glm::normalize(glm::cross(corner(i + 1) - a, corner(i + 2) - a));
            for (std::size_t k = 0; k < 3; ++k) {
                const dvec3 to_next = corner(i + (k + 1) % 3) - corner(i + k);
                const dvec3 to_last = corner(i + (k + 2) % 3) - corner(i + k);
                const double angle =
                    std::acos(glm::dot(glm::normalize(to_next), glm::normalize(to_last)));
                normals[mesh.triangles[i + k]] += angle * n;
            }
        }
        for (dvec3& n : normals) n = glm::normalize(n);
    }

    dvec3 corner(std::size_t i) const {
        const morphray::Vec3& p = mesh.points[mesh.triangles[i]];
        return {p.x, p.y, p.z};
    }
    /// The cosine between the smooth normal at a hit and the direction to the light.
    double facing(const morphray::Hit& hit, const Point& light) const {
        const double weights[] = {1.0 - hit.u - hit.v, hit.u, hit.v};
        dvec3 point(0), normal(0);
        for (std::size_t k = 0; k < 3; ++k) {
            const std::size_t i = std::size_t{3} * hit.prim_id + k;
            point += weights[k] * corner(i);
            normal += weights[k] * normals[mesh.triangles[i]];
        }
        const dvec3 to_light = dvec3(light[0], light[1], light[2]) - point;
        return glm::dot(glm::normalize(normal), glm::normalize(to_light));
    }

    UserMesh mesh;
    std::vector<dvec3> normals;
};

constexpr Point kEyes[] = {{0, 0, 4}, {3, 2, 1}, {-2, -3, 2}};
constexpr Point kLights[] = {{0, 9, 0}, {5, 3, 4}, {-7, 1, -2}, {1.5, 1.5, 0.5}, {400, -90, 30}};

/// The number of pixels in shadow whose smooth normal faces the light.
int dark_pixels(const Ball& ball, const Scene& scene, bool flat) {
    int dark = 0;
    for (const Point& eye : kEyes) {
        for (const Point& light : kLights) {
            const Image image = scene.render({.eye = eye,
                                              .target = Point{0, 0, 0},
                                              .light = light,
                                              .width = 96,
                                              .height = 80,
                                              .shading = Shading::lit,
                                              .flat = flat,
                                              .ao_count = 0});
            for (std::size_t i = 0; i < image.hits.size(); ++i) {
                if (!image.hits[i] || image.occlusion[i] == 0) continue;
                // Beyond the rounding of the cosine of floats.
                dark += ball.facing(image.hits[i], light) > 1e-6 ? 1 : 0;
            }
        }
    }
    return dark;
}

TEST(SmoothShadows, NothingThatFacesTheLightIsDarkOnACoarseBall) {
    for (const int levels : {1, 2, 3}) {
        const Ball ball(levels);
        const Scene scene = Scene::build(smooth_view(ball.mesh));
        EXPECT_EQ(dark_pixels(ball, scene, false), 0) << levels;
        EXPECT_GT(dark_pixels(ball, scene, true), 100) << levels;
    }
}

std::vector<View> views() {
    std::vector<View> views;
    for (const std::uint32_t samples : {1u, 4u}) {
        for (const std::uint32_t ao_count : {0u, 3u})
            views.push_back(view_of_leaves(samples, ao_count));
    }
    return views;
}

TEST(Holes, MeshThatIsAllHolesIsAsIfItWereNotThere) {
    const Ground ground;
    const Leaf leaf({kClear, kClear});
    const Scene with = build({ground.view(), leaf.view(), leaf.view()});
    const Scene without = build({ground.view()});
    for (const View& view : views()) {
        const Image image = with.render(view);
        const Image expected = without.render(view);
        EXPECT_EQ(image.pixels, expected.pixels);
        EXPECT_EQ(image.hits, expected.hits);
        EXPECT_EQ(image.occlusion, expected.occlusion);
        EXPECT_GT(image.ray_count, expected.ray_count);
    }
}

TEST(Holes, CountTheRaysThatPassThem) {
    const Ground ground;
    const Leaf clear({kClear, kClear}), solid({kSolid, kSolid});
    View view = view_of_leaves(1, 0);
    // Shadow rays go back the way of the camera's.
    view.light = view.eye;
    const Image image = build({ground.view(), clear.view()}).render(view);
    const Image before = build({ground.view(), solid.view()}).render(view);
    const Image behind = build({ground.view()}).render(view);
    std::uint64_t hit_count = 0, leaf_count = 0, changed_count = 0;
    for (std::size_t i = 0; i < before.hits.size(); ++i) {
        const bool is_leaf = before.hits[i].geom_id == 1;
        hit_count += before.hits[i] ? 1 : 0;
        leaf_count += is_leaf ? 1 : 0;
        changed_count += is_leaf && behind.hits[i] ? 1 : 0;
    }
    ASSERT_GT(changed_count, 0u);
    EXPECT_EQ(before.ray_count, before.hits.size() + hit_count);
    // A camera ray goes on behind the leaf; the surface there has a shadow ray, which goes on, too.
    EXPECT_EQ(image.ray_count, before.ray_count + leaf_count + 2 * changed_count);
}

TEST(Holes, HalfOfATextureIsHalfOfAMesh) {
    const Ground ground;
    const Leaf leaf({kClear, kSolid});
    Leaf half({kSolid, kSolid});
    half.points[0].x = half.points[3].x = 0;
    for (const View& view : views()) {
        const Image image = build({ground.view(), leaf.view()}).render(view);
        const Image expected = build({ground.view(), half.view()}).render(view);
        const Image whole = build({ground.view(), Leaf({kSolid, kSolid}).view()}).render(view);
        EXPECT_EQ(image.pixels, expected.pixels);
        EXPECT_EQ(image.occlusion, expected.occlusion);
        EXPECT_NE(image.pixels, whole.pixels);
        EXPECT_NE(image.occlusion, whole.occlusion) << "the light passes, too";
    }
}

TEST(Holes, AreTheSameOnEveryDeviceOfTheCpu) {
    const RandomLeaves leaves;
    const Scene scene = build(leaves.views());
    std::vector<Scene> others;
    others.push_back(scene.on(Device::brute_force()));
    for (const std::string& simd : all_simd())
        others.push_back(scene.on(Device::cpu({.threads = 1, .simd = simd})));
    for (const View& view : views()) {
        const Image image = scene.render(view);
        for (const Scene& other : others)
            EXPECT_TRUE(morphray::compare(image, other.render(view)).equal());
    }
}

TEST(Holes, ConcernLitImagesAlone) {
    const Ground ground;
    const Leaf leaf({kClear, kClear}), solid({kSolid, kSolid});
    const Scene scene = build({ground.view(), leaf.view()});
    const Scene expected = build({ground.view(), solid.view()});
    for (const Shading shading : {Shading::plain, Shading::normal, Shading::depth, Shading::prim}) {
        View view = view_of_leaves(1, 1);
        view.shading = shading;
        EXPECT_EQ(scene.render(view).pixels, expected.render(view).pixels);
    }
    const morphray::Ray down = {.org = {0.25f, 0.25f, 2}, .dir = {0, 0, -1}};
    EXPECT_EQ(scene.intersect(down).geom_id, 1u);
}

TEST(View, WithoutHitsHasTheSamePixels) {
    const UserMesh mesh(torus(30, 20));
    const Scene scene = Scene::build(mesh.view());
    for (const Shading shading : {Shading::plain, Shading::lit, Shading::prim}) {
        View view{.width = 45, .height = 31, .shading = shading, .samples = 4};
        const Image whole = scene.render(view);
        view.hits = false;
        const Image pixels = scene.render(view);
        EXPECT_EQ(pixels.pixels, whole.pixels);
        EXPECT_EQ(pixels.ray_count, whole.ray_count);
        EXPECT_EQ(pixels.width, 45u);
        EXPECT_EQ(pixels.height, 31u);
        EXPECT_TRUE(pixels.hits.empty());
        EXPECT_TRUE(pixels.occlusion.empty());
        EXPECT_EQ(pixels.image_hash, whole.image_hash);
        EXPECT_EQ(pixels.hits_hash, 0u);
    }
}

TEST(View, ThatIsCancelledThrowsAndTheNextIsWhole) {
    const UserMesh mesh(torus(30, 20));
    const Scene scene = Scene::build(mesh.view());
    std::atomic<bool> cancel = true;
    View view{.width = 64, .height = 64, .shading = Shading::lit};
    const Image expected = scene.render(view);
    view.cancel = &cancel;
    EXPECT_EQ(error_of([&] { scene.render(view); }), "cancelled");
    view.shading = Shading::plain;
    EXPECT_EQ(error_of([&] { scene.render(view); }), "cancelled");
    view.shading = Shading::lit;
    cancel = false;
    EXPECT_EQ(scene.render(view).pixels, expected.pixels);
}

TEST(View, OfAnySizeSamplesAndShadingIsCancelledBeforeItIsDone) {
    const UserMesh mesh(torus(100, 80));
    const Scene scene = Scene::build(mesh.view());
    // Each takes minutes if nothing ends it.
    for (const Device& device : {Device::cpu(), Device::brute_force()}) {
        const Scene on_device = scene.on(device);
        for (View view : {View{.rays = morphray::Rays::ao}, View{.shading = Shading::lit},
                          View{.shading = Shading::lit, .samples = 16}}) {
            view.width = view.height = view.samples == 1 ? 4096 : 1024;
            view.ao_count = 256;
            std::atomic<bool> cancel = false;
            view.cancel = &cancel;
            std::thread other([&] {
                std::this_thread::sleep_for(std::chrono::milliseconds(50));
                cancel = true;
            });
            EXPECT_EQ(error_of([&] { on_device.render(view); }), "cancelled");
            other.join();
        }
    }
}

TEST(SceneBuild, IsCancelled) {
    UserMesh mesh(torus(100, 80));
    std::atomic<bool> cancel = true;
    const morphray::SceneOptions options{.update = morphray::Rebuild{}, .cancel = &cancel};
    EXPECT_EQ(error_of([&] { Scene::build(mesh.view(), Device::cpu(), options); }), "cancelled");
    cancel = false;
    Scene scene = Scene::build(mesh.view(), Device::cpu(), options);
    EXPECT_EQ(scene.tree_statistics().hash,
              Scene::build(mesh.view(), Device::cpu()).tree_statistics().hash);
    cancel = true;
    mesh.points[0].x += 0.1f;
    EXPECT_EQ(error_of([&] { scene.update(); }), "cancelled");
    // It is of no use any more.
    cancel = false;
    const Ray ray{.org = {0, 0, 5}, .dir = {0, 0, -1}};
    const Hit hit{.t = 1, .prim_id = 0, .geom_id = 0};
    const std::function<void()> calls[] = {[&] { scene.update(); },
                                           [&] { scene.render({.width = 8, .height = 8}); },
                                           [&] { scene.intersect(ray); },
                                           [&] { scene.intersect(ray, hit); },
                                           [&] { scene.occluded(ray); },
                                           [&] {
                                               scene.intersect_all({&ray, 1});
                                           },
                                           [&] { scene.tree_statistics(); },
                                           [&] { scene.tree_boxes(0); },
                                           [&] { scene.update_with_new_bounds(); }};
    for (const std::function<void()>& call : calls) EXPECT_EQ(error_of(call), "cancelled");
}

TEST(TreeBoxes, CoverTheSceneAtEachDepth) {
    const UserMesh mesh(torus(60, 40));
    const Scene scene = Scene::build(mesh.view());
    const Box bounds = scene.bounds();
    const std::uint32_t depth = scene.tree_statistics().depth;
    ASSERT_GE(depth, 2u);
    ASSERT_EQ(scene.tree_boxes(0).size(), 1u);
    EXPECT_GT(scene.tree_boxes(1).size(), 1u);
    EXPECT_LE(scene.tree_boxes(1).size(), 16u);
    for (std::uint32_t i = 0; i < 2; ++i) {
        Box all = scene.tree_boxes(i).front();
        for (const Box& box : scene.tree_boxes(i)) {
            for (std::size_t k = 0; k < 3; ++k) {
                EXPECT_LE(box.lower[k], box.upper[k]);
                all.lower[k] = std::min(all.lower[k], box.lower[k]);
                all.upper[k] = std::max(all.upper[k], box.upper[k]);
            }
        }
        // Boxes of leaves have a pad.
        for (std::size_t k = 0; k < 3; ++k) {
            EXPECT_LE(all.lower[k], bounds.lower[k]);
            EXPECT_GE(all.upper[k], bounds.upper[k]);
        }
    }
    EXPECT_TRUE(scene.tree_boxes(depth + 1).empty());
    EXPECT_TRUE(scene.tree_boxes(0xFFFFFFFFu).empty());
}

TEST(HitsFile, IsReadBackAsItWasWritten) {
    const TemporaryFolder folder;
    const std::string file = folder.write("a.hits", "").string();
    const UserMesh mesh(torus(24, 16));
    const morphray::Scene scene = morphray::Scene::build(mesh.view());
    const morphray::Image images[] = {
        scene.render({.width = 31, .height = 17}),
        scene.render({.width = 31, .height = 17, .rays = morphray::Rays::ao, .ao_count = 3})};
    morphray::HitsWriter writer(31, 17);
    for (const morphray::Image& image : images) writer.add(image);
    writer.write(file);
    EXPECT_EQ(read_file(file).size(), 20 + 2 * 31 * 17 * 20u);
    const morphray::HitsFile read = morphray::read_hits(file);
    EXPECT_EQ(read.width, 31u);
    EXPECT_EQ(read.height, 17u);
    ASSERT_EQ(read.images.size(), 2u);
    for (int i = 0; i < 2; ++i) {
        expect_same_hits(read.images[i].hits, images[i].hits);
        EXPECT_EQ(read.images[i].occlusion, images[i].occlusion);
        EXPECT_GT(count_hits(read.images[i].hits), 50u);
    }
}

TEST(HitsFile, HasImagesOfOneShape) {
    const UserMesh mesh(icosphere(2));
    const morphray::Scene scene = morphray::Scene::build(mesh.view());
    morphray::HitsWriter writer(8, 4);
    for (const auto& [width, height, samples] :
         {std::array{4u, 8u, 1u}, {16u, 2u, 1u}, {8u, 4u, 4u}, {2u, 4u, 4u}}) {
        const morphray::Image image =
            scene.render({.width = width, .height = height, .samples = samples});
        EXPECT_EQ(error_of([&] { writer.add(image); }), "bad_argument") << width;
    }
    writer.add(scene.render({.width = 8, .height = 4}));
    writer.add(scene.render({.width = 4, .height = 2, .samples = 4}));
}

}  // namespace
}  // namespace mray::test
