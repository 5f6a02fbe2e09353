#include "scenes/gltf/meshes.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <span>
#include <string>
#include <utility>

#include "common/base/errors.h"
#include "scenes/mesh/mesh_rules.h"

namespace mray::gltf {
namespace {

constexpr std::uint64_t kFirstTriangleMode = 4;

using Integers = Wanted::Integers;

std::vector<vec3> as_vectors(const std::vector<float>& values) {
    std::vector<vec3> vectors(values.size() / 3);
    for (std::size_t i = 0; i < vectors.size(); ++i)
        vectors[i] = {values[3 * i], values[3 * i + 1], values[3 * i + 2]};
    return vectors;
}

void require_count(const Accessor& accessor, std::size_t vertex_count) {
    if (accessor.count == vertex_count) return;
    accessor.at.at("count").fail(fmt::format("is {}, but the positions of its primitive are {}",
                                             accessor.count, vertex_count));
}

/// JOINTS_n and WEIGHTS_n for n = 0, 1, ...: four numbers a vertex each.
struct InfluenceSets {
    std::vector<std::vector<std::uint32_t>> joints;
    std::vector<std::vector<float>> weights;
};

constexpr std::size_t kPerSet = 4;

/// The largest number of weights above 0 that a vertex has, at least 1.
std::size_t most_used(const InfluenceSets& sets, std::size_t vertex_count) {
    std::size_t most = 1;
    for (std::size_t vertex = 0; vertex < vertex_count; ++vertex) {
        std::size_t used = 0;
        for (const std::vector<float>& weights : sets.weights)
            for (std::size_t k = 0; k < kPerSet; ++k) used += weights[kPerSet * vertex + k] > 0;
        most = std::max(most, used);
    }
    return most;
}

void require_weights(const JsonAt& at, std::span<const float> weights) {
    for (std::size_t i = 0; i < weights.size(); ++i) {
        // False for NaN, too; weights are far below this.
        constexpr float kMost = 1e30f;
        if (weights[i] >= 0 && weights[i] <= kMost) continue;
        at.fail(fmt::format("vertex {} has the weight {}; must be finite and at least 0",
                            i / kPerSet, weights[i]));
    }
}

Influences joined_influences(const InfluenceSets& sets,
                             const std::function<void(std::size_t vertex)>& unweighted) {
    const std::size_t vertex_count = sets.joints.front().size() / kPerSet;
    Influences result;
    result.per_vertex = most_used(sets, vertex_count);
    result.joints.reserve(vertex_count * result.per_vertex);
    result.weights.reserve(vertex_count * result.per_vertex);
    for (std::size_t vertex = 0; vertex < vertex_count; ++vertex) {
        const std::size_t begin = result.joints.size();
        const auto add = [&](std::uint32_t joint, float weight) {
            result.joints.push_back(static_cast<std::uint16_t>(joint));
            result.weights.push_back(weight);
            result.joint_limit = std::max(result.joint_limit, joint + 1);
        };
        for (std::size_t set = 0; set < sets.joints.size(); ++set) {
            for (std::size_t k = 0; k < kPerSet; ++k) {
                const float weight = sets.weights[set][kPerSet * vertex + k];
                if (weight > 0) add(sets.joints[set][kPerSet * vertex + k], weight);
            }
        }
        if (result.joints.size() == begin) {
            unweighted(vertex);
            add(sets.joints[0][kPerSet * vertex], 1);
        }
        // The joint of a weight that is not needed is one that moves the vertex.
        while (result.joints.size() < begin + result.per_vertex) add(result.joints[begin], 0);
    }
    return result;
}

enum class TriangleMode : std::uint8_t { kTriangles = 4, kStrip = 5, kFan = 6 };

std::size_t count_triangles(TriangleMode mode, std::size_t corner_count) {
    return mode == TriangleMode::kTriangles ? corner_count / 3 : corner_count - 2;
}

/// The triangles of at least three corners, as the specification orders them (glTF 2.0, 3.7.2.1).
/// Without indices the corners are vertices 0, 1, 2, ...
std::vector<uvec3> triangles_of(TriangleMode mode, std::span<const std::uint32_t> indices,
                                std::size_t corner_count) {
    const auto vertex = [&](std::size_t corner) {
        return indices.empty() ? static_cast<std::uint32_t>(corner) : indices[corner];
    };
    std::vector<uvec3> triangles(count_triangles(mode, corner_count));
    for (std::size_t i = 0; i < triangles.size(); ++i) {
        if (mode == TriangleMode::kTriangles) {
            triangles[i] = {vertex(3 * i), vertex(3 * i + 1), vertex(3 * i + 2)};
        } else if (mode == TriangleMode::kStrip) {
            triangles[i] = {vertex(i), vertex(i + 1 + i % 2), vertex(i + 2 - i % 2)};
        } else {
            triangles[i] = {vertex(i + 1), vertex(i + 2), vertex(0)};
        }
    }
    return triangles;
}

std::uint64_t index_of(const JsonAt& reference) { return reference.count(); }

}  // namespace

struct MeshReader::SetKey {
    std::vector<std::pair<std::string, std::uint64_t>> accessors;
    auto operator<=>(const SetKey&) const = default;

