// The benchmark compiles this file for its machine, so that rays are made and answers are stored in
// vectors.
#include "lab/methods/embree.h"

#include <fmt/format.h>

#ifdef __SSE2__
#include <pmmintrin.h>
#include <xmmintrin.h>
#endif

#include <cmath>
#include <cstring>

#include "common/base/errors.h"
#include "common/bvh/box.h"

namespace mray::lab {
namespace {

/// Treats denormals as zeros while it lives, as Embree requires for tracing.
class [[maybe_unused]] FlushedDenormals {
#ifdef __SSE2__
public:
    FlushedDenormals() {
        _MM_SET_FLUSH_ZERO_MODE(_MM_FLUSH_ZERO_ON);
        _MM_SET_DENORMALS_ZERO_MODE(_MM_DENORMALS_ZERO_ON);
    }
    ~FlushedDenormals() { _mm_setcsr(saved_); }

private:
    unsigned int saved_ = _mm_getcsr();
#endif
};

/// What Embree needs beside the rays: the context of version 3, the arguments of version 4. For one
/// thread at a time; packets have -1 in `valid` for active rays, else 0.
class EmbreeQuery {
public:
    explicit EmbreeQuery(bool is_coherent) {
#if MORPHRAY_EMBREE == 3
        rtcInitIntersectContext(&intersect_);
        intersect_.flags = is_coherent ? RTC_INTERSECT_CONTEXT_FLAG_COHERENT
                                       : RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
        occluded_ = intersect_;
#else
        rtcInitIntersectArguments(&intersect_);
        rtcInitOccludedArguments(&occluded_);
        intersect_.flags = occluded_.flags =
            is_coherent ? RTC_RAY_QUERY_FLAG_COHERENT : RTC_RAY_QUERY_FLAG_INCOHERENT;
#endif
    }

