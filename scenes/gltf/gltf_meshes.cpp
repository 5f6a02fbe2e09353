#include "scenes/gltf/gltf_meshes.h"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>

#include "scenes/trig.h"

namespace mray::gltf {
namespace {

constexpr std::uint64_t kClampToEdge = 33071;
constexpr std::uint64_t kMirroredRepeat = 33648;
constexpr std::uint64_t kRepeat = 10497;

TexcoordUse texcoords_of(const JsonAt& info) {
    TexcoordUse use = {.set = info.count_or("texCoord", 0)};
    const auto extensions = info.find("extensions");
    const auto transform =
        extensions ? extensions->find(std::string(kTextureTransform)) : std::nullopt;
    if (!transform) return use;
    use.set = transform->count_or("texCoord", use.set);
    std::array<double, 2> offset = {0, 0};
    std::array<double, 2> scale = {1, 1};
    transform->numbers_of("offset", offset);
    transform->numbers_of("scale", scale);
    const auto rotation = transform->find("rotation");
    constexpr double kTurn = 6.283185307179586476925;
    const CosSin turned = circle_point(rotation ? rotation->number() / kTurn : 0);
    // Counterclockwise as the image is seen: v goes downwards.
    use.u = {turned.cos * scale[0], turned.sin * scale[1], offset[0]};
    use.v = {-turned.sin * scale[0], turned.cos * scale[1], offset[1]};
    return use;
}

class MaterialReader {
public:
    MaterialReader(const GltfFile& file, Materials& result) : file_(file), result_(result) {}

    void read(const JsonAt& at) {
        Material& material = result_.materials.emplace_back();
        odd_.catch_fault(file_.name(), "; its triangles have their colour alone",
                         [&] { read(at, material); });
    }

    void tell(const WarnFunction& warn) const { odd_.tell(warn); }

private:
    void read(const JsonAt& at, Material& material) {
        const auto base = at.find("pbrMetallicRoughness");
        const auto texture = base ? base->find("baseColorTexture") : std::nullopt;
        std::array<double, 4> factor = {1, 1, 1, 1};
        if (base) base->numbers_of("baseColorFactor", factor);
        material.albedo = albedo_of(static_cast<float>(factor[0]), static_cast<float>(factor[1]),
                                    static_cast<float>(factor[2]));
        const double cutoff = alpha_cutoff_of(at);
        material.is_cut_away = factor[3] < cutoff;
        if (!texture || material.is_cut_away) return;
        material.texcoords = texcoords_of(*texture);
        // The factor is above 0 where the cutoff is.
        material.texture = texture_of(texture->at("index"),
                                      cutoff == 0 ? 0 : static_cast<float>(cutoff / factor[3]));
    }

    /// From where on a material is opaque; 0: everywhere.
    double alpha_cutoff_of(const JsonAt& material) {
        const auto mode = material.find("alphaMode");
        if (mode && mode->text() == "BLEND")
            odd_.add(file_.name(), "{}: is BLEND; shown opaque", mode->path());
        if (!mode || mode->text() != "MASK") return 0;
        const auto cutoff = material.find("alphaCutoff");
        return cutoff ? std::max(cutoff->number(), 0.0) : 0.5;
    }

    std::uint32_t texture_of(const JsonAt& reference, float alpha_cutoff) {
        const JsonAt texture =
            file_.element("textures", reference.index_below(file_.count("textures"), "textures"));
        const auto source = texture.index_or_none("source", file_.count("images"), "images");
        if (!source) texture.fail("has no image that is read");
        TextureFile file = image_of(*source);
        file.clamp = is_clamped(texture);
        file.alpha_cutoff = alpha_cutoff;
        const auto same = std::ranges::find(result_.textures, file);
        const auto index = static_cast<std::uint32_t>(same - result_.textures.begin());
        if (same == result_.textures.end()) result_.textures.push_back(std::move(file));
        return index;
    }

    const TextureFile& image_of(std::uint32_t source) {
        const auto known = images_.find(source);
        if (known != images_.end()) return known->second;
        return images_.emplace(source, find_image(file_.element("images", source))).first->second;
    }