    explicit SetKey(const JsonAt& primitive) {
        const JsonAt attributes = primitive.at("attributes");
        const auto add = [&](const std::string& name) {
            const auto reference = attributes.find(name.c_str());
            if (reference) accessors.emplace_back(name, index_of(*reference));
            return reference.has_value();
        };
        add("POSITION");
        for (int set = 0; add(fmt::format("JOINTS_{}", set)); ++set)
            add(fmt::format("WEIGHTS_{}", set));
        const auto targets = primitive.find("targets");
        for (std::size_t i = 0; targets && i < targets->size(); ++i) {
            const auto position = (*targets)[i].find("POSITION");
            accessors.emplace_back("target", position ? index_of(*position) : ~std::uint64_t{0});
        }
    }
};

MeshReader::MeshReader(const GltfFile& file, Accessors& accessors,
                       const TexcoordUses& texcoord_uses, const ClipOptions& options)
    : file_(file),
      accessors_(accessors),
      texcoord_uses_(texcoord_uses),
      options_(options),
      is_quantized_(file.uses_extension(kQuantization)) {}

Mesh MeshReader::read(std::size_t index) {
    const JsonAt at = file_.element("meshes", index);
    Mesh mesh;
    const JsonAt primitives = at.at("primitives");
    std::map<SetKey, std::size_t> sets;
    for (std::size_t i = 0; i < primitives.size(); ++i) {
        const JsonAt primitive = primitives[i];
        const auto targets = primitive.find("targets");
        const std::size_t target_count = targets ? targets->size() : 0;
        if (i > 0 && target_count != mesh.target_count) {
            primitive.fail(fmt::format("has {} morph targets, but the primitive before has {}",
                                       target_count, mesh.target_count));
        }
        mesh.target_count = target_count;
        read_primitive(primitive, mesh, sets);
    }
    mesh.weights.resize(mesh.target_count);
    if (const auto weights = at.find("weights")) weights->numbers(mesh.weights);
    return mesh;
}

void MeshReader::read_primitive(const JsonAt& at, Mesh& mesh, std::map<SetKey, std::size_t>& sets) {
    const std::uint64_t mode = at.count_or("mode", kFirstTriangleMode);
    if (mode > 6) at.at("mode").fail(fmt::format("is {}; must be from 0 to 6", mode));
    const JsonAt attributes = at.at("attributes");
    if (mode < kFirstTriangleMode || !attributes.find("POSITION")) {
        left_out_.add([&] {
            return Warning{file_.name(),
                           fmt::format("{}: {}; left out", at.path(),
                                       mode < kFirstTriangleMode ? "points or lines, no triangles"
                                                                 : "no positions")};
        });
        return;
    }
    const auto [known, is_new] = sets.try_emplace(SetKey(at), mesh.sets.size());
    if (is_new) mesh.sets.push_back(read_set(at));
    Primitive primitive;
    primitive.vertex_set = known->second;
    const std::size_t vertex_count = mesh.sets[primitive.vertex_set].positions.size();
    primitive.triangles = read_triangles(at, mode, vertex_count);
    primitive.material = at.index_or_none("material", texcoord_uses_.size(), "materials");
    primitive.normals = read_normals(attributes, vertex_count);
    primitive.texcoords = read_texcoords(attributes, primitive, vertex_count);
    mesh.primitives.push_back(std::move(primitive));
}

Integers MeshReader::quantized(Integers otherwise) const {
    return is_quantized_ ? Integers::kAny : otherwise;
}

std::vector<vec3> MeshReader::read_vectors(const JsonAt& reference, const char* what,
                                           std::size_t vertex_count) {
    const Accessor accessor = accessors_.open(reference);
    if (vertex_count != 0) require_count(accessor, vertex_count);
    if (accessor.base.component != Component::kFloat && !is_quantized_) {
        reference.fail(
            fmt::format("{} are integers, which need the extension {}", what, kQuantization));
    }
    return as_vectors(accessors_.floats(accessor, {3, "VEC3", quantized(Integers::kNone)}));
}

VertexSet MeshReader::read_set(const JsonAt& at) {
    const JsonAt attributes = at.at("attributes");
    const JsonAt position = attributes.at("POSITION");
    VertexSet set;
    set.positions = read_vectors(position, "positions", 0);
    check_positions(position, set.positions);
    const auto targets = at.find("targets");
    for (std::size_t i = 0; targets && i < targets->size(); ++i)
        set.targets.push_back(read_target((*targets)[i], set.positions.size()));
    set.influences = read_influences(attributes, set.positions.size());
    return set;
}

void MeshReader::check_positions(const JsonAt& at, const std::vector<vec3>& positions) {
    for (std::size_t i = 0; i < positions.size(); ++i) {
        const vec3& p = positions[i];
        if (MeshRules::is_good(p.x) && MeshRules::is_good(p.y) && MeshRules::is_good(p.z)) continue;
        const std::string what =
            fmt::format("vertex {} has a coordinate that is not finite or beyond 1e30", i);
        if (!options_.lenient) at.fail(what + "; repair it", Hint::kLenient);
        not_finite_.add([&] {
            return Warning{file_.name(), fmt::format("{}: {}; kept as it is", at.path(), what)};
        });
    }
}

MorphTarget MeshReader::read_target(const JsonAt& at, std::size_t vertex_count) {
    MorphTarget target;
    const auto position = at.find("POSITION");
    if (!position) return target;
    const Accessor accessor = accessors_.open(*position);
    require_count(accessor, vertex_count);
    if (accessor.is_sparse_alone()) {
        SparseFloats sparse =
            accessors_.sparse_floats(accessor, {3, "VEC3", quantized(Integers::kNone)});
        target.vertices = std::move(sparse.indices);
        target.deltas = as_vectors(sparse.values);
    } else {
        target.deltas = read_vectors(*position, "displacements", vertex_count);
    }
    for (std::size_t i = 0; i < target.deltas.size(); ++i) {
        const vec3& d = target.deltas[i];
        if (!std::isfinite(d.x) || !std::isfinite(d.y) || !std::isfinite(d.z))
            position->fail(fmt::format("element {} is not finite", i));
    }
    return target;
}

Influences MeshReader::read_influences(const JsonAt& attributes, std::size_t vertex_count) {
    InfluenceSets sets;
    for (int set = 0;; ++set) {
        const std::string joints_name = fmt::format("JOINTS_{}", set);
        const std::string weights_name = fmt::format("WEIGHTS_{}", set);
        const auto joints = attributes.find(joints_name.c_str());
        const auto weights = attributes.find(weights_name.c_str());
        if (!joints && !weights) break;
        if (!joints || !weights)
            attributes.fail(fmt::format("has no {}", joints ? weights_name : joints_name));
        const Accessor joint_accessor = accessors_.open(*joints);
        const Accessor weight_accessor = accessors_.open(*weights);
        require_count(joint_accessor, vertex_count);
        require_count(weight_accessor, vertex_count);
        sets.joints.push_back(accessors_.integers(joint_accessor, 4, false));
        sets.weights.push_back(
            accessors_.floats(weight_accessor, {4, "VEC4", Integers::kNormalized}));
        require_weights(weight_accessor.at, sets.weights.back());
    }
    if (sets.joints.empty()) return {};
    return joined_influences(sets, [&](std::size_t vertex) {
        const std::string what = fmt::format("vertex {} has no weight above 0", vertex);
        if (!options_.lenient) attributes.fail(what + "; repair it", Hint::kLenient);
        unweighted_.add([&] {
            return Warning{file_.name(), fmt::format("{}: {}; moves with its first joint",
                                                     attributes.path(), what)};
        });
    });
}

std::vector<uvec3> MeshReader::read_triangles(const JsonAt& at, std::uint64_t mode,
                                              std::size_t vertex_count) {
    std::vector<std::uint32_t> indices;
    std::size_t corner_count = vertex_count;
    const auto reference = at.find("indices");
    if (reference) {
        indices = accessors_.integers(accessors_.open(*reference), 1, true);
        corner_count = indices.size();
    }
    const auto type = static_cast<TriangleMode>(mode);
    if (corner_count < 3 || (type == TriangleMode::kTriangles && corner_count % 3 != 0)) {
        (reference ? *reference : at)
            .fail(fmt::format("{} corners are no {}", corner_count,
                              type == TriangleMode::kTriangles ? "triangles" : "strip or fan"));
    }
    triangle_count_ += count_triangles(type, corner_count);
    if (triangle_count_ > kMaxTriangles) {
        throw Error(ErrorKind::kLimit,
                    fmt::format("{}: more than 2^28 triangles; split the scene", file_.name()));
    }
    for (std::size_t i = 0; i < indices.size(); ++i) {
        if (indices[i] < vertex_count) continue;
        reference->fail(
            fmt::format("index {} is {}, but there are {} vertices", i, indices[i], vertex_count));
    }
    return triangles_of(type, indices, corner_count);
}

std::vector<vec3> MeshReader::read_normals(const JsonAt& attributes, std::size_t vertex_count) {
    const auto normal = attributes.find("NORMAL");
    if (!normal) return {};
    return read_vectors(*normal, "normals", vertex_count);
}

std::vector<Texcoord> MeshReader::read_texcoords(const JsonAt& attributes,
                                                 const Primitive& primitive,
                                                 std::size_t vertex_count) {
    const auto use = primitive.material ? texcoord_uses_[*primitive.material] : std::nullopt;
    if (!use) return {};
    const auto reference = attributes.find(fmt::format("TEXCOORD_{}", use->set).c_str());
    if (!reference) {
        without_texcoords_.add([&] {
            return Warning{file_.name(),
                           fmt::format("{}: has no TEXCOORD_{} for its texture; has its colour "
                                       "alone",
                                       attributes.path(), use->set)};
        });
        return {};
    }
    const Accessor accessor = accessors_.open(*reference);
    require_count(accessor, vertex_count);
    const std::vector<float> values =
        accessors_.floats(accessor, {2, "VEC2", quantized(Integers::kNormalized)});
    std::vector<Texcoord> texcoords(vertex_count);
    for (std::size_t i = 0; i < vertex_count; ++i) {
        const auto mapped = [&](const std::array<double, 3>& row) {
            return static_cast<float>((row[0] * static_cast<double>(values[2 * i]) +
                                       row[1] * static_cast<double>(values[2 * i + 1])) +
                                      row[2]);
        };
        const float u = mapped(use->map.u);
        const float v = mapped(use->map.v);
        if (!std::isfinite(u) || !std::isfinite(v))
            reference->fail(fmt::format("vertex {} has coordinates that are not finite", i));
        // v counts from the top of the image.
        texcoords[i] = {u, 1 - v};
    }
    return texcoords;
}

void MeshReader::finish() const {
    for (const WarningCount* count : {&left_out_, &not_finite_, &unweighted_, &without_texcoords_})
        count->tell(options_.warn);
}

}  // namespace mray::gltf
