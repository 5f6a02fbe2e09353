// Ambient occlusion for each vertex of a floor with a wall on it. The directions are computed with
// + - * alone, so the baked bytes are the same on every machine, device and number of threads.
#include <array>
#include <cmath>
#include <cstdio>
#include <morphray/morphray.hpp>

namespace mr = morphray;

namespace {

constexpr std::uint32_t kSide = 60;  // squares of the floor, of length 1
constexpr std::size_t kDirections = 256;
constexpr float kOffset = 1e-3f;  // above the floor, so that it does not occlude itself

// Points in the upper half of the unit ball, from a linear congruential generator. The length of a
// direction does not matter, so none is normalised.
std::vector<mr::Vec3> directions() {
    std::vector<mr::Vec3> result;
    std::uint64_t state = 7;
    const auto number = [&] {
        state = state * 6364136223846793005u + 1442695040888963407u;
        return static_cast<float>(state >> 40) * 0x1p-23f - 1;
    };
    while (result.size() < kDirections) {
        const float x = number(), y = number(), z = number();
        const float length2 = x * x + y * y + z * z;
        if (length2 <= 1 && length2 > 0.01f && y > 0) result.push_back({x, y, z});
    }
    return result;
}

// The share of directions in which a vertex sees something, in 255ths.
std::vector<std::uint8_t> bake(const mr::Scene& scene, const std::vector<mr::Vec3>& vertices) {
    const std::vector<mr::Vec3> upwards = directions();
    std::vector<mr::Ray> rays;
    rays.reserve(vertices.size() * upwards.size());
    for (const mr::Vec3& p : vertices)
        for (const mr::Vec3& dir : upwards)
            rays.push_back({.org = {p.x, p.y + kOffset, p.z}, .dir = dir});
    std::vector<std::uint8_t> occluded(rays.size());
    scene.occluded(rays, std::span<std::uint8_t>(occluded));
    std::vector<std::uint8_t> baked(vertices.size());
    for (std::size_t i = 0; i < baked.size(); ++i) {
        std::size_t count = 0;
        for (std::size_t k = 0; k < kDirections; ++k) count += occluded[i * kDirections + k];
        baked[i] = static_cast<std::uint8_t>(255 * count / kDirections);
    }
    return baked;
}

}  // namespace

int main() {
    std::vector<mr::Vec3> floor;
    std::vector<std::uint32_t> floor_triangles;
    for (std::uint32_t z = 0; z <= kSide; ++z)
        for (std::uint32_t x = 0; x <= kSide; ++x)
            floor.push_back({static_cast<float>(x), 0, static_cast<float>(z)});
    for (std::uint32_t z = 0; z < kSide; ++z) {
        for (std::uint32_t x = 0; x < kSide; ++x) {
            const std::uint32_t i = z * (kSide + 1) + x, below = i + kSide + 1;
            for (const std::uint32_t corner : {i, i + 1, below, i + 1, below + 1, below})
                floor_triangles.push_back(corner);
        }
    }
    // A wall at x = 30.5, much longer than the floor and 20 high.
    const std::vector<mr::Vec3> wall = {
        {30.5f, 0, -999}, {30.5f, 0, 999}, {30.5f, 20, 999}, {30.5f, 20, -999}};
    const std::vector<std::uint32_t> wall_triangles = {0, 1, 2, 0, 2, 3};

    const std::array<mr::MeshView, 2> meshes = {mr::MeshView{mr::packed(floor), floor_triangles},
                                                mr::MeshView{mr::packed(wall), wall_triangles}};
    const mr::Scene scene = mr::Scene::build(meshes);
    const std::vector<std::uint8_t> baked = bake(scene, floor);
    // A wall of height h and of no end, at the distance d, hides atan(h / d) / pi of the sky.
    bool right = true;
    for (const std::uint32_t x : {0u, 20u, 30u, 45u, 60u}) {
        const double distance = std::abs(30.5 - x);
        const double expected = std::atan(20 / distance) / 3.14159265358979;
        const double share = baked[(kSide / 2) * (kSide + 1) + x] / 255.0;
        std::printf("%4.1f from the wall: %.3f baked, %.3f expected\n", distance, share, expected);
        right = right && std::abs(share - expected) < 0.06;
    }
    const mr::Scene one_thread =
        mr::Scene::build(meshes, mr::Device::cpu({.threads = 1, .simd = "off"}));
    const bool same = bake(one_thread, floor) == baked;
    std::printf("one thread without SIMD: %s\n", same ? "the same bytes" : "other bytes");
    return right && same ? 0 : 1;
}
