#include "scenes/gltf/gltf_scene.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
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

enum class TriangleMode : std::uint8_t { kTriangles = 4, kStrip = 5, kFan = 6 };

std::size_t count_triangles(TriangleMode mode, std::size_t corner_count) {
    return mode == TriangleMode::kTriangles ? corner_count / 3 : corner_count - 2;
}

/// As the specification orders them (glTF 2.0, 3.7.2.1). Without indices: vertices 0, 1, 2, ...
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

/// The accessors that make a vertex set: primitives with the same ones share it.
struct SetKey {
    std::vector<std::pair<std::string, std::uint64_t>> accessors;
    auto operator<=>(const SetKey&) const = default;

    explicit SetKey(const JsonAt& primitive) {
        const JsonAt attributes = primitive.at("attributes");
        const auto add = [&](const std::string& name) {
            const auto reference = attributes.find(name);
            if (reference) accessors.emplace_back(name, reference->count());
            return reference.has_value();
        };
        add("POSITION");
        for (int set = 0; add(fmt::format("JOINTS_{}", set)); ++set)
            add(fmt::format("WEIGHTS_{}", set));
        const auto targets = primitive.find("targets");
        for (std::size_t i = 0; targets && i < targets->size(); ++i) {
            const auto position = (*targets)[i].find("POSITION");
            accessors.emplace_back("target", position ? position->count() : ~std::uint64_t{0});
        }
    }
};

class MeshReader {
public:
    MeshReader(const GltfFile& file, const Materials& materials, const AnimationOptions& options)
        : file_(file),
          materials_(materials),
          options_(options),
          is_quantized_(file.uses_extension(kQuantization)) {}

