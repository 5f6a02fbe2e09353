#include "common/bvh/builder/bvh_builder.h"

#include "common/base/thread_arena.h"
#include "common/bvh/builder/layout.h"

namespace mray {

Bvh build_bvh(const Topology& topology, std::span<const vec3> positions,
              const BuildConfig& config) {
    if (topology.triangles.size() > kMaxTriangles) {
        throw Error(ErrorKind::kLimit, "{} triangles are more than a tree can hold ({})",
                    topology.triangles.size(), kMaxTriangles);
    }
    return ThreadArena(config.threads).execute([&] {
        BinaryTree tree = build_binary_tree(topology, positions, config.target, config.watch);
        Bvh bvh;
        BuiltAreas areas;
        lay_out(topology, positions, tree, {}, 1, config.watch, bvh, areas);
        return bvh;
    });
}

}  // namespace mray
