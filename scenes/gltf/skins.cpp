#include "scenes/gltf/skins.h"

#include <fmt/format.h>

#include <cmath>

namespace mray::gltf {
namespace {

// Joints are numbers of 16 bits.
constexpr std::size_t kMaxJoints = 65536;

Affine matrix_of(const float* m) {
    Affine matrix;
    for (std::size_t k = 0; k < 4; ++k) {
        matrix.column[k] = {static_cast<double>(m[4 * k]), static_cast<double>(m[4 * k + 1]),
                            static_cast<double>(m[4 * k + 2])};
    }
    return matrix;
}

}  // namespace

Skin read_skin(const GltfFile& file, Accessors& accessors, std::size_t index) {
    const JsonAt at = file.element("skins", index);
    const JsonAt joints = at.at("joints");
    const std::size_t joint_count = joints.size();
    if (joint_count == 0 || joint_count > kMaxJoints)
        joints.fail(fmt::format("has {} joints; must be from 1 to {}", joint_count, kMaxJoints));
    Skin skin;
    for (std::size_t i = 0; i < joint_count; ++i)
        skin.joints.push_back(joints[i].index_below(file.count("nodes"), "nodes"));
    skin.inverse_binds.resize(joint_count);
    const auto reference = at.find("inverseBindMatrices");
    if (!reference) return skin;
    const Accessor accessor = accessors.open(*reference);
    if (accessor.count < joint_count) {
        accessor.at.at("count").fail(
            fmt::format("is {}, but {} has {} joints", accessor.count, at.path(), joint_count));
    }
    const std::vector<float> values = accessors.floats(accessor, {16, "MAT4"});
    for (std::size_t i = 0; i < joint_count; ++i) {
        for (std::size_t k = 0; k < 16; ++k) {
            if (!std::isfinite(values[16 * i + k]))
                reference->fail(fmt::format("matrix {} is not finite", i));
        }
        skin.inverse_binds[i] = matrix_of(&values[16 * i]);
    }
    return skin;
}

}  // namespace mray::gltf