    Mesh read(std::size_t index) {
        const JsonAt at = file_.element("meshes", index);
        Mesh mesh;
        const JsonAt primitives = at.at("primitives");
        std::map<SetKey, std::size_t> sets;
        for (std::size_t i = 0; i < primitives.size(); ++i) {
            const JsonAt primitive = primitives[i];
            const auto targets = primitive.find("targets");
            const std::size_t target_count = targets ? targets->size() : 0;
            if (i > 0 && target_count != mesh.target_count) {
                primitive.fail("has {} morph targets, but the primitive before has {}",
                               target_count, mesh.target_count);
            }
            mesh.target_count = target_count;
            read_primitive(primitive, mesh, sets);
        }
        mesh.weights.resize(mesh.target_count);
        if (const auto weights = at.find("weights")) weights->numbers(mesh.weights);
        return mesh;
    }
    /// Gives the warnings, once all meshes have been read.
    void finish() const {
        for (const WarningCount* count :
             {&left_out_, &not_finite_, &unweighted_, &without_texcoords_, &appearance_})
            count->tell(options_.warn);
    }

private:
    void read_primitive(const JsonAt& at, Mesh& mesh, std::map<SetKey, std::size_t>& sets) {
        const std::uint64_t mode = at.count_or("mode", kFirstTriangleMode);
        if (mode > 6) at.at("mode").fail("is {}; must be from 0 to 6", mode);
        const JsonAt attributes = at.at("attributes");
        if (mode < kFirstTriangleMode || !attributes.find("POSITION")) {
            left_out_.add([&] {
                return Warning{file_.name(), fmt::format("{}: {}; left out", at.path(),
                                                         mode < kFirstTriangleMode
                                                             ? "points or lines, no triangles"
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
        appearance_.catch_fault(file_.name(), "; left out", [&] {
            primitive.material =
                at.index_or_none("material", materials_.materials.size(), "materials");
            if (const auto normal = attributes.find("NORMAL"))
                primitive.normals = read_vectors(*normal, vertex_count);
            primitive.texcoords = read_texcoords(attributes, primitive, vertex_count);
            if (const auto colours = attributes.find("COLOR_0"))
                colours->fail("colours of vertices are not read");
        });
        mesh.primitives.push_back(std::move(primitive));
    }

    Integers quantized(Integers otherwise) const {
        return is_quantized_ ? Integers::kAny : otherwise;
    }

    std::vector<vec3> read_vectors(const JsonAt& reference, std::size_t vertex_count) {
        return as_vectors(floats(file_, reference, {3, quantized(Integers::kNone), vertex_count}));
    }

    VertexSet read_set(const JsonAt& at) {
        const JsonAt attributes = at.at("attributes");
        const JsonAt position = attributes.at("POSITION");
        VertexSet set;
        set.positions = read_vectors(position, 0);
        check_positions(position, set.positions);
        const auto targets = at.find("targets");
        for (std::size_t i = 0; targets && i < targets->size(); ++i)
            set.targets.push_back(read_target((*targets)[i], set.positions.size()));
        set.influences =
            read_influences(file_, attributes, set.positions.size(), options_.lenient, unweighted_);
        return set;
    }

    void check_positions(const JsonAt& at, const std::vector<vec3>& positions) {
        for (std::size_t i = 0; i < positions.size(); ++i) {
            if (MeshRules::is_good(positions[i])) continue;
            const std::string what =
                fmt::format("vertex {} has a coordinate that is not finite or beyond 1e30", i);
            if (!options_.lenient) at.fail(what + "; repair it", Hint::kLenient);
            not_finite_.add([&] {
                return Warning{file_.name(), fmt::format("{}: {}; kept as it is", at.path(), what)};
            });
        }
    }

    std::vector<vec3> read_target(const JsonAt& at, std::size_t vertex_count) {
        const auto position = at.find("POSITION");
        if (!position) return {};
        std::vector<vec3> deltas = read_vectors(*position, vertex_count);
        for (std::size_t i = 0; i < deltas.size(); ++i) {
            const vec3& d = deltas[i];
            if (!std::isfinite(d.x) || !std::isfinite(d.y) || !std::isfinite(d.z))
                position->fail("element {} is not finite", i);
        }
        return deltas;
    }

    std::vector<uvec3> read_triangles(const JsonAt& at, std::uint64_t mode,
                                      std::size_t vertex_count) {
        std::vector<std::uint32_t> indices;
        std::size_t corner_count = vertex_count;
        const auto reference = at.find("indices");
        if (reference) {
            indices = integers(file_, *reference, 1, 0);
            corner_count = indices.size();
        }
        const auto type = static_cast<TriangleMode>(mode);
        if (corner_count < 3 || (type == TriangleMode::kTriangles && corner_count % 3 != 0)) {
            (reference ? *reference : at)
                .fail("{} corners are no {}", corner_count,
                      type == TriangleMode::kTriangles ? "triangles" : "strip or fan");
        }
        triangle_count_ += count_triangles(type, corner_count);
        if (triangle_count_ > kMaxTriangles) {
            throw Error(ErrorKind::kLimit, "{}: more than 2^28 triangles; split the scene",
                        file_.name());
        }
        for (std::size_t i = 0; i < indices.size(); ++i) {
            if (indices[i] < vertex_count) continue;
            reference->fail("index {} is {}, but there are {} vertices", i, indices[i],
                            vertex_count);
        }
        return triangles_of(type, indices, corner_count);
    }

    std::vector<Texcoord> read_texcoords(const JsonAt& attributes, const Primitive& primitive,
                                         std::size_t vertex_count) {
        if (!primitive.material) return {};
        const Material& material = materials_.materials[*primitive.material];
        const TexcoordUse& use = material.texcoords;
        if (material.texture == kNoTexture) return {};
        const auto reference = attributes.find(fmt::format("TEXCOORD_{}", use.set));
        if (!reference) {
            without_texcoords_.add([&] {
                return Warning{file_.name(),
                               fmt::format("{}: has no TEXCOORD_{} for its texture; has its colour "
                                           "alone",
                                           attributes.path(), use.set)};
            });
            return {};
        }
        const std::vector<float> values =
            floats(file_, *reference, {2, quantized(Integers::kNormalized), vertex_count});
        std::vector<Texcoord> texcoords(vertex_count);
        for (std::size_t i = 0; i < vertex_count; ++i) {
            const auto mapped = [&](const std::array<double, 3>& row) {
                return static_cast<float>((row[0] * static_cast<double>(values[2 * i]) +
                                           row[1] * static_cast<double>(values[2 * i + 1])) +
                                          row[2]);
            };
            const float u = mapped(use.map.u);
            const float v = mapped(use.map.v);
            if (!std::isfinite(u) || !std::isfinite(v))
                reference->fail("vertex {} has coordinates that are not finite", i);
            // v counts from the top of the image.
            texcoords[i] = {u, 1 - v};
        }
        return texcoords;
    }

    const GltfFile& file_;
    const Materials& materials_;
    const AnimationOptions& options_;
    bool is_quantized_;
    std::uint64_t triangle_count_ = 0;
    WarningCount left_out_;
    WarningCount not_finite_;
    WarningCount unweighted_;
    WarningCount without_texcoords_;
    WarningCount appearance_;
};

}  // namespace

std::map<std::uint32_t, Mesh> read_meshes(const GltfFile& file, const Materials& materials,
                                          std::span<const std::uint32_t> indices,
                                          const AnimationOptions& options) {
    MeshReader reader(file, materials, options);
    std::map<std::uint32_t, Mesh> meshes;
    for (const std::uint32_t index : indices)
        if (!meshes.contains(index)) meshes.emplace(index, reader.read(index));
    reader.finish();
    return meshes;
}

}  // namespace mray::gltf
