// A sheet with waves: the caller moves its own vertices, the scene reads them in place and says how
// its tree followed. Each pose is checked with a ray down onto each vertex.
#include <cmath>
#include <cstdio>
#include <morphray/morphray.hpp>

struct Vertex {
    float normal[3];
    float position[3];
};

int main() {
    constexpr std::uint32_t kSide = 100;  // vertices
    std::vector<Vertex> vertices(kSide * kSide);
    std::vector<std::uint32_t> triangles;
    for (std::uint32_t z = 0; z + 1 < kSide; ++z) {
        for (std::uint32_t x = 0; x + 1 < kSide; ++x) {
            const std::uint32_t i = z * kSide + x;
            for (const std::uint32_t corner :
                 {i, i + 1, i + kSide, i + 1, i + kSide + 1, i + kSide})
                triangles.push_back(corner);
        }
    }
    const auto simulate = [&](int pose) {
        for (std::uint32_t i = 0; i < vertices.size(); ++i) {
            float* p = vertices[i].position;
            p[0] = static_cast<float>(i % kSide);
            p[2] = static_cast<float>(i / kSide);
            p[1] = 5 * std::sin(0.1f * p[0] + 0.3f * static_cast<float>(pose)) *
                   std::cos(0.05f * p[2]);
        }
    };

    simulate(0);
    const morphray::MeshView mesh{morphray::strided(vertices, &Vertex::position), triangles};
    // The bounds that the sheet moves in fix the bits of all hits.
    morphray::Scene scene =
        morphray::Scene::build(mesh, morphray::Device::cpu(),
                               {.bounds = morphray::Box{{0, -5, 0}, {kSide, 5, kSide}},
                                .update = morphray::Auto{.budget_ms = 2}});
    std::vector<morphray::Ray> rays(vertices.size());
    std::vector<morphray::Hit> hits(vertices.size());
    std::size_t wrong = 0;
    for (int pose = 1; pose <= 10; ++pose) {
        simulate(pose);
        const morphray::Update update = scene.update();
        for (std::size_t i = 0; i < rays.size(); ++i)
            rays[i] = {.org = {vertices[i].position[0], 10, vertices[i].position[2]},
                       .dir = {0, -1, 0}};
        scene.intersect(rays, hits);
        for (std::size_t i = 0; i < hits.size(); ++i)
            wrong += !hits[i] || std::abs(10 - hits[i].t - vertices[i].position[1]) > 1e-4f;
        std::printf("pose %2d: %s in %.2f ms\n", pose, to_string(update.step),
                    update.milliseconds());
    }
    std::printf("%zu of %zu rays are wrong\n", wrong, 10 * rays.size());
    return wrong == 0 ? 0 : 1;
}
