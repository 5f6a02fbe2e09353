// The caller's arrays, read in place.
#pragma once

#include <cstddef>
#include <iterator>
#include <memory>
#include <ranges>
#include <span>
#include <type_traits>
#include <utility>

#include "morphray/error.hpp"
#include "morphray/geometry.hpp"

namespace morphray {

namespace detail {

/// Makes a number of the type that an element of an array of positions begins with.
template <class Element>
auto number_of() {
    if constexpr (std::is_array_v<Element>) {
        return std::remove_cv_t<std::remove_all_extents_t<Element>>{};
    } else if constexpr (requires { typename Element::value_type; }) {
        return typename Element::value_type{};
    } else if constexpr (requires(Element e) { e.x; }) {
        return std::remove_cvref_t<decltype(std::declval<Element>().x)>{};
    } else if constexpr (!requires { Element{std::declval<double>()}; }) {
        // A struct that does not begin with a double is taken to have floats.
        return float{};
    }
}

template <class Element>
using Number = decltype(number_of<Element>());

/// Refuses arrays of other elements, and temporary arrays that are no views.
template <class Array, class Element>
constexpr void check_positions() {
    using Scalar = Number<Element>;
    static_assert(std::is_same_v<Scalar, float> || std::is_same_v<Scalar, double>,
                  "positions are three floats or three doubles each: name the member of a struct "
                  "that has them, strided(vertices, &Vertex::position)");
    if constexpr (!std::is_void_v<Scalar>) {
        static_assert(std::is_standard_layout_v<Element> && sizeof(Element) >= 3 * sizeof(Scalar),
                      "an element begins with three numbers, one after the other");
    }
    static_assert(std::is_lvalue_reference_v<Array> ||
                      std::ranges::borrowed_range<std::remove_cvref_t<Array>>,
                  "positions are borrowed, not copied: give the array a name, and keep it as long "
                  "as the mesh");
}

}  // namespace detail

/// `count` positions, three floats or doubles each, `stride` bytes apart, borrowed, at any
/// alignment. Readers subtract SceneOptions::origin in double, and round to floats.
struct Positions {
    const void* data = nullptr;
    std::size_t count = 0;
    std::size_t stride = sizeof(Vec3);
    bool has_doubles = false;
};

/// Finds a SceneOptions::origin: near the middle of positions of which rounding to floats would
/// move one by more than 1e-6 of their size, else 0. Positions that are not finite, beyond 1e30, or
/// 2^37 times as far from 0 as most do not count. O(positions).
MORPHRAY_API Point find_origin(const Positions& positions);
/// Returns the farthest that rounding moves a coordinate of doubles less an origin; 0 for floats.
MORPHRAY_API double rounding_error(const Positions& positions, const Point& origin);
/// Whether that is more than 1e-6 of the size of the positions. Takes nanoseconds where they are
/// near the origin, else O(positions).
MORPHRAY_API bool rounds_coarsely(const Positions& positions, const Point& origin);

/// The positions of an array of vertices. `member` is float[3], std::array<double, 3>, Vec3 or any
/// other type that begins with three floats or doubles.
///
///     struct Vertex { float normal[3]; float position[3]; };
///     std::vector<Vertex> vertices;
///     Positions positions = morphray::strided(vertices, &Vertex::position);
template <class Array, class Vertex, class Member>
Positions strided(Array&& vertices, Member Vertex::*member) {
    detail::check_positions<Array, Member>();
    constexpr bool kDoubles = std::is_same_v<detail::Number<Member>, double>;
    // The member may be that of a base of the elements.
    constexpr std::size_t kStride = sizeof(*std::data(vertices));
    if (std::size(vertices) == 0) return {nullptr, 0, kStride, kDoubles};
    return {std::addressof(std::data(vertices)->*member), std::size(vertices), kStride, kDoubles};
}

/// The positions of an array of Vec3, std::array<float, 3>, std::array<double, 3>, ...
template <class Array>
Positions packed(Array&& points) {
    using Element = std::remove_cvref_t<decltype(*std::data(points))>;
    detail::check_positions<Array, Element>();
    return {std::data(points), std::size(points), sizeof(Element),
            std::is_same_v<detail::Number<Element>, double>};
}

/// The indices of an array of 4-byte integers, or of std::array of three of them, in place.
template <class Array>
std::span<const std::uint32_t> indices(const Array& triangles) {
    using Element = std::remove_cvref_t<decltype(*std::data(triangles))>;
    if constexpr (std::is_integral_v<Element>) {
        static_assert(sizeof(Element) == 4, "indices are integers of 4 bytes");
        return {reinterpret_cast<const std::uint32_t*>(std::data(triangles)), std::size(triangles)};
    } else {
        static_assert(std::is_integral_v<typename Element::value_type> &&
                          sizeof(typename Element::value_type) == 4 && sizeof(Element) == 12,
                      "a triangle has three indices of 4 bytes");
        return {reinterpret_cast<const std::uint32_t*>(std::data(triangles)),
                3 * std::size(triangles)};
    }
}

/// The number of the texture of a triangle without one.
inline constexpr std::uint32_t kNoTexture = 0xFFFFFFFFu;
inline constexpr std::uint32_t kMaxTextureSide = 16384;

/// The texture beyond its image.
enum class Wrap {
    repeat,  ///< The image again and again.
    clamp,   ///< The texels of its border.
};

/// An image in the caller's memory for triangles to show.
struct TextureView {
    /// width * height texels of the format of Image::pixels, row by row from the top. The squares
    /// of channels are taken as linear intensities. Alpha is read for `alpha_cutoff` alone.
    std::span<const std::uint32_t> texels = {};
    /// 1 to kMaxTextureSide each.
    std::uint32_t width = 0;
    std::uint32_t height = 0;
    Wrap wrap = Wrap::repeat;
    /// From 0 to 1. Where alpha / 255, linear between texels, is below this, all rays of lit images
    /// pass. Queries and other images ignore it.
    float alpha_cutoff = 0;
};

/// What images show of a mesh. All arrays are copied once.
struct Appearance {
    /// The linear colour of each triangle, 8 bits a channel, red in bits 0 to 7, green in 8 to 15,
    /// blue in 16 to 23. Empty: light grey.
    std::span<const std::uint32_t> albedo = {};
    /// For lit images, three numbers below the number of corners for each triangle. Corners with
    /// the same number share the mean normal of their triangles at the current pose; at creases of
    /// more than 37 degrees they stay flat. MeshView::triangles itself makes the whole mesh smooth,
    /// without memory for it. Empty: every triangle is flat.
    std::span<const std::uint32_t> smooth = {};
    /// In lit images the mesh shows the background, darkened by shadows and occlusion.
    bool shadow_catcher = false;
    /// For lit images, at most 65536 textures; each triangle shows one, multiplied by its albedo
    /// (white without `albedo`). Copies take a third more memory, for smaller levels.
    std::span<const TextureView> textures = {};
    /// With `textures`, six floats for each triangle: u and v of its corners. u is from the left
    /// (0) to the right (1) of the image, v from bottom to top. What is not finite counts as 0.
    std::span<const float> texcoords = {};
    /// With `textures`, the texture of each triangle, or kNoTexture. Empty: all have the first.
    std::span<const std::uint32_t> texture_ids = {};
};

/// A mesh of triangles in the caller's memory. Scene::build(), attach() and each update() read
/// `positions`, so they must stay where they are until the mesh is detached or the scene is
/// destroyed. Indices are copied. Triangles with positions that are NaN or infinite are never hit.
struct MeshView {
    Positions positions = {};
    /// Three indices of positions for each triangle; there may be none.
    std::span<const std::uint32_t> triangles = {};
    /// Whether update() reads the positions again.
    bool deforms = true;
    Appearance appearance = {};
};

}  // namespace morphray
