// One scene on two devices: after each pose every hit is compared bit by bit. Without a Vulkan
// device the second one is brute force.
#include <cstdio>
#include <morphray/morphray.hpp>

namespace mr = morphray;

namespace {

mr::Device second_device() {
    try {
        return mr::Device::vulkan();
    } catch (const mr::Error& error) {
        if (error.code() != mr::ErrorCode::unavailable) throw;
        std::printf("%s: checking against brute force\n", error.what());
        return mr::Device::brute_force();
    }
}

// Numbers in [-1, 1) that are the same on every machine.
class Numbers {
public:
    float next() {
        state_ = state_ * 6364136223846793005u + 1442695040888963407u;
        return static_cast<float>(state_ >> 40) * 0x1p-23f - 1;
    }
    mr::Vec3 point() {
        const float x = next(), y = next(), z = next();
        return {x, y, z};
    }

private:
    std::uint64_t state_ = 1;
};

}  // namespace

int main() {
    // Triangles at random that shrink and grow.
    Numbers numbers;
    constexpr std::size_t kTriangles = 500;
    std::vector<mr::Vec3> centres(kTriangles), points(3 * kTriangles), corners(3 * kTriangles);
    std::vector<std::uint32_t> triangles(3 * kTriangles);
    for (mr::Vec3& centre : centres) centre = numbers.point();
    for (mr::Vec3& corner : corners) corner = numbers.point();
    for (std::uint32_t i = 0; i < triangles.size(); ++i) triangles[i] = i;
    const auto simulate = [&](int pose) {
        const float size = 0.1f + 0.05f * static_cast<float>(pose);
        for (std::size_t i = 0; i < points.size(); ++i) {
            const mr::Vec3& centre = centres[i / 3];
            points[i] = {centre.x + size * corners[i].x, centre.y + size * corners[i].y,
                         centre.z + size * corners[i].z};
        }
    };
    std::vector<mr::Ray> rays(20000);
    for (mr::Ray& ray : rays) ray = {.org = numbers.point(), .dir = numbers.point()};

    simulate(0);
    const mr::MeshView mesh{mr::packed(points), triangles};
    const mr::SceneOptions options{.bounds = mr::Box{{-2, -2, -2}, {2, 2, 2}}};
    mr::Scene first = mr::Scene::build(mesh, mr::Device::cpu(), options);
    mr::Scene second = mr::Scene::build(mesh, second_device(), options);
    std::printf("%s\n%s\n", first.device().description().c_str(),
                second.device().description().c_str());
    bool equal = true;
    for (int pose = 0; pose < 4; ++pose) {
        simulate(pose);
        first.update();
        second.update();
        const mr::Comparison comparison = mr::compare(first, second, rays);
        std::printf("pose %d: %s\n", pose, mr::describe(comparison).c_str());
        equal = equal && comparison.equal() && comparison.compared == rays.size();
    }
    return equal ? 0 : 1;
}
