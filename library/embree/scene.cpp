#include "library/embree/scene.h"

#include <set>

namespace mray::embree {
struct PrimBox : Bounds {
    std::uint32_t mesh;
    std::uint32_t prim_id;
};

/// A binary tree over medians of the longest axis; a node [first, last) has the middle's number.
class BoxTree {
public:
    explicit BoxTree(std::vector<PrimBox> boxes)
        : boxes_(std::move(boxes)), bounds_(boxes_.size()) {
        build(0, boxes_.size());
    }

    /// The nearer half of each node comes first. `radius` is read again after each call.
    template <class Visit>
    void visit_near(const glm::vec3& point, const float& radius, Visit visit) const {
        if (!boxes_.empty()) visit_range(0, boxes_.size(), point, radius, visit);
    }

private:
    static constexpr std::size_t kLeaf = 4;

    void build(std::size_t first, std::size_t last) {
        if (last - first <= kLeaf) return;
        Bounds around;
        for (std::size_t i = first; i < last; ++i) around.add(boxes_[i]);
        int longest = 0;
        const glm::vec3 size = around.upper - around.lower;
        for (int axis = 1; axis < 3; ++axis)
            if (size[axis] > size[longest]) longest = axis;
        const std::size_t middle = first + (last - first) / 2;
        bounds_[middle] = around;
        const auto at = [&](std::size_t i) {
            return boxes_.begin() + static_cast<std::ptrdiff_t>(i);
        };
        std::nth_element(at(first), at(middle), at(last), [&](const PrimBox& a, const PrimBox& b) {
            return a.lower[longest] + a.upper[longest] < b.lower[longest] + b.upper[longest];
        });
        build(first, middle);
        build(middle, last);
    }
    template <class Visit>
    void visit_range(std::size_t first, std::size_t last, const glm::vec3& point,
                     const float& radius, Visit& visit) const {
        const auto is_near = [&](float distance2) { return distance2 <= radius * radius; };
        if (last - first <= kLeaf) {
            for (std::size_t i = first; i < last; ++i)
                if (is_near(boxes_[i].distance2(point))) visit(boxes_[i]);
            return;
        }
        struct Half {
            std::size_t first, last;
            float distance2;
        };
        const std::size_t middle = first + (last - first) / 2;
        Half near = {first, middle, distance2(first, middle, point)};
        Half far = {middle, last, distance2(middle, last, point)};
        if (far.distance2 < near.distance2) std::swap(near, far);
        for (const Half& half : {near, far})
            if (is_near(half.distance2)) visit_range(half.first, half.last, point, radius, visit);
    }
    float distance2(std::size_t first, std::size_t last, const glm::vec3& point) const {
        return last - first <= kLeaf ? 0 : bounds_[first + (last - first) / 2].distance2(point);
    }

