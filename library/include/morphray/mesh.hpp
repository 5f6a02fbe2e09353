// The caller's arrays, read in place.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
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

/// The numbers that an element of an array of positions begins with; void where that is unknown.
template <class Element>
auto number_of() {
    if constexpr (std::is_array_v<Element>) {
        return std::remove_cv_t<std::remove_all_extents_t<Element>>{};
    } else if constexpr (requires { typename Element::value_type; }) {
        return typename Element::value_type{};
    } else if constexpr (requires(Element e) { e.x; }) {
        return std::remove_cvref_t<decltype(std::declval<Element>().x)>{};
    } else if constexpr (!requires { Element{std::declval<double>()}; }) {
        // Not a struct that begins with a double: floats are taken for granted.
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

/// `count` positions, three floats or doubles each, `stride` bytes apart, at any address. The array
/// is borrowed. Where they are read, SceneOptions::origin is subtracted in double, then they are
/// rounded to floats.
struct Positions {
    const void* data = nullptr;
    std::size_t count = 0;
    std::size_t stride = sizeof(Vec3);
    bool has_doubles = false;
};

/// Finds a SceneOptions::origin: 0, or near the middle of doubles one of which rounding to floats
/// would move by more than 1e-6 of their size. Positions that are not finite, beyond 1e30, or 2^37
/// times as far from 0 as most do not count. O(positions).
MORPHRAY_API Point find_origin(const Positions& positions);
/// Returns the farthest that rounding moves a coordinate of doubles less an origin; 0 for floats.
MORPHRAY_API double rounding_error(const Positions& positions, const Point& origin);
/// Whether that is more than 1e-6 of the size of the positions, so that another origin is needed.
/// Takes nanoseconds where they are near the origin, and O(positions) elsewhere.
MORPHRAY_API bool rounds_coarsely(const Positions& positions, const Point& origin);

/// The positions of an array of the caller's vertices. `member` is the member with the position:
/// float[3], std::array<double, 3>, Vec3 or any other type that begins with three floats or
/// doubles.
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

/// An array of vertices that are positions and nothing else: Vec3, std::array<float, 3>,
/// std::array<double, 3>, ...
template <class Array>
Positions packed(Array&& points) {
    using Element = std::remove_cvref_t<decltype(*std::data(points))>;
    detail::check_positions<Array, Element>();
    return {std::data(points), std::size(points), sizeof(Element),
            std::is_same_v<detail::Number<Element>, double>};
}

/// The indices of an array of integers of 4 bytes, or of std::array of three of them, in place.
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

/// Stands for the number of a texture of a triangle that has none.
inline constexpr std::uint32_t kNoTexture = 0xFFFFFFFFu;
inline constexpr std::uint32_t kMaxTextureSide = 16384;

/// The continuation of a texture beyond its image.
enum class Wrap {
    repeat,  ///< The image again and again.
    clamp,   ///< The texels of its border.
};

/// An image in the caller's memory for triangles to show.
struct TextureView {
    /// width * height texels, row by row from the top, as Image::pixels. Channels are encoded as in
    /// image files, not linear: their squares are taken as linear intensities. Alpha is read for
    /// `alpha_cutoff` alone.
    std::span<const std::uint32_t> texels = {};
    std::uint32_t width = 0;  ///< 1 to kMaxTextureSide.
    std::uint32_t height = 0;
    Wrap wrap = Wrap::repeat;
    /// From 0 to 1. Where alpha, divided by 255 and linear between texels, is below this, rays of
    /// lit images pass triangles. Queries and other images know no holes.
    float alpha_cutoff = 0;
};

/// What images show of a mesh. All arrays are copied once.
struct Appearance {
    /// The colour of each triangle: linear, with channels as in Image::pixels. Empty: light grey.
    std::span<const std::uint32_t> albedo = {};
    /// For lit images, three numbers for each triangle, below the number of corners. Corners with
    /// the same number share a normal: the mean of their triangles, by their angles, at the current
    /// pose. A corner more than 37 degrees off it stays flat. MeshView::triangles itself makes all
    /// of the mesh smooth, without memory for it. Empty: every triangle is flat.
    std::span<const std::uint32_t> smooth = {};
    /// In lit images the mesh, a plane to stand on, is the background, darkened by shadows.
    bool shadow_catcher = false;
    /// For lit images, at most 65536 textures, copied with smaller levels: a third more memory.
    /// Each triangle shows one, multiplied by its albedo (without `albedo` white).
    std::span<const TextureView> textures = {};
    /// With `textures`, u and v of each triangle's three corners, six floats for each triangle: u
    /// from the left (0) to the right (1) of the image, v from its bottom (0) to its top (1), and
    /// beyond as TextureView::wrap says. What is not finite counts as 0.
    std::span<const float> texcoords = {};
    /// The index of each triangle's texture, or kNoTexture. Empty: all have the first.
    std::span<const std::uint32_t> texture_ids = {};
};

/// A mesh of triangles in the caller's memory. `positions` are read by Scene::build(), attach() and
/// each update(), so they must stay where they are until the mesh is detached or the scene is
/// destroyed. Indices are copied. Any mesh is accepted, also one without triangles;
/// positions that are NaN or infinite make their triangles unhittable.
struct MeshView {
    Positions positions = {};
    /// Three indices of positions for each triangle.
    std::span<const std::uint32_t> triangles = {};
    /// Whether update() reads the positions again. A mesh that does not deform costs nothing there.
    bool deforms = true;
    Appearance appearance = {};
};

/// An affine map that takes a point p to M p + t: three rows (m0, m1, m2, t). The default is the
/// identity.
struct Transform {
    std::array<std::array<double, 4>, 3> rows = {{{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}}};
};

/// A mesh, and where its rest positions go (Scene::update()).
struct MeshPose {
    std::uint32_t geom_id = 0;
    Transform transform = {};
};

}  // namespace morphray
