#include "scenes/gltf/gltf_scene.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include <glm/geometric.hpp>

#include "common/text/text.h"

namespace mray::gltf {
namespace {

void read_transformation(const JsonAt& at, Node& node) {
    if (const auto matrix = at.find("matrix")) {
        for (const char* const other : {"translation", "rotation", "scale"})
            if (at.find(other)) at.fail("has both matrix and {}", other);
        std::array<double, 16> m = {};
        matrix->numbers(m);
        if (m[3] != 0 || m[7] != 0 || m[11] != 0 || m[15] != 1)
            matrix->fail("has a last row other than 0, 0, 0, 1");
        node.matrix = matrix_of(m.data());
    }
    at.numbers_of("translation", std::span(&node.trs.translation.x, 3));
    at.numbers_of("scale", std::span(&node.trs.scale.x, 3));
    if (const auto rotation = at.find("rotation")) {
        glm::dvec4 numbers(0.0);
        rotation->numbers(std::span(&numbers.x, 4));
        const double square = dot(numbers, numbers);
        if (!(square > 0) || !std::isfinite(square)) rotation->fail("has no direction");
        node.trs.rotation = unit_quaternion(numbers);
    }
}

/// Reads a node, and makes it the parent of its children.
void read_node(const GltfFile& file, std::uint32_t index, std::vector<Node>& nodes) {
    const JsonAt at = file.element("nodes", index);
    Node& node = nodes[index];
    const auto children = at.find("children");
    for (std::size_t i = 0; children && i < children->size(); ++i) {
        const JsonAt child = (*children)[i];
        node.children.push_back(child.index_below(nodes.size(), "nodes"));
        std::uint32_t& parent = nodes[node.children.back()].parent;
        if (parent != kNoNode) {
            child.fail("is {}, which is a child of nodes[{}] already", node.children.back(),
                       parent);
        }
        parent = index;
    }
    read_transformation(at, node);
    node.mesh = at.index_or_none("mesh", file.count("meshes"), "meshes");
    node.skin = at.index_or_none("skin", file.count("skins"), "skins");
    if (node.skin && !node.mesh) at.at("skin").fail("belongs to a mesh, which the node has not");
    if (const auto weights = at.find("weights")) {
        node.weights.resize(weights->size());
        weights->numbers(node.weights);
    }
}

/// Depth first. Each node has one parent, so that those below a root form no cycle.
void append_tree(const std::vector<Node>& nodes, std::uint32_t root,
                 std::vector<std::uint32_t>& order) {
    std::vector<std::uint32_t> open = {root};
    while (!open.empty()) {
        const Node& node = nodes[open.back()];
        order.push_back(open.back());
        open.pop_back();
        open.insert(open.end(), node.children.rbegin(), node.children.rend());
    }
}

std::vector<std::uint32_t> scene_of(const GltfFile& file, const NodeTree& tree) {
    const std::size_t scene_count = file.count("scenes");
    const std::uint32_t index =
        file.root().index_or_none("scene", scene_count, "scenes").value_or(0);
    if (scene_count == 0) return tree.parents_first;
    const auto roots = file.element("scenes", index).find("nodes");
    if (!roots) return {};
    std::vector<std::uint32_t> order;
    std::vector<bool> is_listed(tree.nodes.size());
    for (std::size_t i = 0; i < roots->size(); ++i) {
        const JsonAt at = (*roots)[i];
        const std::uint32_t root = at.index_below(tree.nodes.size(), "nodes");
        if (is_listed[root]) at.fail("is {}, which is there twice", root);
        is_listed[root] = true;
        const std::uint32_t parent = tree.nodes[root].parent;
        if (parent != kNoNode)
            at.fail("is {}, which is a child of nodes[{}]; scenes list roots", root, parent);
        append_tree(tree.nodes, root, order);
    }
    return order;
}

/// Throws Error(kBadInput), also for a node with two parents or one that is its own ancestor.
NodeTree read_nodes(const GltfFile& file) {
    NodeTree tree;
    const auto count = static_cast<std::uint32_t>(file.count("nodes"));
    tree.nodes.resize(count);
    for (std::uint32_t i = 0; i < count; ++i) read_node(file, i, tree.nodes);
    for (std::uint32_t i = 0; i < count; ++i)
        if (tree.nodes[i].parent == kNoNode) append_tree(tree.nodes, i, tree.parents_first);
    std::vector<bool> is_reached(tree.nodes.size());
    for (const std::uint32_t node : tree.parents_first) is_reached[node] = true;
    for (std::uint32_t i = 0; i < count; ++i)
        if (!is_reached[i]) file.element("nodes", i).fail("is its own ancestor");
    tree.scene = scene_of(file, tree);
    return tree;
}

// Beyond this, neighbouring frames cannot be distinguished.
constexpr float kMostSeconds = 1e6f;

Target target_of(const JsonAt& path) {
    constexpr std::pair<std::string_view, Target> kTargets[] = {
        {"translation", Target::kTranslation},
        {"rotation", Target::kRotation},
        {"scale", Target::kScale},
        {"weights", Target::kWeights}};
    for (const auto& [name, target] : kTargets)
        if (path.text() == name) return target;
    path.fail("is {}; must be translation, rotation, scale or weights", quote(path.text()));
}

Interpolation interpolation_of(const JsonAt& sampler) {
    const auto given = sampler.find("interpolation");
    if (!given || given->text() == "LINEAR") return Interpolation::kLinear;
    if (given->text() == "STEP") return Interpolation::kStep;
    if (given->text() == "CUBICSPLINE") return Interpolation::kCubicSpline;
    given->fail("is {}; must be LINEAR, STEP or CUBICSPLINE", quote(given->text()));
}

class AnimationReader {
public:
    AnimationReader(const GltfFile& file, std::size_t index, GltfScene& scene)
        : file_(file), at_(file.element("animations", index)), scene_(scene) {}

