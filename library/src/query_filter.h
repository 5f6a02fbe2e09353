// The triangles that exist for the rays or points of a call, by QueryOptions.
#pragma once

#include "library/src/scene_impl.h"

namespace morphray::detail {

/// Asks a scene's tracer about the triangles that exist. The options must outlive it.
class QueryFilter {
public:
    /// Throws Error for a wrong number of answers, flags or excluded triangles, and for those that
    /// do not exist; `what` names the queries.
    QueryFilter(SceneImpl& scene, std::size_t queries, const char* what, std::size_t answers,
                const QueryOptions& options)
        : scene_(scene), options_(options) {
        require_room(queries, what, answers);
        const std::span<const MeshSlot> slots = scene.meshes().slots();
        if (options.excluded && options.excluded->size() != queries)
            throw_bad_argument("excluded: {} for {} {}", options.excluded->size(), queries, what);
        if (options.excluded) require_there(*options.excluded);
        if (!options.visible) return;
        hides_meshes_ = true;
        // The highest geom_ids may be free since a detach(), and may have flags.
        const std::size_t flags = options.visible->size();
        std::size_t least = slots.size();
        while (least > 0 && !slots[least - 1].used) --least;
        if (flags < least || flags > slots.size())
            throw_bad_argument("visible: {} flags, but {} geom_ids", flags, least);
    }

    const QueryOptions& options() const { return options_; }
    mray::Watch watch() const { return mray::Watch(options_.cancel); }
    bool sees_all() const { return !options_.visible && !options_.excluded; }
    bool sees(std::size_t query, const Hit& hit) const {
        if (options_.visible && (*options_.visible)[hit.geom_id] == 0) return false;
        if (!options_.excluded) return true;
        const Primitive& left_out = (*options_.excluded)[query];
        if (left_out.prim_id == kNoPrim) return hit.geom_id != left_out.geom_id;
        return hit.primitive() != left_out;
    }

    /// Backend::prepare() for queries of this type.
    template <class Query>
    std::size_t prepare() {
        const std::size_t size = scene_.tracer().prepare(mray::is_for_host<Query>(!sees_all()));
        // The device's answers take no subtrees, for which the tree would be read back.
        if (size == 1 && hides_meshes_) meshes_ = scene_.meshes_of_subtrees();
        return size;
    }
    /// Asks a query whose ray or point i is that of this number here, with watch and filter.
    template <class Query, class Number>
    void ask(Query query, Number number) const {
        query.watch = watch();
        if (sees_all()) return scene_.tracer().query(query);
        mray::TriangleFilter filter{[&](std::size_t i, std::uint32_t prim_id) {
            return sees(number(i), scene_.meshes().locate(0, 0, 0, prim_id));
        }};
        if (!meshes_.empty()) {
            filter.hides = [&](std::size_t i, std::size_t subtree) {
                const std::uint32_t geom_id = meshes_[subtree];
                return geom_id != kNoGeometry && !sees(number(i), Hit{0, 0, 0, kNoPrim, geom_id});
            };
        }
        query.filter = &filter;
        scene_.tracer().query(query);
    }

private:
    /// Only a miss may name nothing.
    void require_there(std::span<const Primitive> excluded) {
        for (std::size_t i = 0; i < excluded.size(); ++i) {
            const auto& [prim_id, geom_id] = excluded[i];
            if (excluded[i] == Primitive{}) continue;
            const MeshSlot* const mesh = scene_.meshes().find(geom_id);
            if (mesh == nullptr)
                throw_bad_argument("excluded: number {} has the geom_id {}, which no mesh has", i,
                                   geom_id);
            hides_meshes_ |= prim_id == kNoPrim;
            if (prim_id != kNoPrim && prim_id >= mesh->prim_count)
                throw_bad_argument(
                    "excluded: number {} has the prim_id {} of mesh {}, which has {}", i, prim_id,
                    geom_id, mesh->prim_count);
        }
    }

    SceneImpl& scene_;
    const QueryOptions& options_;
    /// Whether a query may leave out several triangles.
    bool hides_meshes_ = false;
    /// SceneImpl::meshes_of_subtrees(), or empty.
    std::span<const std::uint32_t> meshes_;
};

}  // namespace morphray::detail
