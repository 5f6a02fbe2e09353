#include "embree/scene/scene.h"

#include <algorithm>
#include <cstdio>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <utility>

#include "embree/scene/reading.h"

namespace mray::embree {
namespace {

/// Bytes of a vertex and a triangle that morphray::Scene says it takes, and a normal.
constexpr std::size_t kVertexBytes = 12;
constexpr std::size_t kTriangleBytes = 76;

std::size_t bytes_of(const std::vector<Part>& parts) {
    std::size_t bytes = 0;
    for (const Part& part : parts) {
        bytes += kVertexBytes * part.vertices.count * (part.has_own_positions ? 2 : 1) +
                 kTriangleBytes * part.triangle_count();
    }
    return bytes;
}

std::size_t triangle_count(const std::vector<Part>& parts) {
    std::size_t count = 0;
    for (const Part& part : parts) count += part.triangle_count();
    return count;
}

bool is_any_refitted(const std::vector<Part>& parts) {
    return std::any_of(parts.begin(), parts.end(),
                       [](const Part& part) { return part.mesh().is_refitted(); });
}

bool have_same_versions(const std::vector<Part>& a, const std::vector<Part>& b) {
    return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                      [](const Part& p, const Part& q) { return p.versions == q.versions; });
}

bool has_moved(const Part& before, const Part& now) {
    for (std::size_t level = 0; level < now.versions.size(); ++level)
        if (before.versions[level].pose != now.versions[level].pose) return true;
    return false;
}

/// Computes what the tracer reads and what answers tell, which the parts of one mesh share.
void prepare(std::vector<Part>& parts) {
    std::map<const Geometry*, const Part*> first_of;
    for (Part& part : parts) {
        part.place();
        const Part* const first = first_of.try_emplace(&part.mesh(), &part).first->second;
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

/// Builds the tree of parts that are prepared, which is none without triangles. `triangles` are
/// those of Part::view().
std::optional<morphray::Scene> build_tree(const std::vector<Part>& parts, const BuildWay& way,
                                          std::vector<std::vector<std::uint32_t>>& triangles,
                                          const morphray::Device& tracer) {
    std::vector<morphray::MeshView> views;
    for (std::size_t i = 0; i < parts.size(); ++i) views.push_back(parts[i].view(triangles[i]));
    if (triangle_count(parts) == 0) return std::nullopt;
    morphray::SceneOptions options;
    if (way.is_refitted) options.update = morphray::Refit{};
    if (way.quality == RTC_BUILD_QUALITY_HIGH) options.split = morphray::Split::sweep;
    return morphray::Scene::build(std::span<const morphray::MeshView>(views), tracer, options);
}

}  // namespace

SceneObject::SceneObject(Device& device) : device_(&device) {
    if (device.twin() != nullptr) twin_ = device.fallback()->rtcNewScene(device.twin());
}

SceneObject::~SceneObject() {
    on_twin(*this, &Fallback::rtcReleaseScene);
    give_away();
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
    // IDs far apart are found in attachments_ alone.
    constexpr std::size_t kMostSparse = std::size_t{1} << 20;
    if (id < by_id_.size() || id < 4 * attachments_.size() + kMostSparse) {
        if (id >= by_id_.size()) by_id_.resize(std::size_t{id} + 1);
        by_id_[id] = &geometry;
    }
    attachments_.emplace(id, Ref<Geometry>(&geometry));
    on_twin(*this, &Fallback::rtcAttachGeometryByID, geometry.twin(), id);
    return id;
}

void SceneObject::detach(unsigned int id) {
    const std::scoped_lock lock(mutex_);
    const auto found = attachments_.find(id);
    if (found == attachments_.end()) fail_operation("no geometry has the ID " + std::to_string(id));
    on_twin(*this, &Fallback::rtcDetachGeometry, id);
    attachments_.erase(found);
    if (id < by_id_.size()) by_id_[id] = nullptr;
    lowest_free_ = std::min(lowest_free_, id);
}

Geometry* SceneObject::find(unsigned int id) const {
    if (id < by_id_.size() && by_id_[id] != nullptr) return by_id_[id];
    const auto found = attachments_.find(id);
    return found == attachments_.end() ? nullptr : found->second.get();
}

Geometry* SceneObject::find_locked(unsigned int id) const {
    const std::scoped_lock lock(mutex_);
    return find(id);
}

void SceneObject::set_flags(RTCSceneFlags flags) {
    flags_ = flags;
    on_twin(*this, &Fallback::rtcSetSceneFlags, flags);
}

void SceneObject::set_build_quality(RTCBuildQuality quality) {
    if (quality > RTC_BUILD_QUALITY_HIGH) fail_argument("the build quality is unknown");
    quality_ = quality;
    on_twin(*this, &Fallback::rtcSetSceneBuildQuality, quality);
}

void SceneObject::set_progress_function(RTCProgressMonitorFunction function, void* user) {
    progress_function_ = function;
    progress_user_ = user;
    on_twin(*this, &Fallback::rtcSetSceneProgressMonitorFunction, function, user);
}

void SceneObject::report_progress(double part) const {
    if (progress_function_ != nullptr && !progress_function_(progress_user_, part))
        throw Failure{RTC_ERROR_CANCELLED, "the progress monitor ended the commit"};
}

void SceneObject::take_from_queries() {
    const Committed* const before = current_.exchange(nullptr, std::memory_order_acq_rel);
    if (before == nullptr || wait_for_queries(*before)) return;
    current_.store(before, std::memory_order_release);
    fail_operation("queries of the scene are under way");
}

void SceneObject::commit() {
    const std::scoped_lock lock(commit_mutex_);
    std::vector<Part> parts;
    try {
        parts = collect_parts(attachments());
    } catch (const Unsupported& what) {
        take_from_queries();
        announce_unsupported(what.message, device_->fallback());
        if (twin_ == nullptr) throw;
        forget();
        commit_twin();
        return;
    } catch (...) {
        take_from_queries();
        throw;
    }
    is_twin_committed_.store(false, std::memory_order_release);
    commit_parts(std::move(parts));
    if (twin_ != nullptr && device_->has_user_geometry()) commit_twin();
}

void SceneObject::commit_parts(std::vector<Part> parts) {
    const bool is_kept = committed_ != nullptr && have_same_shape(committed_->parts, parts) &&
                         committed_->way == BuildWay{quality_, is_any_refitted(parts)};
    const bool is_robust = (flags_ & RTC_SCENE_FLAG_ROBUST) != 0;
    if (is_kept && committed_->is_robust == is_robust &&
        have_same_versions(committed_->parts, parts)) {
        current_.store(committed_.get(), std::memory_order_release);
        return;
    }
    take_from_queries();
    report_progress(0);
    if (!is_kept || !update(parts)) build(std::move(parts));
    committed_->is_robust = is_robust;
    committed_->read_settings();
    if (has_point_queries_.load(std::memory_order_relaxed)) committed_->note_boxes();
    report_progress(1);
    current_.store(committed_.get(), std::memory_order_release);
}

void SceneObject::forget() {
    if (committed_ != nullptr) device_->give_memory(committed_->bytes);
    committed_ = nullptr;
}

void SceneObject::give_away() {
    if (committed_ == nullptr || committed_->triangles.empty()) return forget();
    device_->give_memory(committed_->bytes);
    device_->spare_trees().keep(std::move(committed_));
}

/// Queries during it are those of the program to avoid, as they are with Embree: the twin cannot
/// say whether it has anything to do.
void SceneObject::commit_twin() {
    const Fallback& fallback = *device_->fallback();
    fallback.rtcGetDeviceError(device_->twin());
    commit_twins(0);
    const RTCError error = fallback.rtcGetDeviceError(device_->twin());
    is_twin_committed_.store(error == RTC_ERROR_NONE, std::memory_order_release);
}

void SceneObject::commit_twins(std::size_t level) {
    if (level == kMostLevels) fail_argument("instances are nested more than 32 levels deep");
    for (const auto& [id, geometry] : attachments())
        for (SceneObject* const scene : geometry->instanced_scenes())
            scene->commit_twins(level + 1);
    on_twin(*this, &Fallback::rtcJoinCommitScene);
}

void SceneObject::build(std::vector<Part> parts) {
    give_away();
    const BuildWay way{quality_, is_any_refitted(parts)};
    const bool is_reusable = (flags_ & RTC_SCENE_FLAG_DYNAMIC) != 0;
    std::vector<std::vector<std::uint32_t>> triangles(parts.size());
    std::unique_ptr<Committed> made;
    for (Part& part : parts) part.find_used_vertices();
    if (is_reusable) {
        for (std::size_t i = 0; i < parts.size(); ++i) {
            parts[i].has_own_positions = true;
            parts[i].list_triangles(triangles[i]);
        }
        made = device_->spare_trees().take(way, parts, triangles);
    }
    const bool is_new = made == nullptr;
    if (is_new) {
        made = std::make_unique<Committed>();
        made->way = way;
    } else {
        // The tree reads positions where they are.
        for (std::size_t i = 0; i < parts.size(); ++i)
            parts[i].own_positions = std::move(made->parts[i].own_positions);
    }
    made->parts = std::move(parts);
    prepare(made->parts);
    made->bytes = bytes_of(made->parts);
    device_->take_memory(made->bytes);
    try {
        if (is_new) {
            made->scene = build_tree(made->parts, way, triangles, device_->tracer());
        } else if (made->scene) {
            made->scene->update_with_new_bounds();
        }
    } catch (...) {
        device_->give_memory(made->bytes);
        throw;
    }
    if (device_->is_verbose()) {
        std::fprintf(stderr, "morphray: %s %zu triangles\n",
                     is_new ? "built a tree of" : "updated an earlier scene's tree of",
                     triangle_count(made->parts));
    }
    if (is_new && is_reusable) made->triangles = std::move(triangles);
    committed_ = std::move(made);
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
    try {
        if (moved.size() == 1) {
            const Part& part = committed_->parts[moved.front()];
            if (part.used_vertices == 0) return true;
            committed_->scene->update(static_cast<std::uint32_t>(moved.front()), 0,
                                      part.used_vertices);
        } else {
            committed_->scene->update();
        }
    } catch (...) {
        forget();
        throw;
    }
    return true;
}

}  // namespace mray::embree

using namespace mray::embree;

RTCScene rtcNewScene(RTCDevice device) {
    return with<Device>("rtcNewScene", device,
                        [](Device& d) { return reinterpret_cast<RTCScene>(new SceneObject(d)); });
}

RTCDevice rtcGetSceneDevice(RTCScene scene) {
    return with<SceneObject>("rtcGetSceneDevice", scene, [](SceneObject& s) {
        s.device().retain();
        return reinterpret_cast<RTCDevice>(&s.device());
    });
}

void rtcRetainScene(RTCScene scene) {
    with<SceneObject>("rtcRetainScene", scene, [](SceneObject& s) { s.retain(); });
}

void rtcReleaseScene(RTCScene scene) {
    with<SceneObject>("rtcReleaseScene", scene, [](SceneObject& s) { s.release(); });
}

unsigned int rtcAttachGeometry(RTCScene scene, RTCGeometry geometry) {
    unsigned int id = kInvalid;
    with<SceneObject>("rtcAttachGeometry", scene, [&](SceneObject& s) {
        if (geometry == nullptr) fail_argument("the geometry is null");
        id = s.attach(*reinterpret_cast<Geometry*>(geometry));
    });
    return id;
}

void rtcAttachGeometryByID(RTCScene scene, RTCGeometry geometry, unsigned int id) {
    with<SceneObject>("rtcAttachGeometryByID", scene, [&](SceneObject& s) {
        if (geometry == nullptr) fail_argument("the geometry is null");
        if (id == kInvalid) fail_argument("the geometry ID is RTC_INVALID_GEOMETRY_ID");
        s.attach(*reinterpret_cast<Geometry*>(geometry), id);
    });
}

void rtcDetachGeometry(RTCScene scene, unsigned int id) {
    with<SceneObject>("rtcDetachGeometry", scene, [&](SceneObject& s) { s.detach(id); });
}

RTCGeometry rtcGetGeometry(RTCScene scene, unsigned int id) {
    return with<SceneObject>("rtcGetGeometry", scene, [&](SceneObject& s) {
        return reinterpret_cast<RTCGeometry>(s.find(id));
    });
}

RTCGeometry rtcGetGeometryThreadSafe(RTCScene scene, unsigned int id) {
    return with<SceneObject>("rtcGetGeometryThreadSafe", scene, [&](SceneObject& s) {
        return reinterpret_cast<RTCGeometry>(s.find_locked(id));
    });
}

void rtcCommitScene(RTCScene scene) {
    with<SceneObject>("rtcCommitScene", scene, [](SceneObject& s) { s.commit(); });
}

void rtcJoinCommitScene(RTCScene scene) {
    with<SceneObject>("rtcJoinCommitScene", scene, [](SceneObject& s) { s.commit(); });
}

void rtcSetSceneProgressMonitorFunction(RTCScene scene, RTCProgressMonitorFunction function,
                                        void* user) {
    with<SceneObject>("rtcSetSceneProgressMonitorFunction", scene,
                      [&](SceneObject& s) { s.set_progress_function(function, user); });
}

void rtcSetSceneBuildQuality(RTCScene scene, enum RTCBuildQuality quality) {
    with<SceneObject>("rtcSetSceneBuildQuality", scene,
                      [&](SceneObject& s) { s.set_build_quality(quality); });
}

void rtcSetSceneFlags(RTCScene scene, enum RTCSceneFlags flags) {
    with<SceneObject>("rtcSetSceneFlags", scene, [&](SceneObject& s) { s.set_flags(flags); });
}

RTCSceneFlags rtcGetSceneFlags(RTCScene scene) {
    return with<SceneObject>("rtcGetSceneFlags", scene, [](SceneObject& s) { return s.flags(); });
}
