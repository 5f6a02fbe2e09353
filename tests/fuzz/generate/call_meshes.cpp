#include "tests/fuzz/generate/call_meshes.h"

#include <algorithm>
#include <cstring>
#include <limits>
#include <utility>

#include "tests/fuzz/generate/shapes.h"

namespace mray::fuzz {
namespace {

constexpr std::size_t kMostTriangles = 48;

vec3 to_floats(const dvec3& p) {
    vec3 out;
    for (int axis = 0; axis < 3; ++axis)
        out[axis] = static_cast<float>(std::clamp(p[axis], -1e30, 1e30));
    return out;
}

float odd_coordinate(Dice& dice) {
    using Limits = std::numeric_limits<float>;
    constexpr std::array kOdd = {Limits::quiet_NaN(),  Limits::infinity(),
                                 -Limits::infinity(),  -0.0f,
                                 Limits::denorm_min(), 1e-17f};
    return dice.pick(kOdd);
}

std::vector<std::uint32_t> random_colours(Dice& dice, std::size_t count) {
    std::vector<std::uint32_t> colours;
    while (colours.size() < count) colours.push_back(static_cast<std::uint32_t>(dice.bits()));
    return colours;
}

morphray::TextureView random_texture(Dice& dice, std::vector<std::uint32_t>& texels) {
    morphray::TextureView texture;
    texture.width = static_cast<std::uint32_t>(dice.from(1, 9));
    texture.height = static_cast<std::uint32_t>(dice.from(1, 9));
    texels = random_colours(dice, std::size_t{texture.width} * texture.height);
    texture.texels = texels;
    texture.wrap = dice.one_in(2) ? morphray::Wrap::repeat : morphray::Wrap::clamp;
    if (dice.one_in(2)) texture.alpha_cutoff = static_cast<float>(dice.real(0, 1));
    return texture;
}

}  // namespace

CallMesh::CallMesh(std::uint64_t seed) {
    Dice dice(seed);
    Shape shape = make_shape(dice);
    if (shape.triangles.size() > kMostTriangles) shape.triangles.resize(kMostTriangles);
    const double scale = dice.one_in(8) ? dice.magnitude(1e-6, 1e6) : dice.real(0.3, 1.5);
    const dvec3 offset = dice.point(dice.one_in(12) ? 100 : 1);
    for (const dvec3& p : shape.positions) first_.push_back(to_floats(p * scale + offset));
    if (dice.one_in(16)) shape.triangles.clear();
    if (dice.one_in(10) && !first_.empty())
        first_[dice.below(static_cast<std::uint32_t>(first_.size()))].x = odd_coordinate(dice);
    triangles_ = shape.triangles;
    for (const uvec3& t : triangles_) indices_.insert(indices_.end(), {t.x, t.y, t.z});
    constexpr std::array kStrides = {12, 12, 16, 21, 40};
    stride_ = static_cast<std::size_t>(dice.pick(kStrides));
    if (stride_ > sizeof(vec3)) offset_ = static_cast<std::size_t>(dice.from(0, 3));
    bytes_.resize(offset_ + first_.size() * stride_);
    for (std::size_t i = 0; i < first_.size(); ++i) set(i, first_[i]);

    deforms_ = !dice.one_in(4);
    is_backdrop_ = dice.one_in(12);
    if (dice.one_in(2)) albedo_ = random_colours(dice, triangles_.size());
    if (dice.one_in(3)) {
        is_smooth_by_vertex_ = true;
    } else if (dice.one_in(3)) {
        for (std::size_t i = 0; i < indices_.size(); ++i)
            smooth_.push_back(dice.below(static_cast<std::uint32_t>(indices_.size())));
    }
    if (dice.one_in(3)) {
        texels_.resize(static_cast<std::size_t>(dice.from(1, 3)));
        for (auto& texels : texels_) textures_.push_back(random_texture(dice, texels));
        for (std::size_t i = 0; i < 2 * indices_.size(); ++i)
            texcoords_.push_back(static_cast<float>(dice.real(-2, 2)));
        if (dice.one_in(8) && !texcoords_.empty()) texcoords_[0] = odd_coordinate(dice);
        for (std::size_t i = 0; i < triangles_.size() && texels_.size() > 1; ++i) {
            const std::uint32_t id = dice.below(static_cast<std::uint32_t>(texels_.size()) + 1);
            texture_ids_.push_back(id < texels_.size() ? id : morphray::kNoTexture);
        }
    }
    if (!dice.one_in(16) || indices_.empty()) return;
    // A fault.
    switch (dice.from(0, 4)) {
        case 0:
            indices_.back() = static_cast<std::uint32_t>(first_.size());
            break;
        case 1:
            is_smooth_by_vertex_ = false;
            smooth_.assign(indices_.size(), static_cast<std::uint32_t>(indices_.size()));
            break;
        case 2:
            albedo_.resize(triangles_.size() + 1);
            break;
        case 3:
            texture_ids_.assign(triangles_.size(), 7);
            break;
        default:
            indices_.pop_back();
    }
}

morphray::MeshView CallMesh::view() const {
    morphray::MeshView view = this->view({});
    view.positions = {bytes_.empty() ? nullptr : bytes_.data() + offset_, first_.size(), stride_};
    return view;
}

morphray::MeshView CallMesh::view(std::span<const vec3> positions) const {
    morphray::MeshView view;
    view.positions = {positions.data(), positions.size(), sizeof(vec3)};
    view.triangles = indices_;
    view.deforms = deforms_;
    view.albedo = albedo_;
    view.smooth = is_smooth_by_vertex_ ? indices_ : smooth_;
    view.backdrop = is_backdrop_;
    view.textures = textures_;
    view.texcoords = texcoords_;
    view.texture_ids = texture_ids_;
    return view;
}

std::vector<vec3> CallMesh::positions() const {
    std::vector<vec3> positions(first_.size());
    for (std::size_t i = 0; i < positions.size(); ++i)
        std::memcpy(&positions[i], &bytes_[offset_ + i * stride_], sizeof(vec3));
    return positions;
}

void CallMesh::set(std::size_t vertex, const vec3& p) {
    std::memcpy(&bytes_[offset_ + vertex * stride_], &p, sizeof(p));
}

void CallMesh::move(std::uint64_t seed) {
    Dice dice(seed);
    if (first_.empty()) return;
    std::vector<vec3> points = dice.one_in(2) ? first_ : positions();
    const auto any = [&]() -> vec3& {
        return points[dice.below(static_cast<std::uint32_t>(points.size()))];
    };
    const auto map = [&](auto change) {
        for (vec3& p : points) p = to_floats(change(dvec3(p)));
    };
    // Out of the largest floats, the conversion would be undefined.
    const auto is_finite = [](const vec3& p) {
        return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z);
    };
    switch (dice.from(0, 9)) {
        case 0:
            break;
        case 1: {
            const double size = dice.magnitude(1e-7, 1);
            for (vec3& p : points)
                if (is_finite(p)) p = to_floats(dvec3(p) + dice.point(size));
            break;
        }
        case 2: {
            const dvec3 by = dice.point(dice.one_in(2) ? 1 : 30);
            map([&](const dvec3& p) { return p + by; });
            break;
        }
        case 3: {
            const double size = dice.magnitude(1e-20, 1e8);
            map([&](const dvec3& p) { return p * size; });
            break;
        }
        case 4:
        case 5:
            for (int n = dice.from(1, 3); n > 0; --n) {
                vec3& p = any();
                p[dice.from(0, 2)] = odd_coordinate(dice);
            }
            break;
        case 6: {
            const float x = odd_coordinate(dice);
            for (vec3& p : points) p.y = x;
            break;
        }
        case 7:
            any() = to_floats(dice.point(dice.magnitude(0.1, 1e5)));
            break;
        case 8:
            for (std::size_t i = points.size(); i > 1; --i)
                std::swap(points[i - 1], points[dice.below(static_cast<std::uint32_t>(i))]);
            break;
        default:
            for (vec3& p : points) p = to_floats(dice.point(1.2));
    }
    for (std::size_t i = 0; i < points.size(); ++i) set(i, points[i]);
}

}  // namespace mray::fuzz