    bool is_clamped(const JsonAt& texture) {
        const auto index = texture.index_or_none("sampler", file_.count("samplers"), "samplers");
        if (!index) return false;
        const JsonAt sampler = file_.element("samplers", *index);
        const std::uint64_t s = sampler.count_or("wrapS", kRepeat);
        const std::uint64_t t = sampler.count_or("wrapT", kRepeat);
        if (s != t || s == kMirroredRepeat)
            odd_.add(file_.name(), "{}: repeats mirrored or along one side; taken as {}",
                     sampler.path(), s == kClampToEdge ? "clamped" : "repeated");
        return s == kClampToEdge;
    }

    TextureFile find_image(const JsonAt& image) {
        const auto uri = image.find("uri");
        if (!uri) return find_in_buffer(image);
        std::optional<std::string> data = data_of_uri(*uri);
        if (!data) return {.path = file_of_uri(*uri, file_.path()).native()};
        if (data->empty()) uri->fail("has no bytes");
        return {.path = file_.path().native(),
                .size = data->size(),
                .place = uri->path(),
                .content = std::make_shared<const std::string>(std::move(*data))};
    }

    TextureFile find_in_buffer(const JsonAt& image) {
        const View view = file_.view(image.at("bufferView"));
        if (view.bytes.empty()) image.fail("has no bytes");
        const Buffer& buffer = view.buffer;
        return TextureFile{.path = (buffer.data ? file_.path() : buffer.file).native(),
                           .offset = buffer.offset_in_file + view.offset,
                           .size = view.bytes.size(),
                           .place = image.path(),
                           .content = buffer.data};
    }