    void trace(RTCScene scene, RTCRayHit& ray, const int* = nullptr) {
        call(rtcIntersect1, intersect_, ray, scene);
    }
    void trace(RTCScene scene, RTCRay& ray, const int*) {
        call(rtcOccluded1, occluded_, ray, scene);
    }
#define MORPHRAY_TRACE_PACKET(n)                                       \
    void trace(RTCScene scene, RTCRayHit##n& rays, const int* valid) { \
        call(rtcIntersect##n, intersect_, rays, valid, scene);         \
    }                                                                  \
    void trace(RTCScene scene, RTCRay##n& rays, const int* valid) {    \
        call(rtcOccluded##n, occluded_, rays, valid, scene);           \
    }
    MORPHRAY_TRACE_PACKET(4)
    MORPHRAY_TRACE_PACKET(8)
    MORPHRAY_TRACE_PACKET(16)
#undef MORPHRAY_TRACE_PACKET

    /// Single rays that lie one after the other; only if kEmbreeHasStreams.
    template <class Record>
    void stream([[maybe_unused]] RTCScene scene, [[maybe_unused]] Record* rays,
                [[maybe_unused]] std::size_t count) {
#if MORPHRAY_EMBREE == 3
        const auto n = static_cast<unsigned int>(count);
        if constexpr (std::is_same_v<Record, RTCRay>) {
            rtcOccluded1M(scene, &occluded_, rays, n, sizeof(*rays));
        } else {
            rtcIntersect1M(scene, &intersect_, rays, n, sizeof(*rays));
        }
#endif
    }

private:
    template <class Function, class Arguments, class Record, class... Leading>
    static void call(Function& function, Arguments& arguments, Record& record, Leading... leading) {
#if MORPHRAY_EMBREE == 3
        function(leading..., &arguments, &record);
#else
        function(leading..., &record, &arguments);
#endif
    }

#if MORPHRAY_EMBREE == 3
    RTCIntersectContext intersect_, occluded_;
#else
    RTCIntersectArguments intersect_;
    RTCOccludedArguments occluded_;
#endif
};

// Lane i of a packet's field, which is a scalar in records of one ray.
template <class T>
T& lane(T& field, std::size_t) {
    return field;
}
template <class T, std::size_t N>
T& lane(T (&field)[N], std::size_t i) {
    return field[i];
}

/// An RTCRay, RTCRay4 and so on is for any hits, an RTCRayHit for the closest ones.
template <class Record>
inline constexpr bool kAnyHit = !requires(Record record) {
    record.ray;
};

template <class Record>
auto& ray_of(Record& record) {
    if constexpr (kAnyHit<Record>) {
        return record;
    } else {
        return record.ray;
    }
}

template <class Record>
inline constexpr std::size_t kLanesOf = sizeof(ray_of(std::declval<Record&>()).org_x) /
                                        sizeof(float);

/// Sets the members that differ from ray to ray, in lane i of an RTCRay, RTCRay4 and so on.
template <class RayRecord>
void copy_ray(RayRecord& record, std::size_t i, const Ray& ray) {
    lane(record.org_x, i) = ray.org.x;
    lane(record.org_y, i) = ray.org.y;
    lane(record.org_z, i) = ray.org.z;
    lane(record.tnear, i) = ray.tnear;
    lane(record.dir_x, i) = ray.dir.x;
    lane(record.dir_y, i) = ray.dir.y;
    lane(record.dir_z, i) = ray.dir.z;
    lane(record.tfar, i) = ray.tfar;
}

template <class RayRecord>
void set_ray(RayRecord& record, std::size_t i, const Ray& ray) {
    copy_ray(record, i, ray);
    lane(record.time, i) = 0;
    lane(record.mask, i) = 0xFFFFFFFFu;
    lane(record.id, i) = 0;
    lane(record.flags, i) = 0;
}

/// Sets all lanes to rays from one origin, which have no end yet.
template <class Record>
void set_origin(Record& record, vec3 org) {
    for (std::size_t i = 0; i < kLanesOf<Record>; ++i)
        set_ray(ray_of(record), i, {org, 0, {0, 0, 1}, 0});
}

template <class HitRecord>
void clear_hits(HitRecord& record) {
    for (std::size_t i = 0; i < kLanesOf<HitRecord>; ++i) {
        lane(record.hit.geomID, i) = RTC_INVALID_GEOMETRY_ID;
        lane(record.hit.primID, i) = RTC_INVALID_GEOMETRY_ID;
    }
}

/// The camera rays of a block of 4 x 4 pixels, row by row.
void make_camera_rays(const Camera& camera, std::uint32_t x0, std::uint32_t y0, RTCRay16& record) {
    for (std::uint32_t i = 0; i < kPacketSize; ++i) {
        const vec3 dir =
            canonical_direction(camera_direction(camera, x0 + i % kBlockSize, y0 + i / kBlockSize));
        record.dir_x[i] = dir.x;
        record.dir_y[i] = dir.y;
        record.dir_z[i] = dir.z;
        record.tnear[i] = 0;
        record.tfar[i] = kInfiniteT;
    }
}

template <class HitRecord>
Hit hit_of(HitRecord& record, std::size_t i) {
    static_assert(kNoPrim == RTC_INVALID_GEOMETRY_ID);
    const std::uint32_t prim_id = lane(record.hit.primID, i);
    const bool is_hit = prim_id != kNoPrim;
    return {is_hit ? lane(record.ray.tfar, i) : 0, is_hit ? lane(record.hit.u, i) : 0,
            is_hit ? lane(record.hit.v, i) : 0, prim_id};
}

/// By calls of a ray, of a packet, or of streams of up to kMost rays, for the cache. Records are
/// made within the time, from what our tracers read too.
template <class AnyHits, class ClosestHits, std::size_t kMost = 1>
class EmbreeTracer : public cpu::ImageTracer {
public:
    EmbreeTracer(const EmbreeScene& scene, bool is_coherent)
        : ImageTracer(best_simd_target()), scene_(scene.handle.get()), is_coherent_(is_coherent) {}

    void intersect(std::span<const Ray> rays, std::span<Hit> hits) const override {
        trace<ClosestHits>(rays, [&](std::size_t ray, ClosestHits& record, std::size_t i) {
            hits[ray] = hit_of(record, i);
        });
    }

    void occluded(std::span<const Ray> rays, std::span<std::uint8_t> occluded) const override {
        trace<AnyHits>(rays, [&](std::size_t ray, AnyHits& record, std::size_t i) {
            occluded[ray] = lane(record.tfar, i) < 0;
        });
    }

private:
    /// Calls store(ray, record, lane) for each ray, after it has been traced.
    template <class Record, class Store>
    void trace(std::span<const Ray> rays, const Store& store) const {
        constexpr std::size_t kRays = kLanesOf<Record>;
        const FlushedDenormals flushed;
        EmbreeQuery query(is_coherent_);
        std::array<Record, kMost> records;
        for (Record& record : records) set_origin(record, {0, 0, 0});
        for (std::size_t begin = 0; begin < rays.size(); begin += kMost * kRays) {
            const std::size_t count = std::min(kMost * kRays, rays.size() - begin);
            alignas(4 * kRays) std::array<int, kRays> mask{};
            for (std::size_t i = 0; i < count; ++i) {
                copy_ray(ray_of(records[i / kRays]), i % kRays, rays[begin + i]);
                mask[i % kRays] = -1;
            }
            if constexpr (!kAnyHit<Record>)
                for (Record& record : records) clear_hits(record);
            if constexpr (kMost > 1) {
                query.stream(scene_, records.data(), count);
            } else {
                query.trace(scene_, records[0], mask.data());
            }
            for (std::size_t i = 0; i < count; ++i) store(begin + i, records[i / kRays], i % kRays);
        }
    }

protected:
    RTCScene scene_;
    bool is_coherent_;
};

/// Makes camera rays in the records of packets, and copies shadow rays into them as they lie.
class EmbreeTiles final : public EmbreeTracer<RTCRay16, RTCRayHit16> {
public:
    using EmbreeTracer::EmbreeTracer;

    const cpu::CameraPacket* intersect_camera(const ImageParams& params, const cpu::Tile& tile,
                                              Hit* hits, std::size_t stride,
                                              const Watch& = {}) const override {
        const FlushedDenormals flushed;
        EmbreeQuery query(is_coherent_);
        RTCRayHit16 record;
        set_origin(record, params.camera.org);
        alignas(64) std::array<int, kPacketSize> mask;
        mask.fill(-1);
        const std::uint32_t pixels = (tile.x1 - tile.x0) * (tile.y1 - tile.y0);
        for (std::uint32_t block = 0; block < pixels / kPacketSize; ++block) {
            const auto [x, y] = block_offset(block);
            make_camera_rays(params.camera, tile.x0 + x, tile.y0 + y, record.ray);
            clear_hits(record);
            query.trace(scene_, record, mask.data());
            Hit* const first = hits + y * stride + x;
            for (std::size_t i = 0; i < kPacketSize; ++i)
                first[i / kBlockSize * stride + i % kBlockSize] = hit_of(record, i);
        }
        return nullptr;
    }

    void occluded_shared_origin(vec3 org, std::span<const cpu::SharedOriginRays> rays,
                                std::span<std::uint8_t> occluded,
                                const cpu::TileCounts& = {}) const override {
        const FlushedDenormals flushed;
        EmbreeQuery query(is_coherent_);
        RTCRay16 record;
        set_origin(record, org);
        std::ranges::fill(occluded, std::uint8_t{1});
        for (std::size_t block = 0; block < rays.size(); ++block) {
            alignas(64) std::array<int, kPacketSize> mask;
            int any = 0;
            for (std::uint32_t i = 0; i < kPacketSize; ++i)
                any |= mask[i] = -int{rays[block].has(i)};
            if (any == 0) continue;
            std::memcpy(record.dir_x, rays[block].dir[0], sizeof(record.dir_x));
            std::memcpy(record.dir_y, rays[block].dir[1], sizeof(record.dir_y));
            std::memcpy(record.dir_z, rays[block].dir[2], sizeof(record.dir_z));
            std::memcpy(record.tfar, rays[block].tfar, sizeof(record.tfar));
            std::memset(record.tnear, 0, sizeof(record.tnear));
            query.trace(scene_, record, mask.data());
            for (std::size_t i = 0; i < kPacketSize; ++i)
                occluded[block * kPacketSize + i] = mask[i] == 0 || record.tfar[i] < 0;
        }
    }
};

void check(const EmbreeDevice& device, const char* action) {
    const RTCError error = rtcGetDeviceError(device.handle.get());
    if (error == RTC_ERROR_NONE) return;
    throw Error(ErrorKind::kInternal, "Embree: {}: error {}", action, static_cast<int>(error));
}

constexpr std::size_t kGrain = 1024;
using QueryRange = tbb::blocked_range<std::size_t>;

struct PointSearch {
    const uvec3* triangles;
    const vec3* vertices;
    vec3 point;
    float d2;
    NearestPoint nearest;
};

bool visit_triangle(RTCPointQueryFunctionArguments* args) {
    PointSearch& search = *static_cast<PointSearch*>(args->userPtr);
    const uvec3 t = search.triangles[args->primID];
    const vec3 closest = ericson_closest_point(search.point, search.vertices[t.x],
                                               search.vertices[t.y], search.vertices[t.z]);
    const vec3 offset = closest - search.point;
    const float d2 = glm::dot(offset, offset);
    if (!(d2 < search.d2)) return false;
    search.d2 = d2;
    search.nearest.point = closest;
    search.nearest.prim_id = args->primID;
    args->query->radius = std::sqrt(d2);
    return true;
}

void count_and_reject(const RTCFilterFunctionNArguments* args) {
    auto* counts = static_cast<std::uint64_t*>(args->geometryUserPtr);
    for (unsigned int i = 0; i < args->N; ++i) {
        if (args->valid[i] == 0) continue;
        ++counts[RTCRayN_id(args->ray, args->N, i)];
        args->valid[i] = 0;
    }
}

}  // namespace

EmbreeDevice::EmbreeDevice(int threads, const std::string& widest_isa)
    : isa(widest_isa.empty() ? "all" : widest_isa) {
    const std::string settings =
        fmt::format("threads={}{}{}", threads, widest_isa.empty() ? "" : ",isa=", widest_isa);
    handle.reset(rtcNewDevice(settings.c_str()));
    if (!handle) throw Error(ErrorKind::kUnavailable, "Embree: no device with \"{}\"", settings);
}

std::vector<EmbreeDevice> embree_devices(int threads) {
    std::vector<EmbreeDevice> devices;
    const std::string best = best_simd_target().name;
    if (best == "avx512") devices.emplace_back(threads, "avx512");
    devices.emplace_back(threads, best.starts_with("avx") ? "avx2" : "");
    return devices;
}

EmbreeScene::EmbreeScene(const EmbreeDevice& on, const Topology& mesh,
                         std::span<const vec3> positions, RTCBuildQuality way, bool is_robust)
    : device(on),
      topology(mesh),
      quality(way),
      robust(is_robust),
      vertices(positions.size() + 1),
      geometry(rtcNewGeometry(on.handle.get(), RTC_GEOMETRY_TYPE_TRIANGLE)),
      handle(rtcNewScene(on.handle.get())) {
    set_positions(positions);
    rtcSetSharedGeometryBuffer(geometry.get(), RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                               vertices.data(), 0, sizeof(vec3), mesh.vertex_count);
    rtcSetSharedGeometryBuffer(geometry.get(), RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                               mesh.triangles.data(), 0, sizeof(uvec3), mesh.triangles.size());
    // Embree refits only with these three; otherwise it rebuilds silently.
    const bool refits = quality == RTC_BUILD_QUALITY_REFIT;
    rtcSetGeometryBuildQuality(geometry.get(), quality);
    rtcSetSceneBuildQuality(handle.get(), refits ? RTC_BUILD_QUALITY_LOW : quality);
    const int flags = (refits ? RTC_SCENE_FLAG_DYNAMIC : RTC_SCENE_FLAG_NONE) |
                      (robust ? RTC_SCENE_FLAG_ROBUST : RTC_SCENE_FLAG_NONE);
    rtcSetSceneFlags(handle.get(), static_cast<RTCSceneFlags>(flags));
    rtcAttachGeometry(handle.get(), geometry.get());
    check(on, "make a scene");
}

std::string EmbreeScene::name() const {
    constexpr std::array kQualities = {"LOW", "MEDIUM", "HIGH", "REFIT"};
    return fmt::format("{} {} {}", robust ? "robust" : "fast", kQualities[quality], device.isa);
}

void EmbreeScene::set_positions(std::span<const vec3> positions) {
    // Embree ignores triangles with NaN vertices, as morphray does those that are not finite.
    constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
    for (std::size_t i = 0; i < positions.size(); ++i)
        vertices[i] = is_finite_vertex(positions[i]) ? positions[i] : vec3(kNan, kNan, kNan);
}

void EmbreeScene::commit() {
    rtcUpdateGeometryBuffer(geometry.get(), RTC_BUFFER_TYPE_VERTEX, 0);
    rtcCommitGeometry(geometry.get());
    rtcCommitScene(handle.get());
    check(device, "commit a scene");
}

std::vector<EmbreeScene> embree_variants(std::span<const EmbreeDevice> devices,
                                         const Topology& topology,
                                         std::span<const vec3> positions) {
    std::vector<EmbreeScene> scenes;
    for (const EmbreeDevice& device : devices)
        for (const auto quality : {RTC_BUILD_QUALITY_MEDIUM, RTC_BUILD_QUALITY_HIGH})
            for (const bool robust : {false, true})
                scenes.emplace_back(device, topology, positions, quality, robust).commit();
    return scenes;
}

std::vector<Tracer> embree_peers(std::span<const EmbreeScene> scenes, const RaySet& set) {
    std::vector<Tracer> all;
    const auto answers = std::make_shared<TraceAnswers>(set);
    const bool is_incoherent = set.kind == RayKind::kDiffuse || set.kind == RayKind::kAo;
    const auto add = [&]<class Traces>(std::type_identity<Traces>, const char* suffix,
                                       bool one_ray = false) {
        const bool by_tiles =
            !one_ray && (set.kind == RayKind::kPrimary || set.kind == RayKind::kShadow);
        for (const EmbreeScene& scene : scenes) {
            const std::string name = fmt::format(
                "{}{} {}", set.any_hit() ? "Occluded" : "Intersect", suffix, scene.name());
            const auto tracer = std::make_shared<const Traces>(scene, !is_incoherent);
            Tracer& made = all.emplace_back(
                by_tiles ? tile_tracer(name, tracer, set, answers)
                         : batch_tracer(name, RaysAtOnce::kStream, tracer, set, answers));
            made.group = fmt::format("embree {} {}", one_ray, scene.robust);
            made.at_once = one_ray ? RaysAtOnce::kOne : RaysAtOnce::kPacket;
        }
    };
    const std::type_identity<EmbreeTracer<RTCRay, RTCRayHit>> singles;
    add(singles, "1", true);
    if (set.kind == RayKind::kOneRay) return all;
    add(std::type_identity<EmbreeTiles>(), "16");
    if (set.in_packets()) return all;
    add(singles, "1");
    add(std::type_identity<EmbreeTracer<RTCRay4, RTCRayHit4>>(), "4");
    add(std::type_identity<EmbreeTracer<RTCRay8, RTCRayHit8>>(), "8");
    if (kEmbreeHasStreams) add(std::type_identity<EmbreeTracer<RTCRay, RTCRayHit, 256>>(), "1M");
    return all;
}

std::shared_ptr<const cpu::ImageTracer> embree_tiles(const EmbreeScene& scene) {
    return std::make_shared<const EmbreeTiles>(scene, true);
}

EmbreeQueries::EmbreeQueries(const EmbreeDevice& device, const Topology& topology,
                             std::span<const vec3> positions, bool robust, std::size_t most)
    : scene(device, topology, positions, RTC_BUILD_QUALITY_MEDIUM, robust),
      nearest(most),
      counts(most) {
    rtcSetGeometryUserData(scene.geometry.get(), counts.data());
    rtcSetGeometryIntersectFilterFunction(scene.geometry.get(), count_and_reject);
    scene.commit();
}

void EmbreeQueries::find_closest(std::span<const vec3> points) {
    constexpr float kInfinity = std::numeric_limits<float>::infinity();
    tbb::parallel_for(QueryRange(0, points.size(), kGrain), [&](const QueryRange& range) {
        const FlushedDenormals flushed;
        RTCPointQueryContext context;
        rtcInitPointQueryContext(&context);
        PointSearch search{scene.topology.triangles.data(), scene.vertices.data(), {}, {}, {}};
        for (std::size_t i = range.begin(); i < range.end(); ++i) {
            search.point = points[i];
            search.d2 = kInfinity;
            search.nearest = {{0, 0, 0}, kInfinity, kNoPrim};
            RTCPointQuery query;
            query.x = points[i].x;
            query.y = points[i].y;
            query.z = points[i].z;
            query.time = 0;
            query.radius = kInfinity;
            rtcPointQuery(scene.handle.get(), &query, &context, visit_triangle, &search);
            search.nearest.distance = std::sqrt(search.d2);
            nearest[i] = search.nearest;
        }
    });
}

void EmbreeQueries::count(std::span<const Ray> rays, bool coherent) {
    std::fill_n(counts.begin(), rays.size(), 0);
    tbb::parallel_for(QueryRange(0, rays.size(), kGrain), [&](const QueryRange& range) {
        const FlushedDenormals flushed;
        EmbreeQuery query(coherent);
        RTCRayHit record;
        for (std::size_t i = range.begin(); i < range.end(); ++i) {
            set_ray(record.ray, 0, rays[i]);
            record.ray.id = static_cast<unsigned int>(i);
            clear_hits(record);
            query.trace(scene.handle.get(), record);
        }
    });
}

}  // namespace mray::lab
