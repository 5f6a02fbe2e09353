#include "library/embree/scene.h"

#include <algorithm>
#include <atomic>
#include <cstdio>
#include <map>
#include <set>
#include <span>
#include <string>
#include <utility>

namespace mray::embree {
namespace {

std::size_t triangle_count(const std::vector<Part>& parts) {
    std::size_t count = 0;
    for (const Part& part : parts) count += part.triangle_count();
    return count;
}

bool is_any_refitted(const std::vector<Part>& parts) {
    return std::any_of(parts.begin(), parts.end(), [](const Part& part) {
        return part.mesh->quality == RTC_BUILD_QUALITY_REFIT;
    });
}

bool have_same_versions(const std::vector<Part>& a, const std::vector<Part>& b) {
    return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                      [](const Part& p, const Part& q) { return p.versions == q.versions; });
}

bool has_moved(const Part& before, const Part& now) {
    return before.versions[0].pose != now.versions[0].pose ||
           before.versions[1].pose != now.versions[1].pose;
}

/// Computes what the tracer reads and what answers tell, which the parts of one mesh share.
void prepare(std::vector<Part>& parts) {
    std::map<const Geometry*, const Part*> first_of;
    for (Part& part : parts) {
        part.place();
        const Part* const first = first_of.try_emplace(part.mesh.get(), &part).first->second;
        if (first == &part) {
            part.make_normals();
        } else {
            part.normals = first->normals;
        }
        part.measure();
        if (!part.reads_far_vertex) continue;
        part.has_own_positions = true;
        part.place();
    }
}

std::optional<morphray::Scene> build_tree(const std::vector<Part>& parts, const BuildWay& way,
                                          const morphray::Device& tracer) {
    std::vector<std::vector<std::uint32_t>> triangles(parts.size());
    std::vector<morphray::MeshView> views;
    for (std::size_t i = 0; i < parts.size(); ++i) views.push_back(parts[i].view(triangles[i]));
    if (triangle_count(parts) == 0) return std::nullopt;
    morphray::SceneOptions options;
    if (way.is_refitted) options.update = morphray::Refit{};
    return morphray::Scene::build(std::span<const morphray::MeshView>(views), tracer, options);
}

/// Prints on stderr, once, why a scene is not answered: some programs do not show errors.
void announce_unsupported(const std::string& reason) {
    static std::atomic<bool> is_said = false;
    if (is_said.exchange(true)) return;
    std::fprintf(stderr, "morphray: %s: no ray of such scenes hits\n", reason.c_str());
}

/// Encloses the triangles that can be hit, and no vertex that none of them has.
RTCBounds bounds_of(const Committed& committed) {
    Bounds all;
    for (const Part& part : committed.parts) all.add(part.bounds);
    RTCBounds result = {};
    result.lower_x = all.lower[0];
    result.lower_y = all.lower[1];
    result.lower_z = all.lower[2];
    result.upper_x = all.upper[0];
    result.upper_y = all.upper[1];
    result.upper_z = all.upper[2];
    return result;
}

}  // namespace

void Committed::read_settings() {
    uses_masks = false;
    filters_hits = false;
    filters_occlusion = false;
    for (Part& part : parts) {
        uses_masks |= part.read_masks();
        filters_hits |= part.mesh->intersect_filter != nullptr;
        filters_occlusion |= part.mesh->occluded_filter != nullptr;
    }
    std::set<unsigned int> different;
    if (uses_masks)
        for (const Part& part : parts) different.insert(part.masks.begin(), part.masks.end());
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
    attachments_.emplace(id, Ref<Geometry>(&geometry));
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

Geometry* SceneObject::find_locked(unsigned int id) const {
    const std::scoped_lock lock(mutex_);
    return find(id);
}

void SceneObject::commit() {
    const std::scoped_lock lock(commit_mutex_);
    try {
        commit_parts(collect_parts(attachments()));
    } catch (const Unsupported& what) {
        announce_unsupported(what.message);
        committed_ = nullptr;
        throw;
    } catch (...) {
        committed_ = nullptr;
        throw;
    }
}

void SceneObject::commit_parts(std::vector<Part> parts) {
    const bool is_kept = committed_ != nullptr && have_same_shape(committed_->parts, parts) &&
                         committed_->way == BuildWay{quality, is_any_refitted(parts)};
    const bool is_robust = (flags & RTC_SCENE_FLAG_ROBUST) != 0;
    if (is_kept && committed_->is_robust == is_robust &&
        have_same_versions(committed_->parts, parts)) {
        return;
    }
    if (!is_kept || !update(parts)) build(std::move(parts));
    committed_->is_robust = is_robust;
    committed_->read_settings();
}

void SceneObject::build(std::vector<Part> parts) {
    committed_ = nullptr;
    auto made = std::make_unique<Committed>();
    made->way = {quality, is_any_refitted(parts)};
    made->parts = std::move(parts);
    for (Part& part : made->parts) part.find_used_vertices();
    prepare(made->parts);
    committed_ = std::move(made);
    committed_->scene = build_tree(committed_->parts, committed_->way, device_->tracer());
}

/// Follows positions and transformations: `parts` have those of the caller.
bool SceneObject::update(const std::vector<Part>& parts) {
    std::vector<std::size_t> moved;
    for (std::size_t i = 0; i < parts.size(); ++i) {
        Part& part = committed_->parts[i];
        if (has_moved(part, parts[i])) moved.push_back(i);
        part.versions = parts[i].versions;
    }
    for (const std::size_t i : moved) {
        Part& part = committed_->parts[i];
        const std::vector<std::size_t> left_out = std::move(part.left_out);
        part.place();
        if (!part.own_normals.empty()) part.make_normals();
        part.measure();
        if (part.reads_far_vertex || part.left_out != left_out) return false;
    }
    if (!moved.empty()) committed_->forget_boxes();
    if (moved.empty() || !committed_->scene) return true;
    if (moved.size() == 1) {
        const Part& part = committed_->parts[moved.front()];
        if (part.used_vertices == 0) return true;
        committed_->scene->update(static_cast<std::uint32_t>(moved.front()), 0, part.used_vertices);
    } else {
        committed_->scene->update();
    }
    return true;
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
        return reinterpret_cast<RTCGeometry>(s.find_locked(id));
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

void rtcSetSceneBuildQuality(RTCScene scene, enum RTCBuildQuality quality) {
    with<SceneObject>(__func__, scene, [&](SceneObject& s) {
        if (quality > RTC_BUILD_QUALITY_HIGH) fail_argument("the build quality is unknown");
        s.quality = quality;
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