    std::vector<PrimBox> boxes_;
    std::vector<Bounds> bounds_;
};

namespace {

bool is_any_refitted(const std::vector<CommittedMesh>& meshes) {
    return std::ranges::any_of(meshes, [](const CommittedMesh& mesh) {
        return mesh.geometry->quality == RTC_BUILD_QUALITY_REFIT;
    });
}

bool has_same_shape(const CommittedMesh& p, const CommittedMesh& q) {
    return p.geom_id == q.geom_id && p.inst_id == q.inst_id && p.geometry == q.geometry &&
           p.instance == q.instance && p.versions[0].shape == q.versions[0].shape &&
           p.versions[1].shape == q.versions[1].shape;
}

/// Computes what the tracer reads and what answers tell, which the meshes of one mesh share.
void prepare(std::vector<CommittedMesh>& meshes) {
    std::map<const Geometry*, const CommittedMesh*> first_of;
    for (CommittedMesh& mesh : meshes) {
        mesh.place();
        const CommittedMesh* const first =
            first_of.try_emplace(mesh.geometry.get(), &mesh).first->second;
        if (first == &mesh) mesh.make_normals();
        mesh.normals = first->normals;
        mesh.measure();
    }
}

RTCBounds bounds_of(const Committed& committed) {
    Bounds all;
    for (const CommittedMesh& mesh : committed.meshes) all.add(mesh.bounds);
    return {all.lower.x, all.lower.y, all.lower.z, 0, all.upper.x, all.upper.y, all.upper.z, 0};
}

/// The primitives whose vertices are all in range.
std::vector<PrimBox> boxes_of(const std::vector<CommittedMesh>& meshes) {
    std::vector<PrimBox> boxes;
    for (std::size_t p = 0; p < meshes.size(); ++p) {
        const CommittedMesh& mesh = meshes[p];
        const std::size_t step = mesh.is_quads ? 2 : 1;
        for (std::size_t triangle = 0; triangle < mesh.triangle_count(); triangle += step) {
            PrimBox box = {
                {}, static_cast<std::uint32_t>(p), static_cast<std::uint32_t>(triangle / step)};
            bool is_whole = true;
            for (std::size_t half = 0; half < step && is_whole; ++half)
                is_whole = mesh.add_to_box(triangle + half, box);
            if (is_whole) boxes.push_back(box);
        }
    }
    return boxes;
}

/// The factor of lengths, if the transformation is a similarity; otherwise 0.
float similarity_of(const Transform& t) {
    const auto dot = [&](int i, int j) { return glm::dot(t[i], t[j]); };
    const double scale2 = dot(0, 0);
    for (const double excess :
         {dot(1, 1) - scale2, dot(2, 2) - scale2, dot(0, 1), dot(0, 2), dot(1, 2)})
        if (!(std::abs(excess) <= 1e-5 * scale2)) return 0;
    return static_cast<float>(std::sqrt(scale2));
}

void enter_instance(const CommittedMesh& mesh, RTCPointQueryContext& context) {
    constexpr RTCFormat kFormat = RTC_FORMAT_FLOAT4X4_COLUMN_MAJOR;
    write_transform(mesh.to_object, kFormat, context.world2inst[0]);
    write_transform(mesh.to_world, kFormat, context.inst2world[0]);
    context.instID[0] = mesh.inst_id;
#if MORPHRAY_EMBREE == 4
    context.instPrimID[0] = 0;
#endif
    context.instStackSize = 1;
}

/// Returns whether a function changed the query. Functions may lower the radius.
bool visit_near(const Committed& committed, RTCPointQuery& query, RTCPointQueryContext& context,
                RTCPointQueryFunction function, void* user) {
    bool has_changed = false;
    committed.boxes().visit_near(
        {query.x, query.y, query.z}, query.radius, [&](const PrimBox& box) {
            const CommittedMesh& mesh = committed.meshes[box.mesh];
            const RTCPointQueryContext before = context;
            if (mesh.is_instance()) enter_instance(mesh, context);
            RTCPointQueryFunctionArguments arguments = {
                .query = &query,
                .userPtr = user,
                .primID = box.prim_id,
                .geomID = mesh.geom_id,
                .context = &context,
                .similarityScale = mesh.is_instance() ? similarity_of(mesh.to_object) : 1.0f};
            for (const RTCPointQueryFunction each : {function, mesh.geometry->point_query})
                if (each != nullptr) has_changed |= each(&arguments);
            if (mesh.is_instance()) context = before;
        });
    return has_changed;
}

}  // namespace

void Committed::read_settings() {
    filters_hits = false;
    filters_occlusion = false;
    bool uses_masks = false;
    std::set<unsigned int> different;
    for (CommittedMesh& mesh : meshes) {
        uses_masks |= mesh.read_masks();
        different.insert(mesh.masks.begin(), mesh.masks.end());
        filters_hits |= mesh.geometry->intersect_filter != nullptr;
        filters_occlusion |= mesh.geometry->occluded_filter != nullptr;
    }
    if (!uses_masks) different.clear();
    masks.assign(different.begin(), different.end());
}

unsigned int SceneObject::attach(Geometry& geometry, unsigned int id) {
    if (&geometry.device() != device_.get()) fail_argument("the geometry is of another device");
    constexpr unsigned int kMost = 0x7FFFFFFFu;
    const std::scoped_lock lock(mutex_);
    if (id == kInvalid) {
        while (find(lowest_free_) != nullptr) ++lowest_free_;
        id = lowest_free_;
    }
    if (id > kMost) fail_argument("the geometry ID is too large");
    if (attachments_.contains(id))
        fail_operation("the geometry ID " + std::to_string(id) + " is taken");
    attachments_.emplace(id, share(geometry));
    return id;
}

void SceneObject::detach(unsigned int id) {
    const std::scoped_lock lock(mutex_);
    const auto found = attachments_.find(id);
    if (found == attachments_.end()) fail_operation("no geometry has the ID " + std::to_string(id));
    attachments_.erase(found);
    lowest_free_ = std::min(lowest_free_, id);
}

Geometry* SceneObject::find(unsigned int id) const {
    const auto found = attachments_.find(id);
    return found == attachments_.end() ? nullptr : found->second.get();
}

Geometry& SceneObject::at(unsigned int id) const {
    Geometry* const geometry = find(id);
    if (geometry == nullptr) fail_argument("no geometry has this ID");
    return *geometry;
}

void SceneObject::commit() {
    const std::scoped_lock lock(commit_mutex_);
    try {
        std::vector<CommittedMesh> meshes;
        collect_meshes(attachments(), {}, kInvalid, meshes);
        commit_meshes(std::move(meshes));
    } catch (...) {
        committed_ = nullptr;
        throw;
    }
}

void SceneObject::commit_meshes(std::vector<CommittedMesh> meshes) {
    const bool is_kept = committed_ != nullptr &&
                         std::ranges::equal(committed_->meshes, meshes, has_same_shape) &&
                         committed_->is_refitted == is_any_refitted(meshes);
    const bool is_robust = (flags & RTC_SCENE_FLAG_ROBUST) != 0;
    constexpr auto kVersions = &CommittedMesh::versions;
    if (is_kept && committed_->is_robust == is_robust &&
        std::ranges::equal(committed_->meshes, meshes, {}, kVersions, kVersions))
        return;
    if (!is_kept || !update(meshes)) build(std::move(meshes));
    committed_->is_robust = is_robust;
    committed_->read_settings();
}

void SceneObject::build(std::vector<CommittedMesh> meshes) {
    committed_ = nullptr;
    auto made = std::make_unique<Committed>();
    made->is_refitted = is_any_refitted(meshes);
    made->meshes = std::move(meshes);
    for (CommittedMesh& mesh : made->meshes) mesh.find_used_vertices();
    prepare(made->meshes);
    std::vector<std::vector<std::uint32_t>> triangles;
    std::vector<morphray::MeshView> views;
    bool has_triangles = false;
    for (const CommittedMesh& mesh : made->meshes) {
        views.push_back(mesh.view(triangles.emplace_back()));
        has_triangles |= mesh.triangle_count() > 0;
    }
    morphray::SceneOptions options;
    if (made->is_refitted) options.update = morphray::Refit{};
    if (has_triangles) {
        made->scene = morphray::Scene::build(std::span<const morphray::MeshView>(views),
                                             device_->tracer(), options);
    }
    committed_ = std::move(made);
}

/// Follows positions and transformations: `meshes` have those of the caller.
bool SceneObject::update(const std::vector<CommittedMesh>& meshes) {
    std::vector<std::size_t> moved;
    for (std::size_t i = 0; i < meshes.size(); ++i) {
        CommittedMesh& mesh = committed_->meshes[i];
        const auto before = std::exchange(mesh.versions, meshes[i].versions);
        if (before[0].pose != mesh.versions[0].pose || before[1].pose != mesh.versions[1].pose)
            moved.push_back(i);
    }
    for (const std::size_t i : moved) {
        CommittedMesh& mesh = committed_->meshes[i];
        const std::vector<std::size_t> left_out = std::move(mesh.left_out);
        mesh.place();
        if (!mesh.own_normals.empty()) mesh.make_normals();
        mesh.measure();
        if (mesh.left_out != left_out) return false;
    }
    if (!moved.empty()) committed_->forget_boxes();
    if (moved.empty() || !committed_->scene) return true;
    if (moved.size() > 1) {
        committed_->scene->update();
    } else if (const std::size_t used = committed_->meshes[moved.front()].used_vertices; used > 0) {
        committed_->scene->update(static_cast<std::uint32_t>(moved.front()), 0, used);
    }
    return true;
}

const BoxTree& Committed::boxes() const {
    const std::scoped_lock lock(boxes_mutex_);
    if (made_boxes_ == nullptr) made_boxes_ = std::make_shared<BoxTree>(boxes_of(meshes));
    return *made_boxes_;
}

}  // namespace mray::embree

