#include "scenes/gltf/gltf_scene.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <span>
#include <utility>

namespace mray::gltf {
namespace {

void read_matrix(const JsonAt& at, Node& node) {
    std::array<double, 16> m = {};
    at.numbers(m);
    if (m[3] != 0 || m[7] != 0 || m[11] != 0 || m[15] != 1)
        at.fail("has a last row other than 0, 0, 0, 1");
    Affine matrix;
    for (std::size_t k = 0; k < 4; ++k) matrix.column[k] = {m[4 * k], m[4 * k + 1], m[4 * k + 2]};
    node.matrix = matrix;
}

void read_transformation(const JsonAt& at, Node& node) {
    if (const auto matrix = at.find("matrix")) {
        for (const char* const other : {"translation", "rotation", "scale"})
            if (at.find(other)) at.fail("has both matrix and {}", other);
        read_matrix(*matrix, node);
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

/// The places of the instances of a node's mesh (kInstancing); nothing without them.
std::vector<Trs> read_instances(const JsonAt& node, const GltfFile& file) {
    const auto extension = extension_of(node, kInstancing);
    const auto attributes = extension ? extension->find("attributes") : std::nullopt;
    std::vector<Trs> instances;
    if (!attributes) return instances;
    const auto read = [&](const char* name, std::size_t width, auto set) {
        const auto reference = attributes->find(name);
        if (!reference) return;
        const std::vector<float> values =
            floats(file, *reference, {.width = width, .integers = Wanted::Integers::kNormalized});
        if (instances.empty()) instances.resize(values.size() / width);
        if (instances.size() != values.size() / width)
            reference->fail("has {} elements, but another attribute {}", values.size() / width,
                            instances.size());
        for (std::size_t i = 0; i < instances.size(); ++i) set(instances[i], &values[width * i]);
    };
    read("TRANSLATION", 3, [](Trs& trs, const float* v) { trs.translation = {v[0], v[1], v[2]}; });
    read("ROTATION", 4, [](Trs& trs, const float* v) {
        trs.rotation = unit_quaternion({v[0], v[1], v[2], v[3]});
    });
    read("SCALE", 3, [](Trs& trs, const float* v) { trs.scale = {v[0], v[1], v[2]}; });
    return instances;
}

/// Makes the instances of a mesh nodes below its own.
void add_instances(const GltfFile& file, std::vector<Node>& nodes) {
    const std::size_t count = nodes.size();
    for (std::size_t i = 0; i < count; ++i) {
        // Joints place a skinned mesh, wherever its node is.
        if (!nodes[i].mesh || nodes[i].skin) continue;
        const std::vector<Trs> places = read_instances(file.element("nodes", i), file);
        nodes[i].has_instances = !places.empty();
        for (const Trs& place : places) {
            nodes[i].children.push_back(static_cast<std::uint32_t>(nodes.size()));
            Node instance;
            instance.file_index = static_cast<std::uint32_t>(i);
            instance.trs = place;
            instance.mesh = nodes[i].mesh;
            instance.weights = nodes[i].weights;
            nodes.push_back(std::move(instance));
        }
    }
}

Node read_node(const JsonAt& at, const GltfFile& file) {
    Node node;
    if (const auto children = at.find("children")) {
        for (std::size_t i = 0; i < children->size(); ++i)
            node.children.push_back((*children)[i].index_below(file.count("nodes"), "nodes"));
    }
    read_transformation(at, node);
    node.mesh = at.index_or_none("mesh", file.count("meshes"), "meshes");
    node.skin = at.index_or_none("skin", file.count("skins"), "skins");
    if (node.skin && !node.mesh) at.at("skin").fail("belongs to a mesh, which the node has not");
    if (const auto weights = at.find("weights")) {
        node.weights.resize(weights->size());
        weights->numbers(node.weights);
    }
    return node;
}

void set_parents(const GltfFile& file, std::vector<Node>& nodes) {
    for (std::size_t i = 0; i < nodes.size(); ++i) {
        for (std::size_t k = 0; k < nodes[i].children.size(); ++k) {
            Node& child = nodes[nodes[i].children[k]];
            if (child.parent != kNoNode) {
                file.element("nodes", i)
                    .at("children")[k]
                    .fail("is {}, which is a child of nodes[{}] already", nodes[i].children[k],
                          child.parent);
            }
            child.parent = static_cast<std::uint32_t>(i);
        }
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
    const std::size_t node_count = tree.nodes.size();
    std::vector<std::uint32_t> listed;
    std::vector<bool> is_listed(node_count);
    for (std::size_t i = 0; i < roots->size(); ++i) {
        const std::uint32_t root = (*roots)[i].index_below(file.count("nodes"), "nodes");
        if (is_listed[root]) (*roots)[i].fail("is {}, which is there twice", root);
        is_listed[root] = true;
        listed.push_back(root);
    }
    // A node below a listed one is in its tree already.
    std::vector<bool> is_below(node_count);
    for (const std::uint32_t node : tree.parents_first) {
        const std::uint32_t parent = tree.nodes[node].parent;
        is_below[node] = parent != kNoNode && (is_listed[parent] || is_below[parent]);
    }
    std::vector<std::uint32_t> order;
    for (const std::uint32_t root : listed)
        if (!is_below[root]) append_tree(tree.nodes, root, order);
    return order;
}

}  // namespace

NodeTree read_nodes(const GltfFile& file) {
    NodeTree tree;
    const std::size_t count = file.count("nodes");
    tree.nodes.reserve(count);
    for (std::size_t i = 0; i < count; ++i)
        tree.nodes.push_back(read_node(file.element("nodes", i), file));
    for (std::size_t i = 0; i < count; ++i)
        tree.nodes[i].file_index = static_cast<std::uint32_t>(i);
    add_instances(file, tree.nodes);
    set_parents(file, tree.nodes);
    std::vector<bool> is_reached(tree.nodes.size());
    for (std::size_t i = 0; i < count; ++i) {
        if (tree.nodes[i].parent != kNoNode) continue;
        append_tree(tree.nodes, static_cast<std::uint32_t>(i), tree.parents_first);
    }
    for (const std::uint32_t node : tree.parents_first) is_reached[node] = true;
    for (std::size_t i = 0; i < count; ++i)
        if (!is_reached[i]) file.element("nodes", i).fail("is its own ancestor");
    tree.scene = scene_of(file, tree);
    return tree;
}

}  // namespace mray::gltf
