// Rays of `trace`.
#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <iterator>

#include "app/files/ray_reader.h"
#include "common/scene/scene_space.h"
#include "common/scene/world_bounds.h"
#include "tests/fuzz/targets/outcome.h"
#include "tests/fuzz/targets/targets.h"

namespace mray::fuzz {
namespace {

constexpr std::string_view kName = "case.txt";

bool is_finite(const Ray& ray) {
    const vec3 sum = ray.org + ray.dir;
    return std::isfinite(sum.x) && std::isfinite(sum.y) && std::isfinite(sum.z);
}

const SceneSpace& space() {
    static const SceneSpace space([] {
        const double lower[3] = {-1, 0, 2};
        const double upper[3] = {4, 0, 2.5};
        WorldBounds bounds;
        bounds.extend(lower, upper);
        return bounds;
    }());
    return space;
}

void print(const WorldRay& ray, std::string& text) {
    const double numbers[] = {ray.org[0], ray.org[1], ray.org[2], ray.dir[0],
                              ray.dir[1], ray.dir[2], ray.tnear,  ray.tfar};
    for (const double number : numbers) fmt::format_to(std::back_inserter(text), "{:.9g} ", number);
    text += '\n';
}

bool same(double a, double b) {
    return (std::isnan(a) && std::isnan(b)) ||
           std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b);
}

bool same(const WorldRay& a, const WorldRay& b) {
    bool result = same(a.tnear, b.tnear) && same(a.tfar, b.tfar);
    for (int axis = 0; axis < 3; ++axis)
        result = result && same(a.org[axis], b.org[axis]) && same(a.dir[axis], b.dir[axis]);
    return result;
}

/// Reads all rays, and each again from its text.
template <class Reader>
std::string rays_failure(Reader reader, std::uint64_t most) {
    std::uint64_t count = 0;
    std::string text;
    for (WorldRay ray; reader.next(ray); ++count) {
        const SceneRay scene = to_scene(space(), ray);
        if (scene.valid && !is_finite(scene.ray)) return "a valid ray that is not finite";
        text.clear();
        print(ray, text);
        app::RayTextReader again(kName, text);
        WorldRay copy;
        if (!again.next(copy) || !same(ray, copy)) return "another ray is read from its text";
    }
    return count <= most ? "" : "more rays than there can be";
}

}  // namespace

std::string rays_failure(std::string_view bytes) {
    const auto lines = static_cast<std::uint64_t>(std::ranges::count(bytes, '\n')) + 1;
    std::string failure =
        failure_of(kName, [&] { return rays_failure(app::RayTextReader(kName, bytes), lines); });
    if (!failure.empty()) return failure;
    return failure_of(
        kName, [&] { return rays_failure(app::RayBinaryReader(kName, bytes), bytes.size() / 32); });
}

}  // namespace mray::fuzz
