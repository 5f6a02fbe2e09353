// A triangle and a ray that hits it.
#include <cmath>
#include <cstdio>
#include <morphray/morphray.hpp>

int main() {
    const std::vector<morphray::Vec3> points = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    const std::vector<std::uint32_t> triangles = {0, 1, 2};
    const auto scene = morphray::Scene::build({morphray::packed(points), triangles});
    const auto hit = scene.intersect(morphray::Ray{.org = {0.25f, 0.5f, 2}, .dir = {0, 0, -1}});
    std::printf("triangle %u at t %g, u %g, v %g\n", hit.prim_id, hit.t, hit.u, hit.v);

    const bool right = hit && hit.prim_id == 0 && std::abs(hit.t - 2) < 1e-6f &&
                       std::abs(hit.u - 0.25f) < 1e-6f && std::abs(hit.v - 0.5f) < 1e-6f;
    return right ? 0 : 1;
}