using namespace mray::embree;

RTCScene rtcNewScene(RTCDevice device) {
    return with<Device>(__func__, device,
                        [](Device& d) { return reinterpret_cast<RTCScene>(new SceneObject(d)); });
}

RTCDevice rtcGetSceneDevice(RTCScene scene) {
    return with<SceneObject>(__func__, scene, [](SceneObject& s) {
        s.device().retain();
        return reinterpret_cast<RTCDevice>(&s.device());
    });
}

MORPHRAY_COUNTED(Scene, SceneObject)

unsigned int rtcAttachGeometry(RTCScene scene, RTCGeometry geometry) {
    unsigned int id = kInvalid;
    with<SceneObject>(__func__, scene, [&](SceneObject& s) {
        if (geometry == nullptr) fail_argument("the geometry is null");
        id = s.attach(*reinterpret_cast<Geometry*>(geometry));
    });
    return id;
}
void rtcAttachGeometryByID(RTCScene scene, RTCGeometry geometry, unsigned int id) {
    with<SceneObject>(__func__, scene, [&](SceneObject& s) {
        if (geometry == nullptr) fail_argument("the geometry is null");
        if (id == kInvalid) fail_argument("the geometry ID is RTC_INVALID_GEOMETRY_ID");
        s.attach(*reinterpret_cast<Geometry*>(geometry), id);
    });
}
void rtcDetachGeometry(RTCScene scene, unsigned int id) {
    with<SceneObject>(__func__, scene, [&](SceneObject& s) { s.detach(id); });
}

