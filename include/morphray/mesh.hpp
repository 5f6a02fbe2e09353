// The caller's arrays, read in place.
#pragma once

#include <cstddef>
#include <cstdint>
#include <iterator>
#include <memory>
#include <span>
#include <type_traits>

#include "morphray/geometry.hpp"

namespace morphray {

/// `count` positions, three floats each, `stride` bytes apart. Any alignment. The array is
/// borrowed.
struct Positions {
    const void* data = nullptr;
    std::size_t count = 0;
    std::size_t stride = sizeof(Vec3);
};

/// The positions of an array of the caller's vertices. `member` is the member with the position:
/// float[3], std::array<float, 3>, Vec3 or any other type of at least 12 bytes that begins with
/// three floats.
///
///     struct Vertex { float normal[3]; float position[3]; };
///     std::vector<Vertex> vertices;
///     Positions positions = morphray::strided(vertices, &Vertex::position);
template <class Array, class Vertex, class Member>
Positions strided(const Array& vertices, Member Vertex::*member) {
    static_assert(std::is_standard_layout_v<Member> && sizeof(Member) >= sizeof(Vec3));
    if (std::size(vertices) == 0) return {nullptr, 0, sizeof(Vertex)};
    const Vertex* first = std::data(vertices);
    return {std::addressof(first->*member), std::size(vertices), sizeof(Vertex)};
}

/// An array of vertices that are positions and nothing else: Vec3, std::array<float, 3>, ...
template <class Array>
Positions packed(const Array& points) {
    using Element = std::remove_cvref_t<decltype(*std::data(points))>;
    static_assert(std::is_standard_layout_v<Element> && sizeof(Element) >= sizeof(Vec3));
    return {std::data(points), std::size(points), sizeof(Element)};
}

/// A mesh of triangles in the caller's memory. `positions` are read by Scene::build(), attach() and
/// each update(), so they must stay where they are until the mesh is detached or the scene is
/// destroyed. `triangles` and `albedo` are copied once. Any mesh is accepted, also one without
/// triangles; positions that are NaN or infinite make their triangles unhittable.
struct MeshView {
    Positions positions = {};
    /// Three indices of positions for each triangle.
    std::span<const std::uint32_t> triangles = {};
    /// Whether update() reads the positions again. A mesh that does not deform costs nothing there.
    bool deforms = true;
    /// For images, the colour of each triangle: linear, 8 bits a channel, red in bits 0 to 7, green
    /// in 8 to 15, blue in 16 to 23. Empty: light grey.
    std::span<const std::uint32_t> albedo = {};
    /// For lit images, three numbers for each triangle. Corners with the same number share a
    /// normal, the mean of their triangles at the current pose, so that these look smooth together;
    /// at creases of more than 37 degrees they stay flat. `triangles` itself makes all of the mesh
    /// smooth, without memory for it. Empty: every triangle is flat. Numbers are below the number
    /// of corners. Copied once.
    std::span<const std::uint32_t> smooth = {};
    /// In lit images the mesh shows the background, darkened by shadows and occlusion: for a plane
    /// that the scene stands on.
    bool backdrop = false;
};

}  // namespace morphray