    const GltfFile& file_;
    Materials& result_;
    /// By their indices in the file.
    std::map<std::uint32_t, TextureFile> images_;
    WarningCount odd_;
};

// Joints are numbers of 16 bits.
constexpr std::size_t kMaxJoints = 65536;

// The numbers that a vertex has in JOINTS_n and in WEIGHTS_n.
constexpr std::size_t kPerSet = 4;

/// The largest number of weights above 0 that a vertex has, at least 1.
std::size_t most_used(std::span<const std::vector<float>> weights, std::size_t vertex_count) {
    std::size_t most = 1;
    for (std::size_t vertex = 0; vertex < vertex_count; ++vertex) {
        std::size_t used = 0;
        for (const std::vector<float>& set : weights)
            for (std::size_t k = 0; k < kPerSet; ++k) used += set[kPerSet * vertex + k] > 0;
        most = std::max(most, used);
    }
    return most;
}

void require_weights(const JsonAt& at, std::span<const float> weights) {
    for (std::size_t i = 0; i < weights.size(); ++i) {
        // False for NaN, too; weights are far below this.
        constexpr float kMost = 1e30f;
        if (weights[i] >= 0 && weights[i] <= kMost) continue;
        at.fail("vertex {} has the weight {}; must be finite and at least 0", i / kPerSet,
                weights[i]);
    }
}

Influences read_influences(const GltfFile& file, const JsonAt& attributes,
                           std::size_t vertex_count) {
    std::vector<std::vector<std::uint32_t>> joints;
    std::vector<std::vector<float>> weights;
    for (;;) {
        const std::string names[] = {fmt::format("JOINTS_{}", joints.size()),
                                     fmt::format("WEIGHTS_{}", joints.size())};
        const auto joint = attributes.find(names[0]);
        const auto weight = attributes.find(names[1]);
        if (!joint && !weight) break;
        if (!joint || !weight) attributes.fail("has no {}", names[joint ? 1 : 0]);
        joints.push_back(integers(file, *joint, kPerSet, vertex_count));
        weights.push_back(floats(file, *weight, kPerSet, vertex_count));
        require_weights(*weight, weights.back());
    }
    Influences result;
    if (joints.empty()) return result;
    result.per_vertex = most_used(weights, vertex_count);
    for (std::size_t vertex = 0; vertex < vertex_count; ++vertex) {
        const std::size_t begin = result.joints.size();
        const auto add = [&](std::uint32_t joint, float weight) {
            result.joints.push_back(static_cast<std::uint16_t>(joint));
            result.weights.push_back(weight);
            result.joint_limit = std::max(result.joint_limit, joint + 1);
        };
        for (std::size_t i = 0; i < kPerSet * joints.size(); ++i) {
            const std::size_t at = kPerSet * vertex + i % kPerSet;
            const float weight = weights[i / kPerSet][at];
            if (weight > 0) add(joints[i / kPerSet][at], weight);
        }
        if (result.joints.size() == begin)
            attributes.fail("vertex {} has no weight above 0", vertex);
        // The joint of a weight that is not needed is one that moves the vertex.
        while (result.joints.size() < begin + result.per_vertex) add(result.joints[begin], 0);
    }
    return result;
}

// Modes of primitives: smaller ones are points and lines, the last one is 6, a fan.
constexpr std::uint64_t kTriangles = 4;
constexpr std::uint64_t kStrip = 5;

std::size_t count_triangles(std::uint64_t mode, std::size_t corner_count) {
    return mode == kTriangles ? corner_count / 3 : corner_count - 2;
}

/// As the specification orders them (glTF 2.0, 3.7.2.1).
std::vector<uvec3> triangles_of(std::uint64_t mode, std::span<const std::uint32_t> corners) {
    std::vector<uvec3> triangles(count_triangles(mode, corners.size()));
    for (std::size_t i = 0; i < triangles.size(); ++i) {
        if (mode == kTriangles) {
            triangles[i] = {corners[3 * i], corners[3 * i + 1], corners[3 * i + 2]};
        } else if (mode == kStrip) {
            triangles[i] = {corners[i], corners[i + 1 + i % 2], corners[i + 2 - i % 2]};
        } else {
            triangles[i] = {corners[i + 1], corners[i + 2], corners[0]};
        }
    }
    return triangles;
}

/// The accessors that make a vertex set: primitives with the same ones share it.
std::string key_of_set(const JsonAt& primitive) {
    std::string key;
    const JsonAt attributes = primitive.at("attributes");
    const auto add = [&](const std::string& name) {
        const auto reference = attributes.find(name);
        if (reference) key += fmt::format("{} {} ", name, reference->count());
        return reference.has_value();
    };
    add("POSITION");
    for (int set = 0; add(fmt::format("JOINTS_{}", set)); ++set)
        add(fmt::format("WEIGHTS_{}", set));
    const auto targets = primitive.find("targets");
    for (std::size_t i = 0; targets && i < targets->size(); ++i) {
        const auto position = (*targets)[i].find("POSITION");
        key += position ? fmt::format("target {} ", position->count()) : "target ";
    }
    return key;
}

class MeshReader {
public:
    MeshReader(const GltfFile& file, const Materials& materials, const AnimationOptions& options)
        : file_(file), materials_(materials), options_(options) {}