    void read() {
        const JsonAt channels = at_.at("channels");
        for (std::size_t i = 0; i < channels.size(); ++i) read_channel(channels[i]);
    }

private:
    void read_channel(const JsonAt& at) {
        const JsonAt target = at.at("target");
        const auto node = target.index_or_none("node", file_.count("nodes"), "nodes");
        if (!node) return;  // An extension's target.
        const JsonAt samplers = at_.at("samplers");
        const JsonAt sampler = samplers[at.at("sampler").index_below(samplers.size(), "samplers")];
        Channel channel{.node = *node,
                        .target = target_of(target.at("path")),
                        .interpolation = interpolation_of(sampler)};
        if (!known_.insert({channel.node, channel.target}).second)
            target.fail("is that of another channel, too");
        channel.times = times_of(sampler.at("input"));
        scene_.animation.seconds =
            std::max(scene_.animation.seconds, static_cast<double>(channel.times.back()));
        const Node& moved = scene_.tree.nodes[*node];
        if (channel.target == Target::kWeights) {
            const auto mesh = moved.mesh ? scene_.meshes.find(*moved.mesh) : scene_.meshes.end();
            // The mesh of a node that is not shown has not been read.
            if (moved.mesh && mesh == scene_.meshes.end()) return;
            channel.width = moved.mesh ? mesh->second.target_count : 0;
            if (channel.width == 0) target.fail("has no morph targets");
        } else if (moved.matrix) {
            file_.element("nodes", *node)
                .at("matrix")
                .fail(
                    "stands in a node that an animation moves; give translation, rotation and "
                    "scale");
        }
        if (channel.target == Target::kRotation) channel.width = 4;
        channel.values = values_of(sampler.at("output"), channel);
        scene_.animation.channels.push_back(channel);
    }

    std::span<const float> numbers_of(const JsonAt& reference, std::size_t width) {
        const std::pair key(reference.index_below(file_.count("accessors"), "accessors"), width);
        auto known = scene_.animation.numbers.find(key);
        if (known == scene_.animation.numbers.end()) {
            std::vector<float> values = floats(file_, reference, width);
            known = scene_.animation.numbers.emplace(key, std::move(values)).first;
            for (std::size_t i = 0; i < known->second.size(); ++i)
                if (!std::isfinite(known->second[i])) reference.fail("number {} is not finite", i);
        }
        return known->second;
    }

    std::span<const float> times_of(const JsonAt& reference) {
        const std::span<const float> times = numbers_of(reference, 1);
        for (std::size_t i = 0; i < times.size(); ++i) {
            if (times[i] >= 0 && times[i] <= kMostSeconds && (i == 0 || times[i] > times[i - 1]))
                continue;
            reference.fail("time {} is {}; times must increase, from 0 to {}", i, times[i],
                           kMostSeconds);
        }
        return times;
    }

    std::span<const float> values_of(const JsonAt& reference, const Channel& channel) {
        const std::span<const float> values =
            numbers_of(reference, channel.target == Target::kWeights ? 1 : channel.width);
        const std::size_t parts =
            channel.interpolation == Interpolation::kCubicSpline ? kSplineValues : 1;
        if (values.size() / parts / channel.width != channel.times.size() ||
            values.size() % (parts * channel.width) != 0) {
            reference.fail("has {} numbers for {} times of {}", values.size(), channel.times.size(),
                           parts * channel.width);
        }
        return values;
    }

