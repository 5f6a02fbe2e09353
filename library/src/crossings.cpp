// Pairs of triangles that cross: all leaves of the host's tree are asked in threads, and what the
// tree has in no leaf, because an earlier triangle is the same, is added.
#include "common/scene/triangle_crossing.h"
#include "cpu/queries/crossing_pairs.h"
#include "library/src/query_plan.h"

#include <tbb/enumerable_thread_specific.h>

namespace morphray {
namespace {

using namespace detail;
using mray::cpu::kInFirstSet;
using mray::cpu::kInSecondSet;
using mray::cpu::TrianglePair;

constexpr std::uint64_t kAllPairs = std::numeric_limits<std::uint64_t>::max();

/// Marks the visible triangles of the meshes, or of all.
void add_set(const SceneImpl& scene, const std::optional<std::span<const std::uint32_t>>& geom_ids,
             const QueryOptions& options, std::uint8_t set, std::vector<std::uint8_t>& sets) {
    const auto add = [&](const MeshSlot& mesh, std::uint32_t geom_id) {
        if (!mesh.used || (options.visible && (*options.visible)[geom_id] == 0)) return;
        for (std::uint32_t i = 0; i < mesh.prim_count; ++i) sets[mesh.first_prim + i] |= set;
    };
    const std::span<const MeshSlot> slots = scene.meshes().slots();
    if (!geom_ids) {
        for (std::uint32_t id = 0; id < slots.size(); ++id) add(slots[id], id);
        return;
    }
    for (const std::uint32_t id : *geom_ids) {
        if (scene.meshes().find(id) == nullptr)
            throw_bad_argument("crossings: the geom_id {}, which no mesh has", id);
        add(slots[id], id);
    }
}

/// The triangles that pairs are made of.
class CrossingSearch {
public:
    CrossingSearch(SceneImpl& scene, const CrossingOptions& which, const QueryOptions& options)
        : scene_(scene),
          filter_(scene, 0, "crossings", 0, options),
          tree_(scene.tracer().host_tree()),
          topology_(scene.meshes().topology()) {
        if (which.geom_ids || which.other || options.visible) {
            sets_.resize(topology_.triangles.size());
            add_set(scene, which.geom_ids, options, kInFirstSet, sets_);
            add_set(scene, which.other ? which.other : which.geom_ids, options, kInSecondSet,
                    sets_);
        }
        // In the tree a triangle stands for those that are the same.
        tree_sets_ = sets_;
        for (const mray::RepeatedTriangle& repeat : tree_.repeated)
            if (!sets_.empty()) tree_sets_[repeat.first] |= sets_[repeat.prim_id];
        // Vectors of 32-bit places find the coordinates.
        if (scene.pose().positions().size() > std::numeric_limits<std::int32_t>::max() / 3)
            throw mray::Error(mray::ErrorKind::kLimit, "crossings: more than 715 million vertices");
        if (scene.pose().is_exact()) return;
        world_.resize(scene.pose().positions().size());
        for (std::uint32_t i = 0; i < world_.size(); ++i)
            world_[i] = scene.pose().world_position(i);
    }

    /// Calls take(pairs) for pairs that cross until it returns false, in many threads.
    template <class Take>
    void search(Take take) {
        const mray::cpu::CrossingScene crossing_scene{tree_, topology_, positions(), tree_sets_};
        const auto find = mray::cpu::find_crossings(scene_.target());
        std::atomic<bool> is_over = false;
        const auto search_leaves = [&](std::size_t first, std::size_t count) {
            std::vector<TrianglePair> found, all;
            for (std::size_t i = first; i < first + count && !is_over; ++i) {
                found.clear();
                find(crossing_scene, static_cast<std::uint32_t>(i), found);
                all.clear();
                for (const TrianglePair& pair : found) add_alike(pair, all);
                if (!all.empty() && !take(all)) is_over = true;
            }
        };
        const bool calls_alone = filter_.options().threads == Threads::calling;
        for_each_run(calls_alone ? nullptr : &scene_.arena(), tree_.leaves.size(), filter_.watch(),
                     search_leaves, kLeaves);
        if (!is_over) search_repeated(take);
        filter_.watch().throw_if_cancelled();
    }

private:
    static constexpr std::size_t kLeaves = 16;

