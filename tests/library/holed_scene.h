// Leaves above a ground, for tests of holes.
#pragma once

#include <cstdint>
#include <vector>

#include "tests/library/scenes.h"

namespace mray::test {

inline constexpr std::uint32_t kSolid = 0xFFFFFFFF;
inline constexpr std::uint32_t kClear = 0x00FFFFFF;

struct Ground : UserMesh {
    Ground() {
        points = {{-2, -2, 0}, {2, -2, 0}, {2, 2, 0}, {-2, 2, 0}};
        triangles = {0, 1, 2, 0, 2, 3};
    }
};

/// A square at a height with a texture of two texels, left and right.
struct Leaf : UserMesh {
    explicit Leaf(std::vector<std::uint32_t> image, float height = 1) : texels(std::move(image)) {
        points = {{-1, -1, height}, {1, -1, height}, {1, 1, height}, {-1, 1, height}};
        triangles = {0, 1, 2, 0, 2, 3};
        textures = {{.texels = texels,
                     .width = 2,
                     .height = 1,
                     .wrap = morphray::Wrap::clamp,
                     .alpha_cutoff = 0.5f}};
    }
    Leaf(const Leaf&) = delete;

    morphray::MeshView view() const {
        static constexpr float kCorners[] = {0, 0, 1, 0, 1, 1, 0, 0, 1, 1, 0, 1};
        morphray::MeshView mesh = UserMesh::view();
        mesh.appearance.textures = textures;
        mesh.appearance.texcoords = kCorners;
        return mesh;
    }

    std::vector<std::uint32_t> texels;
    std::vector<morphray::TextureView> textures;
};

/// A ground, a torus, and leaves with textures of random alphas, which they show more than once.
class RandomLeaves {
public:
    RandomLeaves() : torus_(torus(30, 20)) {
        Random random(3);
        for (std::uint32_t i = 0; i < 12 * 5; ++i)
            texels_.push_back(static_cast<std::uint32_t>(random.bits()));
        textures_ = {{.texels = texels_, .width = 12, .height = 5, .alpha_cutoff = 0.5f},
                     {.texels = texels_,
                      .width = 5,
                      .height = 12,
                      .wrap = morphray::Wrap::clamp,
                      .alpha_cutoff = 0.75f},
                     {.texels = texels_, .width = 10, .height = 6}};
        for (int i = 0; i < 40; ++i) {
            const vec3 centre = random.point(1.5);
            for (int k = 0; k < 3; ++k) {
                const vec3 p = random.point(0.75);
                leaves_.triangles.push_back(static_cast<std::uint32_t>(leaves_.points.size()));
                leaves_.points.push_back({centre.x + p.x, centre.y + p.y, 1.5f + centre.z + p.z});
            }
            for (int k = 0; k < 6; ++k)
                texcoords_.push_back(static_cast<float>(random.real(-1, 2)));
            ids_.push_back(random.below(4) == 0 ? morphray::kNoTexture : random.below(3));
        }
    }
    RandomLeaves(const RandomLeaves&) = delete;

    std::vector<morphray::MeshView> views() const {
        morphray::MeshView leaves = leaves_.view();
        leaves.appearance.textures = textures_;
        leaves.appearance.texcoords = texcoords_;
        leaves.appearance.texture_ids = ids_;
        return {ground_.view(), torus_.view(), leaves};
    }

private:
    Ground ground_;
    UserMesh torus_;
    UserMesh leaves_;
    std::vector<std::uint32_t> texels_;
    std::vector<morphray::TextureView> textures_;
    std::vector<float> texcoords_;
    std::vector<std::uint32_t> ids_;
};

/// A lit view from above the leaves; numbers are odd, so that no sample is at a border of texels.
inline morphray::View view_of_leaves(std::uint32_t samples, std::uint32_t ao_count) {
    return {.eye = morphray::Point{0.37, -2.91, 5.13},
            .target = morphray::Point{0.11, 0.07, 0.5},
            .up = {0, 0, 1},
            .light = morphray::Point{1.73, 1.31, 7.57},
            .width = 61,
            .height = 43,
            .shading = morphray::Shading::lit,
            .samples = samples,
            .ao_count = ao_count,
            .ao_distance = 2};
}

inline morphray::Scene build(const std::vector<morphray::MeshView>& meshes,
                             const morphray::Device& device = morphray::Device::cpu()) {
    return morphray::Scene::build(std::span<const morphray::MeshView>(meshes), device,
                                  {.bounds = morphray::Box{{-4, -4, -4}, {4, 4, 4}}});
}

}  // namespace mray::test