    const GltfFile& file_;
    const JsonAt at_;
    GltfScene& scene_;
    std::set<std::pair<std::uint32_t, Target>> known_;
};

std::vector<NamedAnimation> read_names(const GltfFile& file) {
    std::vector<NamedAnimation> animations(file.count("animations"));
    for (std::size_t i = 0; i < animations.size(); ++i) {
        const auto name = file.element("animations", i).find("name");
        if (name && name->is_text()) animations[i].name = name->text();
    }
    return animations;
}

/// The animation of this name or index, or the first. Throws Error(kBadArgument) with the names.
std::size_t find_animation(std::span<const NamedAnimation> animations, const std::string& text,
                           const std::string& file) {
    if (text.empty()) return 0;
    if (animations.empty()) {
        throw Error(ErrorKind::kBadArgument, "animation {}: {} has no animations", quote(text),
                    file);
    }
    const auto named = std::ranges::find(animations, text, &NamedAnimation::name);
    if (named != animations.end()) return static_cast<std::size_t>(named - animations.begin());
    const std::optional<std::uint64_t> index = parse_unsigned(text);
    if (index && *index < animations.size()) return static_cast<std::size_t>(*index);
    std::string list;
    for (std::size_t i = 0; i < animations.size(); ++i)
        list += fmt::format("{}{} {}", i == 0 ? "" : ", ", i, quote(animations[i].name));
    throw Error(ErrorKind::kBadArgument, "animation {}: {} has no such one; choose one of {}",
                quote(text), file, list);
}

constexpr std::uint64_t kMaxVertices = 3 * kMaxTriangles;
// Each has a weight in every pose.
constexpr std::uint64_t kMaxTargets = std::uint64_t{1} << 22;

class SceneReader {
public:
    SceneReader(const std::filesystem::path& path, const AnimationOptions& options)
        : options_(options), file_(path, options.warn) {}

    GltfScene run() {
        scene_.animations = read_names(file_);
        const std::size_t animation =
            find_animation(scene_.animations, options_.animation, file_.name());
        scene_.tree = read_nodes(file_);
        materials_ = read_materials(file_, options_);
        read_meshes();
        if (!scene_.animations.empty()) {
            AnimationReader(file_, animation, scene_).read();
            scene_.animations[animation].is_shown = true;
        }
        require_limits();
        find_mirrored();
        for (const std::uint32_t node : scene_.tree.scene)
            if (scene_.tree.nodes[node].mesh) add_node(node);
        if (!has_normals_) scene_.smooth = {};
        if (!has_textures_) scene_.textures = {};
        // Frees the lists that the topology was made from.
        if (has_textures_) scene_.textures.files = std::move(materials_.textures);
        for (auto& [index, mesh] : scene_.meshes) mesh.primitives = {};
        if (scene_.topology.triangles.empty())
            throw Error(ErrorKind::kBadInput, "{}: its scene has no triangles", file_.name());
        return std::move(scene_);
    }

private:
    void read_meshes() {
        std::vector<std::uint32_t> used;
        for (const std::uint32_t index : scene_.tree.scene) {
            const Node& node = scene_.tree.nodes[index];
            if (node.mesh) used.push_back(*node.mesh);
            if (node.skin && !scene_.skins.contains(*node.skin))
                scene_.skins.emplace(*node.skin, read_skin(file_, *node.skin));
        }
        scene_.meshes = gltf::read_meshes(file_, materials_, used, options_);
        for (const std::uint32_t index : scene_.tree.scene) check_node(index);
    }

    /// Throws Error(kBadInput) for a node whose weights or skin do not fit its mesh.
    void check_node(std::uint32_t index) const {
        const Node& node = scene_.tree.nodes[index];
        if (!node.mesh) return;
        const Mesh& mesh = scene_.meshes.at(*node.mesh);
        const JsonAt at = file_.element("nodes", index);
        if (!node.weights.empty() && node.weights.size() != mesh.target_count) {
            at.at("weights").fail("has {} numbers for {} morph targets", node.weights.size(),
                                  mesh.target_count);
        }
        if (!node.skin) return;
        const std::size_t joint_count = scene_.skins.at(*node.skin).joints.size();
        for (const VertexSet& set : mesh.sets) {
            if (set.influences.joint_limit <= joint_count) continue;
            at.at("skin").fail("has {} joints, but meshes[{}] uses joint {}", joint_count,
                               *node.mesh, set.influences.joint_limit - 1);
        }
    }

