// The triangles that exist for the rays or points of a call, by QueryOptions.
#pragma once

#include "common/bvh/bvh.h"
#include "library/src/scene/errors.h"
#include "library/src/scene/mesh_list.h"
#include "morphray/queries.hpp"

namespace morphray::detail {

/// The options must outlive it.
class QueryFilter {
public:
    /// Throws Error for a wrong number of flags or of excluded triangles, and for those that do not
    /// exist; `what` names the queries.
    QueryFilter(const MeshList& meshes, std::size_t queries, const char* what,
                const QueryOptions& options)
        : meshes_(meshes), options_(options) {
        if (options.excluded && options.excluded->size() != queries)
            throw_bad_argument("excluded: {} for {} {}", options.excluded->size(), queries, what);
        if (options.excluded) require_there(*options.excluded);
        if (!options.visible) return;
        // The highest geom_ids may be free since a detach(), and may have flags.
        const std::size_t flags = options.visible->size();
        std::size_t least = meshes.slots().size();
        while (least > 0 && !meshes.slots()[least - 1].used) --least;
        if (flags < least || flags > meshes.slots().size())
            throw_bad_argument("visible: {} flags, but {} geom_ids", flags, least);
    }
    /// The filter of the queries from `first` on.
    QueryFilter from(std::size_t first) const {
        QueryFilter part = *this;
        part.first_ += first;
        return part;
    }

    mray::Watch watch() const { return mray::Watch(options_.cancel); }
    bool sees_all() const { return !options_.visible && !options_.excluded; }
    bool sees(std::size_t query, std::uint32_t prim_id) const {
        return sees_all() || sees(query, meshes_.locate(0, 0, 0, prim_id));
    }
    bool sees(std::size_t query, const Hit& hit) const {
        if (options_.visible && (*options_.visible)[hit.geom_id] == 0) return false;
        if (!options_.excluded) return true;
        const Primitive& left_out = (*options_.excluded)[first_ + query];
        if (left_out.prim_id == kNoPrim) return hit.geom_id != left_out.geom_id;
        return hit.primitive() != left_out;
    }
    bool hides_mesh(std::size_t query, std::uint32_t geom_id) const {
        return geom_id != kNoGeometry && !sees(query, Hit{0, 0, 0, kNoPrim, geom_id});
    }
    /// The same as queries of the host's tree take it: number(i) is that of their ray or point i.
    /// Empty if all triangles are seen. The filter must outlive it.
    template <class Number>
    mray::SeesTriangle seen_by(Number number) const {
        if (sees_all()) return {};
        return [this, number](std::size_t i, std::uint32_t prim_id) {
            return sees(number(i), prim_id);
        };
    }
    /// `meshes`: SceneImpl::meshes_of_subtrees(), or empty for an empty result.
    template <class Number>
    mray::HidesSubtree hidden_from(Number number, std::span<const std::uint32_t> meshes) const {
        if (meshes.empty()) return {};
        return [this, number, meshes](std::size_t i, std::size_t subtree) {
            return hides_mesh(number(i), meshes[subtree]);
        };
    }
    /// True if a query may leave out several triangles.
    bool hides_meshes() const {
        const auto is_mesh = [](const Primitive& left_out) {
            return left_out.prim_id == kNoPrim && left_out.geom_id != kNoGeometry;
        };
        return options_.visible ||
               (options_.excluded && std::ranges::any_of(*options_.excluded, is_mesh));
    }

private:
    /// Only a miss may name nothing.
    void require_there(std::span<const Primitive> excluded) const {
        for (std::size_t i = 0; i < excluded.size(); ++i) {
            const auto& [prim_id, geom_id] = excluded[i];
            if (excluded[i] == Primitive{}) continue;
            const MeshSlot* const mesh = meshes_.find(geom_id);
            if (mesh == nullptr)
                throw_bad_argument("excluded: number {} has the geom_id {}, which no mesh has", i,
                                   geom_id);
            if (prim_id != kNoPrim && prim_id >= mesh->prim_count)
                throw_bad_argument(
                    "excluded: number {} has the prim_id {} of mesh {}, which has {}", i, prim_id,
                    geom_id, mesh->prim_count);
        }
    }

    const MeshList& meshes_;
    const QueryOptions& options_;
    std::size_t first_ = 0;
};

}  // namespace morphray::detail
