#include "scenes/gltf/gltf_scene.h"

#include <fmt/format.h>

#include <utility>

#include <glm/geometric.hpp>

#include "common/base/errors.h"
#include "scenes/mesh/mesh_file.h"
#include "scenes/mesh/mesh_rules.h"

namespace mray::gltf {
namespace {

constexpr std::uint64_t kMaxVertices = 3 * kMaxTriangles;
// Each has a weight in every pose.
constexpr std::uint64_t kMaxTargets = std::uint64_t{1} << 22;

bool shows_mesh(const Node& node) { return node.mesh && !node.has_instances; }

class SceneReader {
public:
    SceneReader(const std::filesystem::path& path, const AnimationOptions& options)
        : options_(options), file_(path, options.warn) {}

    GltfScene run() {
        const std::size_t animation = find_animation(file_, options_.animation);
        scene_.tree = read_nodes(file_);
        materials_ = read_materials(file_, options_);
        read_meshes();
        for (std::string& name : animation_names(file_)) scene_.animations.push_back({name});
        if (!scene_.animations.empty()) {
            read_animation(file_, animation, options_, scene_);
            scene_.animations[animation].is_shown = true;
        }
        require_limits();
        find_mirrored();
        for (const std::uint32_t node : scene_.tree.scene)
            if (shows_mesh(scene_.tree.nodes[node])) add_node(node);
        if (!has_normals_) scene_.smooth = {};
        if (!has_textures_) scene_.textures = {};
        release_lists();
        require_content();
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
        const JsonAt at = file_.element("nodes", node.file_index);
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
            if (!shows_mesh(node)) continue;
            const Mesh& mesh = scene_.meshes.at(*node.mesh);
            for (const Primitive& primitive : mesh.primitives)
                triangles += primitive.triangles.size();
            for (const VertexSet& set : mesh.sets) vertices += set.positions.size();
            targets += mesh.sets.size() * mesh.target_count;
            if (triangles <= kMaxTriangles && vertices <= kMaxVertices && targets <= kMaxTargets)
                continue;
            file_.element("nodes", node.file_index)
                .at("mesh")
                .fail(
                    "all instances have more than 2^28 triangles or 2^22 morph targets; split the "
                    "scene");
        }
        if (options_.check_size) options_.check_size(triangles, vertices);
    }

    /// Finds the nodes whose map to the scene mirrors: it has an odd number of mirroring maps.
    void find_mirrored() {
        const std::vector<Node>& nodes = scene_.tree.nodes;
        is_mirrored_.resize(nodes.size());
        for (const std::uint32_t index : scene_.tree.parents_first) {
            const Node& node = nodes[index];
            const Affine map = node.matrix ? *node.matrix : affine_of(node.trs);
            const auto& [x, y, z, origin] = map.column;
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
            scene_.parts.push_back({index, &set, is_skinned ? node.skin : std::nullopt, first});
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

    /// Frees what only the topology is made of.
    void release_lists() {
        if (has_textures_) scene_.textures.files = std::move(materials_.textures);
        for (auto& [index, mesh] : scene_.meshes) mesh.primitives = {};
    }

    void require_content() const {
        if (!scene_.topology.triangles.empty()) return;
        throw Error(ErrorKind::kBadInput, "{}: its scene has no triangles", file_.name());
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