    void require_limits() const {
        std::uint64_t triangles = 0;
        std::uint64_t vertices = 0;
        std::uint64_t targets = 0;
        for (const std::uint32_t index : scene_.tree.scene) {
            const Node& node = scene_.tree.nodes[index];
            if (!node.mesh) continue;
            const Mesh& mesh = scene_.meshes.at(*node.mesh);
            for (const Primitive& primitive : mesh.primitives)
                triangles += primitive.triangles.size();
            for (const VertexSet& set : mesh.sets) vertices += set.positions.size();
            targets += mesh.sets.size() * mesh.target_count;
            if (triangles <= kMaxTriangles && vertices <= kMaxVertices && targets <= kMaxTargets)
                continue;
            file_.element("nodes", index)
                .at("mesh")
                .fail(
                    "all nodes have more than 2^28 triangles or 2^22 morph targets; split the "
                    "scene");
        }
        if (options_.check_size) options_.check_size(triangles, vertices);
    }

    /// Finds the nodes whose map to the scene mirrors: it has an odd number of mirroring maps.
    void find_mirrored() {
        is_mirrored_.resize(scene_.tree.nodes.size());
        for (const std::uint32_t index : scene_.tree.parents_first) {
            const Node& node = scene_.tree.nodes[index];
            const auto [x, y, z, origin] = node.rest().column;
            const bool mirrors = glm::dot(glm::cross(x, y), z) < 0;
            is_mirrored_[index] = mirrors != (node.parent != kNoNode && is_mirrored_[node.parent]);
        }
    }

    void add_node(std::uint32_t index) {
        const Node& node = scene_.tree.nodes[index];
        const Mesh& mesh = scene_.meshes.at(*node.mesh);
        std::vector<std::uint32_t> first_vertices;
        for (const VertexSet& set : mesh.sets) {
            const std::uint32_t first = scene_.topology.vertex_count;
            first_vertices.push_back(first);
            const bool is_skinned = node.skin && set.influences.per_vertex > 0;
            scene_.placed_sets.push_back(
                {index, &set, is_skinned ? node.skin : std::nullopt, first});
            scene_.topology.vertex_count += static_cast<std::uint32_t>(set.positions.size());
        }
        SmoothNumbers numbers;
        for (const Primitive& primitive : mesh.primitives) {
            const std::size_t set = primitive.vertex_set;
            const bool is_skinned = node.skin && mesh.sets[set].influences.per_vertex > 0;
            add_primitive(mesh, primitive, first_vertices[set], is_mirrored_[index] && !is_skinned,
                          numbers);
        }
    }

    /// Corners of a mirrored mesh go the other way (glTF 2.0, 3.7.4). Joints alone place a skin.
    void add_primitive(const Mesh& mesh, const Primitive& primitive, std::uint32_t first_vertex,
                       bool is_mirrored, SmoothNumbers& numbers) {
        const Material material = primitive.material ? materials_.materials[*primitive.material]
                                                     : Material{.albedo = kClay};
        if (material.is_cut_away) return;
        const bool is_textured = !primitive.texcoords.empty();
        has_textures_ = has_textures_ || is_textured;
        has_normals_ = has_normals_ || !primitive.normals.empty();
        const std::vector<vec3>& positions = mesh.sets[primitive.vertex_set].positions;
        const std::vector<vec3>& normals = primitive.normals;
        std::vector<std::uint32_t> vertex_numbers(normals.size(), SmoothNumbers::kNone);
        for (const uvec3& given : primitive.triangles) {
            const uvec3 t = is_mirrored ? uvec3(given.x, given.z, given.y) : given;
            const auto corner = static_cast<std::uint32_t>(3 * scene_.topology.triangles.size());
            scene_.topology.triangles.push_back(
                {t.x + first_vertex, t.y + first_vertex, t.z + first_vertex});
            scene_.topology.albedo.push_back(material.albedo);
            uvec3& smooth = scene_.smooth.emplace_back(corner, corner + 1, corner + 2);
            for (int k = 0; k < 3 && !normals.empty(); ++k) {
                smooth[k] = numbers.number_of(vertex_numbers[t[k]], positions[t[k]], normals[t[k]],
                                              smooth[k]);
            }
            if (materials_.textures.empty()) continue;
            scene_.textures.texture_ids.push_back(is_textured ? material.texture : kNoTexture);
            scene_.textures.texcoords.push_back(is_textured ? Texcoords{primitive.texcoords[t.x],
                                                                        primitive.texcoords[t.y],
                                                                        primitive.texcoords[t.z]}
                                                            : Texcoords{});
        }
    }

    const AnimationOptions& options_;
    GltfFile file_;
    Materials materials_;
    GltfScene scene_;
    std::vector<bool> is_mirrored_;
    bool has_normals_ = false;
    bool has_textures_ = false;
};

}  // namespace

GltfScene read_gltf_scene(const std::filesystem::path& path, const AnimationOptions& options) {
    return SceneReader(path, options).run();
}

}  // namespace mray::gltf