    Mesh read(std::size_t index) {
        const JsonAt at = file_.element("meshes", index);
        Mesh mesh;
        const JsonAt primitives = at.at("primitives");
        std::map<std::string, std::size_t> sets;
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
        left_out_.tell(options_.warn);
        appearance_.tell(options_.warn);
    }

private:
    void read_primitive(const JsonAt& at, Mesh& mesh, std::map<std::string, std::size_t>& sets) {
        const std::uint64_t mode = at.count_or("mode", kTriangles);
        if (mode > 6) at.at("mode").fail("is {}; must be from 0 to 6", mode);
        const JsonAt attributes = at.at("attributes");
        if (mode < kTriangles || !attributes.find("POSITION")) {
            left_out_.add(file_.name(), "{}: {}; left out", at.path(),
                          mode < kTriangles ? "points or lines, no triangles" : "no positions");
            return;
        }
        const auto [known, is_new] = sets.try_emplace(key_of_set(at), mesh.sets.size());
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

    std::vector<vec3> read_vectors(const JsonAt& reference, std::size_t vertex_count) {
        const std::vector<float> values = floats(file_, reference, 3, vertex_count);
        std::vector<vec3> vectors(values.size() / 3);
        for (std::size_t i = 0; i < vectors.size(); ++i)
            vectors[i] = {values[3 * i], values[3 * i + 1], values[3 * i + 2]};
        return vectors;
    }

    VertexSet read_set(const JsonAt& at) {
        const JsonAt attributes = at.at("attributes");
        VertexSet set;
        set.positions = read_vectors(attributes.at("POSITION"), 0);
        const auto targets = at.find("targets");
        for (std::size_t i = 0; targets && i < targets->size(); ++i) {
            std::vector<vec3>& target = set.targets.emplace_back();
            if (const auto moved = (*targets)[i].find("POSITION"))
                target = read_vectors(*moved, set.positions.size());
        }
        set.influences = read_influences(file_, attributes, set.positions.size());
        return set;
    }

    std::vector<uvec3> read_triangles(const JsonAt& at, std::uint64_t mode,
                                      std::size_t vertex_count) {
        const auto reference = at.find("indices");
        std::vector<std::uint32_t> corners;
        if (reference) {
            corners = integers(file_, *reference, 1, 0);
        } else {
            corners.resize(vertex_count);
            std::iota(corners.begin(), corners.end(), 0u);
        }
        if (corners.size() < 3 || (mode == kTriangles && corners.size() % 3 != 0)) {
            (reference ? *reference : at)
                .fail("{} corners are no {}", corners.size(),
                      mode == kTriangles ? "triangles" : "strip or fan");
        }
        triangle_count_ += count_triangles(mode, corners.size());
        if (triangle_count_ > kMaxTriangles) {
            throw Error(ErrorKind::kLimit, "{}: more than 2^28 triangles; split the scene",
                        file_.name());
        }
        for (std::size_t i = 0; i < corners.size(); ++i) {
            if (corners[i] < vertex_count) continue;
            reference->fail("index {} is {}, but there are {} vertices", i, corners[i],
                            vertex_count);
        }
        return triangles_of(mode, corners);
    }

    std::vector<Texcoord> read_texcoords(const JsonAt& attributes, const Primitive& primitive,
                                         std::size_t vertex_count) {
        if (!primitive.material) return {};
        const Material& material = materials_.materials[*primitive.material];
        const TexcoordUse& use = material.texcoords;
        if (material.texture == kNoTexture) return {};
        const auto reference = attributes.find(fmt::format("TEXCOORD_{}", use.set));
        if (!reference) attributes.fail("has no TEXCOORD_{} for its texture", use.set);
        const std::vector<float> values = floats(file_, *reference, 2, vertex_count);
        std::vector<Texcoord> texcoords(vertex_count);
        for (std::size_t i = 0; i < vertex_count; ++i) {
            const auto mapped = [&](const std::array<double, 3>& row) {
                return static_cast<float>((row[0] * static_cast<double>(values[2 * i]) +
                                           row[1] * static_cast<double>(values[2 * i + 1])) +
                                          row[2]);
            };
            const float u = mapped(use.u);
            const float v = mapped(use.v);
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
    std::uint64_t triangle_count_ = 0;
    WarningCount left_out_, appearance_;
};

}  // namespace

Materials read_materials(const GltfFile& file, const AnimationOptions& options) {
    Materials result;
    MaterialReader reader(file, result);
    const std::size_t count = file.count("materials");
    for (std::size_t i = 0; i < count; ++i) reader.read(file.element("materials", i));
    reader.tell(options.warn);
    return result;
}

Skin read_skin(const GltfFile& file, std::size_t index) {
    const JsonAt at = file.element("skins", index);
    const JsonAt joints = at.at("joints");
    const std::size_t joint_count = joints.size();
    if (joint_count == 0 || joint_count > kMaxJoints)
        joints.fail("has {} joints; must be from 1 to {}", joint_count, kMaxJoints);
    Skin skin;
    for (std::size_t i = 0; i < joint_count; ++i)
        skin.joints.push_back(joints[i].index_below(file.count("nodes"), "nodes"));
    skin.inverse_binds.resize(joint_count);
    const auto reference = at.find("inverseBindMatrices");
    if (!reference) return skin;
    const std::vector<float> values = floats(file, *reference, 16);
    if (values.size() / 16 < joint_count)
        reference->fail("has {} matrices for {} joints", values.size() / 16, joint_count);
    for (std::size_t i = 0; i < joint_count; ++i)
        skin.inverse_binds[i] = matrix_of(&values[16 * i]);
    return skin;
}

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
