// Pairs of triangles that cross.
#include "common/scene/triangle_crossing.h"
#include "cpu/queries/crossing_pairs.h"
#include "library/src/query_plan.h"

#include <tbb/enumerable_thread_specific.h>

#include <numeric>

namespace morphray {
namespace {

using namespace detail;
using mray::cpu::kInFirstSet;
using mray::cpu::kInSecondSet;
using mray::cpu::TrianglePair;

class CrossingSearch {
public:
    CrossingSearch(SceneImpl& scene, const CrossingOptions& which, const QueryOptions& options)
        : scene_(scene),
          filter_(scene, 0, "crossings", 0, options),
          tree_(scene.tracer().host_tree()),
          topology_(scene.meshes().topology()) {
        if (which.geom_ids || which.other || options.visible) {
            sets_.resize(topology_.triangles.size());
            add_set(which.geom_ids, kInFirstSet);
            add_set(which.other ? which.other : which.geom_ids, kInSecondSet);
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
                for (const TrianglePair& pair : found)
                    for_each_alike(pair.first, [&](std::uint32_t a) {
                        for_each_alike(pair.second, [&](std::uint32_t b) { add(a, b, all); });
                    });
                if (!all.empty() && !take(all)) is_over = true;
            }
        };
        constexpr std::size_t kLeaves = 16;
        const bool calls_alone = filter_.options().threads == Threads::calling;
        for_each_run(calls_alone ? nullptr : &scene_.arena(), tree_.leaves.size(), filter_.watch(),
                     search_leaves, kLeaves);
        if (!is_over) search_repeated(take);
        filter_.watch().throw_if_cancelled();
    }

private:
    std::span<const mray::vec3> positions() const {
        return world_.empty() ? scene_.pose().positions() : world_;
    }
    /// Marks the visible triangles of the meshes, or of all.
    void add_set(const std::optional<std::span<const std::uint32_t>>& geom_ids, std::uint8_t set) {
        const MeshList& meshes = scene_.meshes();
        std::vector<std::uint32_t> all(meshes.slots().size());
        std::iota(all.begin(), all.end(), 0u);
        for (const std::uint32_t id : geom_ids.value_or(all)) {
            const MeshSlot* const mesh = meshes.find(id);
            if (mesh == nullptr && geom_ids)
                throw_bad_argument("crossings: the geom_id {}, which no mesh has", id);
            const auto& visible = filter_.options().visible;
            if (mesh == nullptr || (visible && (*visible)[id] == 0)) continue;
            for (std::uint8_t& own : std::span(sets_).subspan(mesh->first_prim, mesh->prim_count))
                own |= set;
        }
    }
    void add(std::uint32_t a, std::uint32_t b, std::vector<TrianglePair>& pairs) const {
        const auto has = [&](std::uint32_t prim, std::uint8_t set) {
            return sets_.empty() || (sets_[prim] & set) != 0;
        };
        if ((has(a, kInFirstSet) && has(b, kInSecondSet)) ||
            (has(a, kInSecondSet) && has(b, kInFirstSet)))
            pairs.push_back({std::min(a, b), std::max(a, b)});
    }
    template <class Visit>
    void for_each_alike(std::uint32_t prim, Visit visit) const {
        visit(prim);
        for (const auto& repeat : mray::repeats_of(tree_.repeated, prim)) visit(repeat.prim_id);
    }
    /// Takes the pairs of triangles that are the same.
    template <class Take>
    void search_repeated(Take take) const {
        std::vector<TrianglePair> pairs;
        const std::span<const mray::RepeatedTriangle> all = tree_.repeated;
        for (std::size_t i = 0; i < all.size(); ++i) {
            if (filter_.watch().is_cancelled()) return;
            std::array<mray::vec3, 3> corners;
            bool is_kept = true;
            for (int k = 0; k < 3; ++k) {
                const std::uint32_t vertex = topology_.triangles[all[i].first][k];
                is_kept &= mray::is_finite_vertex(scene_.pose().positions()[vertex]);
                corners[static_cast<std::size_t>(k)] = positions()[vertex];
            }
            if (!is_kept || !mray::triangles_cross(corners, corners)) continue;
            pairs.clear();
            add(all[i].first, all[i].prim_id, pairs);
            for (std::size_t k = i + 1; k < all.size() && all[k].first == all[i].first; ++k)
                add(all[i].prim_id, all[k].prim_id, pairs);
            if (!pairs.empty() && !take(pairs)) return;
        }
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

struct FirstPairs {
    std::vector<TrianglePair> pairs;
    std::uint64_t count = 0;

    void add(std::span<const TrianglePair> more, std::uint64_t limit) {
        constexpr std::uint64_t kRoom = std::uint64_t{1} << 16;
        count += more.size();
        if (limit == 0) return;
        pairs.insert(pairs.end(), more.begin(), more.end());
        if (pairs.size() > kRoom && pairs.size() / 2 > limit) keep_first(limit);
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
