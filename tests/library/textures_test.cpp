// Meshes with textures.
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "tests/library/scenes.h"

namespace mray::test {
namespace {

using morphray::Device;
using morphray::Image;
using morphray::kNoTexture;
using morphray::MeshView;
using morphray::Scene;
using morphray::Shading;
using morphray::TextureView;
using morphray::View;

View textured_view(std::uint32_t samples = 1) {
    return {.width = 45, .height = 31, .shading = Shading::lit, .samples = samples, .ao_count = 2};
}

/// A mesh whose triangles show parts of images.
struct TexturedMesh : UserMesh {
    explicit TexturedMesh(const TestScene& scene, std::uint64_t seed = 5) : UserMesh(scene) {
        Random random(seed);
        for (std::size_t i = 0; i < 2 * triangles.size(); ++i)
            texcoords.push_back(static_cast<float>(random.real(-1, 2)));
        for (std::size_t i = 0; i < triangles.size() / 3; ++i)
            ids.push_back(random.below(3) == 0 ? kNoTexture : random.below(2));
        for (std::uint32_t i = 0; i < 64; ++i)
            texels.push_back(static_cast<std::uint32_t>(random.bits()));
        textures = {{.texels = texels, .width = 16, .height = 4},
                    {.texels = std::span(texels).first(15),
                     .width = 3,
                     .height = 5,
                     .wrap = morphray::Wrap::clamp}};
    }
    TexturedMesh(const TexturedMesh&) = delete;

    MeshView textured() const {
        MeshView mesh = view();
        mesh.textures = textures;
        mesh.texcoords = texcoords;
        mesh.texture_ids = ids;
        return mesh;
    }

    std::vector<float> texcoords;
    std::vector<std::uint32_t> ids;
    std::vector<std::uint32_t> texels;
    std::vector<TextureView> textures;
};

/// A square in the plane z = 0 that fills the view, with the corners of an image.
struct TexturedSquare : UserMesh {
    TexturedSquare() {
        points = {{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}};
        triangles = {0, 1, 2, 0, 2, 3};
        texcoords = {0, 0, 1, 0, 1, 1, 0, 0, 1, 1, 0, 1};
    }
    MeshView textured(std::span<const TextureView> textures) const {
        MeshView mesh = view();
        mesh.textures = textures;
        mesh.texcoords = texcoords;
        return mesh;
    }
    std::vector<float> texcoords;
};

View square_view(std::uint32_t size) {
    return {.eye = morphray::Point{0, 0, 4},
            .target = morphray::Point{0, 0, 0},
            .fov = 2 * std::atan(0.25) * 180 / M_PI,
            .light = morphray::Point{0, 0, 1000},
            .width = size,
            .height = size,
            .shading = Shading::lit};
}

TEST(Textures, AreTheSameOnEveryDevice) {
    const TexturedMesh mesh(torus(30, 20));
    const Scene scene = Scene::build(mesh.textured());
    const Scene brute = scene.on(Device::brute_force());
    const Scene scalar = scene.on(Device::cpu({.threads = 1, .simd = "off"}));
    for (const std::uint32_t samples : {1u, 4u, 16u}) {
        const Image image = scene.render(textured_view(samples));
        for (const Scene* other : {&brute, &scalar})
            EXPECT_TRUE(morphray::compare(image, other->render(textured_view(samples))).equal());
    }
    EXPECT_NE(Scene::build(mesh.view()).render(textured_view()).pixels,
              scene.render(textured_view()).pixels);
}

TEST(Textures, ImageIsUprightFromItsTopRowDown) {
    const TexturedSquare square;
    // Red and green above, blue and white below.
    const std::vector<std::uint32_t> texels = {0x0000FF, 0x00FF00, 0xFF0000, 0xFFFFFF};
    const std::vector<TextureView> textures = {
        {.texels = texels, .width = 2, .height = 2, .wrap = morphray::Wrap::clamp}};
    const Image image = Scene::build(square.textured(textures)).render(square_view(32));
    const auto at = [&](std::size_t x, std::size_t y) { return image.pixels[32 * y + x]; };
    const auto is_on = [](std::uint32_t pixel, int k) { return (pixel >> (8 * k) & 0xFF) > 128; };
    for (int k = 0; k < 3; ++k) {
        EXPECT_EQ(is_on(at(4, 4), k), k == 0);
        EXPECT_EQ(is_on(at(27, 4), k), k == 1);
        EXPECT_EQ(is_on(at(4, 27), k), k == 2);
        EXPECT_TRUE(is_on(at(27, 27), k));
    }
}

}  // namespace
}  // namespace mray::test
