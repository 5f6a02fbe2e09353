#include "tests/fuzz/shrink/shrink_parts.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numbers>
#include <type_traits>

#include <glm/geometric.hpp>

namespace mray::fuzz {
namespace {

using glm::dvec3;

/// The axes of the camera for eye, target, up and fov.
struct Axes {
    dvec3 right, up, forward;
    /// Half of the image's height at distance 1.
    double half;
};
Axes axes_of(const ViewSpec& view) {
    Axes axes;
    axes.forward = glm::normalize(to_dvec3(*view.target) - to_dvec3(*view.eye));
    axes.right = glm::normalize(glm::cross(axes.forward, glm::normalize(to_dvec3(view.up))));
    axes.up = glm::cross(axes.right, axes.forward);
    axes.half = std::tan(view.fov * (std::numbers::pi / 360));
    return axes;
}

/// The part of width x height pixels at (left, top), seen by a camera that looks at its middle.
ViewSpec part_of(const ViewSpec& view, double left, double top, std::uint32_t width,
                 std::uint32_t height) {
    const Axes axes = axes_of(view);
    const double pixel = 2 * axes.half / view.height;
    const double x = (left + width / 2.0 - view.width / 2.0) * pixel;
    const double y = (view.height / 2.0 - top - height / 2.0) * pixel;
    const dvec3 towards = axes.forward + axes.right * x + axes.up * y;
    const dvec3 eye = to_dvec3(*view.eye);
    ViewSpec part = view;
    part.width = width;
    part.height = height;
    part.target = to_point(eye + towards * glm::length(to_dvec3(*view.target) - eye));
    part.fov = std::atan(height * pixel / (2 * glm::length(towards))) * (360 / std::numbers::pi);
    return part;
}

/// Calls `visit` for each number until it returns true.
template <class Case, class Visit>
void for_each_number(Case& fuzz_case, const Visit& visit) {
    if (fuzz_case.has_image()) {
        auto& view = fuzz_case.view;
        for (auto* point : {&view.eye, &view.target, &view.light}) {
            if (!*point) continue;
            for (auto& x : **point)
                if (visit(x)) return;
        }
        for (auto& x : view.up)
            if (visit(x)) return;
        if (visit(view.fov) || visit(view.ao_distance)) return;
    }
    for (auto& ray : fuzz_case.rays) {
        for (auto& x : ray.org)
            if (visit(x)) return;
        for (auto& x : ray.dir)
            if (visit(x)) return;
        if (visit(ray.tnear) || visit(ray.tfar)) return;
    }
    for (auto& point : fuzz_case.points) {
        for (int axis = 0; axis < 3; ++axis)
            if (visit(point[axis])) return;
    }
    for (auto& pose : fuzz_case.poses) {
        for (auto& v : pose) {
            for (int axis = 0; axis < 3; ++axis)
                if (visit(v[axis])) return;
        }
    }
}

double rounded(double x, int bits) {
    if (bits == 0 || !std::isfinite(x)) return 0;
    if (x == 0) return 0;
    const int exponent = std::ilogb(x);
    return std::ldexp(std::nearbyint(std::ldexp(x, bits - 1 - exponent)), exponent - bits + 1);
}

}  // namespace

std::vector<FuzzCase> with_fewer_poses(const FuzzCase& fuzz_case) {
    std::vector<FuzzCase> fewer;
    if (fuzz_case.poses.size() == 1) return fewer;
    FuzzCase alone = fuzz_case;
    const std::vector<vec3> traced = world_positions(fuzz_case, fuzz_case.frame);
    alone.poses = {traced};
    alone.frame = 0;
    alone.build_at = 0;
    fewer.push_back(alone);
    if (fuzz_case.poses.size() > 2 || std::floor(fuzz_case.frame) != fuzz_case.frame) {
        alone.poses = {fuzz_case.poses[fuzz_case.build_at], traced};
        alone.frame = 1;
        fewer.push_back(alone);
    }
    return fewer;
}

std::vector<std::uint32_t> idle_vertices(const FuzzCase& fuzz_case) {
    std::vector<bool> used(fuzz_case.poses.front().size());
    for (const uvec3& t : fuzz_case.triangles) used[t.x] = used[t.y] = used[t.z] = true;
    std::vector<std::uint32_t> idle;
    for (std::uint32_t i = 0; i < used.size(); ++i)
        if (!used[i]) idle.push_back(i);
    return idle;
}

FuzzCase without_idle_vertices(const FuzzCase& fuzz_case, std::size_t first, std::size_t count) {
    const std::vector<std::uint32_t> idle = idle_vertices(fuzz_case);
    const auto begin = idle.begin() + static_cast<std::ptrdiff_t>(first);
    const auto end = begin + static_cast<std::ptrdiff_t>(count);
    FuzzCase result = fuzz_case;
    for (auto& pose : result.poses) pose.clear();
    std::vector<std::uint32_t> place(fuzz_case.poses.front().size());
    for (std::uint32_t i = 0; i < place.size(); ++i) {
        if (std::binary_search(begin, end, i)) continue;
        place[i] = static_cast<std::uint32_t>(result.poses.front().size());
        for (std::size_t p = 0; p < result.poses.size(); ++p)
            result.poses[p].push_back(fuzz_case.poses[p][i]);
    }
    for (uvec3& t : result.triangles) t = uvec3(place[t.x], place[t.y], place[t.z]);
    return result;
}

std::vector<ViewSpec> with_simpler_rays(const ViewSpec& view) {
    std::vector<ViewSpec> simpler;
    const auto add = [&](std::uint32_t rays, std::uint32_t count) {
        ViewSpec with = view;
        with.rays = rays;
        with.ao_count = count;
        if (rays != view.rays || count != view.ao_count) simpler.push_back(with);
    };
    add(kRaysPrimary, 1);
    if (view.rays != kRaysPrimary) add(kRaysShadow, 1);
    if (view.rays == kRaysAo) {
        add(kRaysAo, 1);
        add(kRaysAo, 2);
        if (view.ao_count > 3) add(kRaysAo, 3);
    }
    return simpler;
}

std::vector<ViewSpec> with_fewer_pixels(const ViewSpec& view, std::uint32_t x, std::uint32_t y) {
    std::vector<ViewSpec> fewer;
    if (!view.eye || !view.target) return fewer;
    for (const std::uint32_t side : {1u, 2u, 3u, 4u, 5u, 8u, 9u, 16u, 17u, 32u, 33u, 64u, 128u}) {
        const std::uint32_t width = std::min(side, view.width);
        const std::uint32_t height = std::min(side, view.height);
        if (width == view.width && height == view.height) break;
        // The first pixel of the part, so that (x, y) is in its middle or next to it.
        const auto begin = [](std::uint32_t middle, std::uint32_t part, std::uint32_t whole) {
            const std::uint32_t half = part / 2;
            return std::min(middle < half ? 0 : middle - half, whole - part);
        };
        fewer.push_back(part_of(view, begin(x, width, view.width), begin(y, height, view.height),
                                width, height));
        ViewSpec same_degrees = view;
        same_degrees.width = width;
        same_degrees.height = height;
        fewer.push_back(same_degrees);
    }
    return fewer;
}

std::size_t number_count(const FuzzCase& fuzz_case) {
    std::size_t count = 0;
    for_each_number(fuzz_case, [&](auto&) {
        ++count;
        return false;
    });
    return count;
}

bool round_number(FuzzCase& fuzz_case, std::size_t index, int bits) {
    bool changed = false;
    for_each_number(fuzz_case, [&](auto& x) {
        if (index-- > 0) return false;
        using Number = std::remove_reference_t<decltype(x)>;
        const Number simpler = static_cast<Number>(rounded(x, bits));
        changed = std::memcmp(&simpler, &x, sizeof x) != 0;
        x = simpler;
        return true;
    });
    return changed;
}

}  // namespace mray::fuzz
