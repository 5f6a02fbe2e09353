#include "lab/accuracy/methods/median_tree.h"

#include <algorithm>
#include <numeric>

#include "common/bvh/box.h"
#include "common/bvh/builder/binary_tree.h"
#include "common/bvh/builder/meshlet.h"
#include "cpu/refit/refit.h"

namespace mray::accuracy {
namespace {

using Part = std::span<std::uint32_t>;  // of the triangles' ids

class MedianBuilder {
public:
    MedianBuilder(const Topology& topology, std::span<const vec3> positions)
        : topology_(topology), positions_(positions), prim_ids_(topology.triangles.size()) {
        std::iota(prim_ids_.begin(), prim_ids_.end(), 0u);
        for (const std::uint32_t id : prim_ids_) {
            const PrimRef ref = make_ref(topology, positions, id);
            centroids_.push_back({ref.centroid2(0), ref.centroid2(1), ref.centroid2(2)});
        }
    }

    Bvh build() {
        bvh_.triangle_count = static_cast<std::uint32_t>(prim_ids_.size());
        bvh_.node_parents = {kNoParent};
        bvh_.level_begin = {0, 1};
        std::vector<Part> nodes{prim_ids_};
        for (std::uint32_t i = 0; i < nodes.size(); ++i) {
            if (i == bvh_.level_begin.back())
                bvh_.level_begin.push_back(static_cast<std::uint32_t>(nodes.size()));
            add_node(i, nodes);
        }
        cpu::refit(bvh_, positions_);
        return std::move(bvh_);
    }

private:
    /// Sorts a part if it is small enough, and sets its shape if it fits a leaf.
    bool fits_leaf(Part part, LeafShape& shape) const {
        if (part.size() > kLeafTriangles) return false;
        std::sort(part.begin(), part.end());
        return find_leaf_shape(topology_, part, shape);
    }
    bool fits_leaf(Part part) const {
        LeafShape shape;
        return fits_leaf(part, shape);
    }

    /// Orders a part so that its first half is below the median.
    void halve(Part part) const {
        Box bounds;
        for (const std::uint32_t id : part) bounds.extend(centroids_[id]);
        const vec3 extent = bounds.upper - bounds.lower;
        const int axis = extent.x >= extent.y && extent.x >= extent.z ? 0
                         : extent.y >= extent.z                       ? 1
                                                                      : 2;
        std::nth_element(part.begin(), part.begin() + static_cast<std::ptrdiff_t>(part.size() / 2),
                         part.end(), [&](std::uint32_t a, std::uint32_t b) {
                             return std::pair(centroids_[a][axis], a) <
                                    std::pair(centroids_[b][axis], b);
                         });
    }

    void add_node(std::uint32_t index, std::vector<Part>& nodes) {
        std::vector<Part> parts;
        if (!nodes[index].empty()) parts.push_back(nodes[index]);
        while (parts.size() < kWidth) {
            const auto largest =
                std::max_element(parts.begin(), parts.end(), [this](Part a, Part b) {
                    return (fits_leaf(a) ? 0 : a.size()) < (fits_leaf(b) ? 0 : b.size());
                });
            if (largest == parts.end() || fits_leaf(*largest)) break;
            const Part whole = *largest;
            halve(whole);
            *largest = whole.first(whole.size() / 2);
            parts.push_back(whole.subspan(whole.size() / 2));
        }
        write_node(index, parts, nodes);
    }

    void write_node(std::uint32_t index, std::span<const Part> parts, std::vector<Part>& nodes) {
        Node node;
        for (std::uint32_t slot = 0; slot < kWidth; ++slot) {
            set_slot_box(node, slot, Box());
            node.child[slot] = kEmptyChild;
            if (slot >= parts.size()) continue;
            LeafShape shape;
            if (fits_leaf(parts[slot], shape)) {
                node.child[slot] = kLeafBit | static_cast<std::uint32_t>(bvh_.leaves.size());
                bvh_.leaf_parents.push_back(index * kWidth + slot);
                add_leaf(parts[slot], shape);
            } else {
                node.child[slot] = static_cast<std::uint32_t>(nodes.size());
                bvh_.node_parents.push_back(index * kWidth + slot);
                nodes.push_back(parts[slot]);
            }
        }
        bvh_.nodes.push_back(node);
    }

    void add_leaf(Part part, const LeafShape& shape) {
        const std::size_t index = bvh_.leaves.size();
        bvh_.leaves.emplace_back();
        bvh_.leaf_vertices.resize((index + 1) * kLeafVertices);
        fill_leaf(shape, part, positions_, bvh_.leaves.back(),
                  &bvh_.leaf_vertices[index * kLeafVertices]);
    }

    const Topology& topology_;
    std::span<const vec3> positions_;
    std::vector<std::uint32_t> prim_ids_;
    std::vector<vec3> centroids_;
    Bvh bvh_;
};

}  // namespace

Bvh build_median_tree(const Topology& topology, std::span<const vec3> positions) {
    return MedianBuilder(topology, positions).build();
}

}  // namespace mray::accuracy