    std::span<const mray::vec3> positions() const {
        return world_.empty() ? scene_.pose().positions() : world_;
    }
    bool is_asked(std::uint32_t a, std::uint32_t b) const {
        if (sets_.empty()) return true;
        return ((sets_[a] & kInFirstSet) != 0 && (sets_[b] & kInSecondSet) != 0) ||
               ((sets_[a] & kInSecondSet) != 0 && (sets_[b] & kInFirstSet) != 0);
    }
    void add(std::uint32_t a, std::uint32_t b, std::vector<TrianglePair>& pairs) const {
        if (is_asked(a, b)) pairs.push_back({std::min(a, b), std::max(a, b)});
    }
    /// Adds a pair, and those of triangles that are the same.
    void add_alike(const TrianglePair& pair, std::vector<TrianglePair>& pairs) const {
        add(pair.first, pair.second, pairs);
        if (tree_.repeated.empty()) return;
        const auto alike = mray::repeats_of(tree_.repeated, pair.first);
        const auto alike_second = mray::repeats_of(tree_.repeated, pair.second);
        for (const auto& b : alike_second) add(pair.first, b.prim_id, pairs);
        for (const auto& a : alike) {
            add(a.prim_id, pair.second, pairs);
            for (const auto& b : alike_second) add(a.prim_id, b.prim_id, pairs);
        }
    }
    /// Takes the pairs of triangles that are the same.
    template <class Take>
    void search_repeated(Take take) const {
        std::vector<TrianglePair> pairs;
        const std::span<const mray::RepeatedTriangle> all = tree_.repeated;
        for (std::size_t i = 0; i < all.size(); ++i) {
            if (filter_.watch().is_cancelled()) return;
            const mray::uvec3 t = topology_.triangles[all[i].first];
            if (!all_kept(t)) continue;
            const std::array<mray::vec3, 3> corners{positions()[t.x], positions()[t.y],
                                                    positions()[t.z]};
            if (!mray::triangles_cross(corners, corners)) continue;
            pairs.clear();
            add(all[i].first, all[i].prim_id, pairs);
            for (std::size_t k = i + 1; k < all.size() && all[k].first == all[i].first; ++k)
                add(all[i].prim_id, all[k].prim_id, pairs);
            if (!pairs.empty() && !take(pairs)) return;
        }
    }
    bool all_kept(const mray::uvec3& t) const {
        const std::span<const mray::vec3> scene = scene_.pose().positions();
        return mray::is_finite_vertex(scene[t.x]) && mray::is_finite_vertex(scene[t.y]) &&
               mray::is_finite_vertex(scene[t.z]);
    }

    SceneImpl& scene_;
    QueryFilter filter_;
    const mray::Bvh& tree_;
    const mray::Topology& topology_;
    /// For each triangle, and for each one in the tree; empty if all are in both.
    std::vector<std::uint8_t> sets_, tree_sets_;
    /// The positions of world space, if scene space rounds one.
    std::vector<mray::vec3> world_;
};

/// The first pairs, and the number of all.
struct FirstPairs {
    std::vector<TrianglePair> pairs;
    std::uint64_t count = 0;

    void add(std::span<const TrianglePair> more, std::uint64_t limit) {
        constexpr std::uint64_t kRoom = std::uint64_t{1} << 16;
        count += more.size();
        if (limit == 0) return;
        pairs.insert(pairs.end(), more.begin(), more.end());
        if (limit < kAllPairs / 2 && pairs.size() > 2 * limit + kRoom) keep_first(limit);
    }
    void keep_first(std::uint64_t limit) {
        if (pairs.size() <= limit) return;
        std::ranges::nth_element(pairs, pairs.begin() + static_cast<std::ptrdiff_t>(limit));
        pairs.resize(limit);
    }
};

}  // namespace

Crossings Scene::crossings(const CrossingOptions& which, const QueryOptions& options) const {
    return with_scene(impl_, [&](SceneImpl& scene) {
        tbb::enumerable_thread_specific<FirstPairs> own;
        CrossingSearch(scene, which, options).search([&](std::span<const TrianglePair> found) {
            own.local().add(found, which.limit);
            return true;
        });
        FirstPairs all;
        for (const FirstPairs& one : own) {
            all.pairs.insert(all.pairs.end(), one.pairs.begin(), one.pairs.end());
            all.count += one.count;
        }
        all.keep_first(which.limit);
        std::ranges::sort(all.pairs);
        Crossings crossings;
        const auto primitive = [&](std::uint32_t prim_id) {
            return scene.meshes().locate(0, 0, 0, prim_id).primitive();
        };
        crossings.pairs.reserve(all.pairs.size());
        for (const TrianglePair& pair : all.pairs)
            crossings.pairs.push_back({primitive(pair.first), primitive(pair.second)});
        crossings.left_out = all.count - all.pairs.size();
        return crossings;
    });
}

bool Scene::has_crossings(const CrossingOptions& which, const QueryOptions& options) const {
    return with_scene(impl_, [&](SceneImpl& scene) {
        std::atomic<bool> is_found = false;
        CrossingSearch(scene, which, options).search([&](std::span<const TrianglePair>) {
            is_found = true;
            return false;
        });
        return is_found.load();
    });
}

}  // namespace morphray