RTCGeometry rtcGetGeometry(RTCScene scene, unsigned int id) {
    return with<SceneObject>(
        __func__, scene, [&](SceneObject& s) { return reinterpret_cast<RTCGeometry>(s.find(id)); });
}
RTCGeometry rtcGetGeometryThreadSafe(RTCScene scene, unsigned int id) {
    return with<SceneObject>(__func__, scene, [&](SceneObject& s) {
        const std::scoped_lock lock(s.mutex());
        return reinterpret_cast<RTCGeometry>(s.find(id));
    });
}

void rtcCommitScene(RTCScene scene) {
    with<SceneObject>(__func__, scene, [](SceneObject& s) { s.commit(); });
}
void rtcJoinCommitScene(RTCScene scene) {
    with<SceneObject>(__func__, scene, [](SceneObject& s) { s.commit(); });
}

/// The function is never called.
void rtcSetSceneProgressMonitorFunction(RTCScene scene, RTCProgressMonitorFunction, void*) {
    with<SceneObject>(__func__, scene, [](SceneObject&) {});
}

/// Trees are of one quality.
void rtcSetSceneBuildQuality(RTCScene scene, enum RTCBuildQuality quality) {
    with<SceneObject>(__func__, scene, [&](SceneObject&) {
        if (quality > RTC_BUILD_QUALITY_HIGH) fail_argument("the build quality is unknown");
    });
}
void rtcSetSceneFlags(RTCScene scene, enum RTCSceneFlags flags) {
    with<SceneObject>(__func__, scene, [&](SceneObject& s) { s.flags = flags; });
}
RTCSceneFlags rtcGetSceneFlags(RTCScene scene) {
    return with<SceneObject>(__func__, scene, [](SceneObject& s) { return s.flags; });
}

void rtcGetSceneBounds(RTCScene scene, struct RTCBounds* bounds) {
    with<SceneObject>(__func__, scene, [&](SceneObject& s) {
        if (bounds == nullptr) fail_argument("the bounds are null");
        *bounds = bounds_of(s.committed());
    });
}
void rtcGetSceneLinearBounds(RTCScene scene, struct RTCLinearBounds* bounds) {
    with<SceneObject>(__func__, scene, [&](SceneObject& s) {
        if (bounds == nullptr) fail_argument("the bounds are null");
        bounds->bounds0 = bounds->bounds1 = bounds_of(s.committed());
    });
}

bool rtcPointQuery(RTCScene scene, RTCPointQuery* query, RTCPointQueryContext* context,
                   RTCPointQueryFunction function, void* user) {
    return with<SceneObject>(__func__, scene, [&](SceneObject& s) {
        if (query == nullptr || context == nullptr) fail_argument("query or context is null");
        if (context->instStackSize > 0)
            fail_unsupported("point queries on a stack of instances are");
        return visit_near(s.committed(), *query, *context, function, user);
    });
}
