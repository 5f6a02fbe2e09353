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
class FlushedDenormals {
public:
#ifdef __SSE2__
    FlushedDenormals() : saved_(_mm_getcsr()) {
        _MM_SET_FLUSH_ZERO_MODE(_MM_FLUSH_ZERO_ON);
        _MM_SET_DENORMALS_ZERO_MODE(_MM_DENORMALS_ZERO_ON);
    }
    ~FlushedDenormals() { _mm_setcsr(saved_); }

private:
    unsigned int saved_;
#else
    FlushedDenormals() {}
    ~FlushedDenormals() {}
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

/// Copies directions and ends; the origin is that of the record.
void copy_shadow_rays(const cpu::SharedOriginRays& rays, RTCRay16& record) {
    std::memcpy(record.dir_x, rays.dir[0], sizeof(rays.dir[0]));
    std::memcpy(record.dir_y, rays.dir[1], sizeof(rays.dir[1]));
    std::memcpy(record.dir_z, rays.dir[2], sizeof(rays.dir[2]));
    std::memcpy(record.tfar, rays.tfar, sizeof(rays.tfar));
    std::memset(record.tnear, 0, sizeof(record.tnear));
}

/// Sets mask[i] to -1 where ray i is active, else to 0; returns whether any is.
template <std::size_t N>
bool set_mask(const std::uint8_t* active, std::array<int, N>& mask) {
    int any = 0;
    for (std::size_t i = 0; i < N; ++i) {
        mask[i] = -static_cast<int>(active[i]);
        any |= mask[i];
    }
    return any != 0;
}

/// t means nothing where prim_id is RTC_INVALID_GEOMETRY_ID.
template <std::size_t N>
struct alignas(4 * N) HitBlock {
    float t[N];
    float u[N];
    float v[N];
    std::uint32_t prim_id[N];

    Hit operator[](std::size_t i) const {
        if (prim_id[i] == RTC_INVALID_GEOMETRY_ID) return no_hit();
        return {t[i], u[i], v[i], prim_id[i]};
    }
};

template <class HitRecord, std::size_t N>
void copy_hits(const HitRecord& record, HitBlock<N>& block) {
    std::memcpy(block.t, &record.ray.tfar, sizeof(block.t));
    std::memcpy(block.u, &record.hit.u, sizeof(block.u));
    std::memcpy(block.v, &record.hit.v, sizeof(block.v));
    std::memcpy(block.prim_id, &record.hit.primID, sizeof(block.prim_id));
}

/// By records of a ray or a packet: one a call, or streams of up to kMost, for the cache.
template <class Record, std::size_t kMost>
class RecordTracer {
public:
    explicit RecordTracer(const RaySet& set) : set_(set) {
        if (kAnyHit<Record>) {
            occluded_.resize(set.rays.size());
        } else {
            hits_.resize(set.rays.size() / kRays);
        }
    }

    /// In the calling thread's arena.
    void trace(const EmbreeScene& scene, const TileRange& range) {
        const bool is_shadow = set_.kind == RayKind::kShadow;
        const vec3 origin = is_shadow ? set_.params.light : set_.params.camera.org;
        const bool is_incoherent = set_.kind == RayKind::kDiffuse || set_.kind == RayKind::kAo;
        for_each_tile(set_, range, [&](const TileRays& tile) {
            const FlushedDenormals flushed;
            EmbreeQuery query(!is_incoherent);
            std::array<Record, kMost> records;
            for (Record& record : records) set_origin(record, origin);
            if constexpr (kMost == 1) {
                trace_packets(scene, tile, query, records[0]);
            } else {
                trace_streams(scene, tile, query, records);
            }
        });
    }

    TraceAnswers answers() const {
        TraceAnswers answers(set_);
        answers.occluded = occluded_;
        for (std::size_t ray = 0; ray < answers.hits.size(); ++ray)
            answers.hits[ray] = hits_[ray / kRays][ray % kRays];
        return answers;
    }

private:
    static constexpr std::size_t kRays = kLanesOf<Record>;

    void trace_packets(const EmbreeScene& scene, const TileRays& tile, EmbreeQuery& query,
                       Record& record) {
        for (std::size_t first = tile.begin; first < tile.end; first += kRays) {
            alignas(4 * kRays) std::array<int, kRays> mask;
            if (!set_mask<kRays>(&set_.active[first], mask)) continue;
            make(tile, first, record);
            query.trace(scene.handle(), record, mask.data());
            store(first, record);
        }
    }

    void trace_streams(const EmbreeScene& scene, const TileRays& tile, EmbreeQuery& query,
                       std::array<Record, kMost>& records) {
        for_each_active_run(set_, tile, kMost, [&](std::size_t begin, std::size_t count) {
            for (std::size_t i = 0; i < count; ++i) make(tile, begin + i, records[i]);
            query.stream(scene.handle(), records.data(), count);
            for (std::size_t i = 0; i < count; ++i) store(begin + i, records[i]);
        });
    }

    void make(const TileRays& tile, std::size_t first, Record& record) const {
        make_rays(tile, first, ray_of(record));
        if constexpr (!kAnyHit<Record>) clear_hits(record);
    }

    template <class RayRecord>
    void make_rays(const TileRays& tile, std::size_t first, RayRecord& record) const {
        if constexpr (kRays == kPacketSize) {
            if (set_.kind == RayKind::kPrimary) {
                const auto block = static_cast<std::uint32_t>((first - tile.begin) / kPacketSize);
                const BlockOffset corner = block_offset(block);
                return make_camera_rays(set_.params.camera, tile.tile.x0 + corner.x,
                                        tile.tile.y0 + corner.y, record);
            }
            if (set_.kind == RayKind::kShadow)
                return copy_shadow_rays(set_.shadows[first / kPacketSize], record);
        }
        for (std::size_t i = 0; i < kRays; ++i) copy_ray(record, i, set_.rays[first + i]);
    }

    void store(std::size_t first, const Record& record) {
        if constexpr (kAnyHit<Record>) {
            for (std::size_t i = 0; i < kRays; ++i) occluded_[first + i] = lane(record.tfar, i) < 0;
        } else {
            copy_hits(record, hits_[first / kRays]);
        }
    }

    const RaySet& set_;
    AlignedVector<HitBlock<kRays>> hits_;
    std::vector<std::uint8_t> occluded_;
};

struct EmbreePeers {
    std::span<const EmbreeVariant> scenes;
    const RaySet& set;
    std::vector<Tracer> all = {};

    /// By records for any hits or for the closest ones; `suffix` is that of Embree's function.
    template <class AnyHits, class ClosestHits, std::size_t kMost = 1>
    void add(const std::string& suffix, bool one_ray = false) {
        if (set.any_hit()) {
            add_by<AnyHits, kMost>("Occluded" + suffix, one_ray);
        } else {
            add_by<ClosestHits, kMost>("Intersect" + suffix, one_ray);
        }
    }

    /// One for each scene; they have their answers in common.
    template <class Record, std::size_t kMost>
    void add_by(const std::string& function, bool one_ray) {
        const auto tracer = std::make_shared<RecordTracer<Record, kMost>>(set);
        for (const EmbreeVariant& variant : scenes) {
            const EmbreeScene& scene = variant.scene;
            all.push_back(
                {.name = fmt::format("{} {} {}", function, variant.robust ? "robust" : "fast",
                                     variant.name),
                 .group = fmt::format("embree {} {}", one_ray, variant.robust),
                 .at_once = one_ray ? RaysAtOnce::kOne : RaysAtOnce::kPacket,
                 .trace = [tracer, &scene](const TileRange& range) { tracer->trace(scene, range); },
                 .answers = [tracer] { return tracer->answers(); }});
        }
    }
};

void trace_camera(RTCScene scene, const ImageParams& params, const cpu::Tile& tile, Frame& frame) {
    EmbreeQuery query(true);
    constexpr std::array kAllRays = {-1, -1, -1, -1, -1, -1, -1, -1,
                                     -1, -1, -1, -1, -1, -1, -1, -1};
    RTCRayHit16 record;
    set_origin(record, params.camera.org);
    for (std::uint32_t y0 = tile.y0; y0 < tile.y1; y0 += kBlockSize) {
        for (std::uint32_t x0 = tile.x0; x0 < tile.x1; x0 += kBlockSize) {
            make_camera_rays(params.camera, x0, y0, record.ray);
            clear_hits(record);
            query.trace(scene, record, kAllRays.data());
            HitBlock<kPacketSize> hits;
            copy_hits(record, hits);
            for (std::uint32_t i = 0; i < kPacketSize; ++i) {
                const std::size_t pixel =
                    std::size_t{y0 + i / kBlockSize} * params.width + x0 + i % kBlockSize;
                frame.hits[pixel] = hits[i];
            }
        }
    }
}

void trace_shadows(RTCScene scene, const cpu::PixelShader& shader, const cpu::ImageRegion& part) {
    EmbreeQuery query(true);
    cpu::SharedOriginRays rays[cpu::kSquareBlocks];
    cpu::LitPixels lit[cpu::kSquareBlocks];
    std::uint8_t occluded[cpu::kSquareRays] = {};
    if (shader.make_shadow_rays(part, rays, lit).rays > 0) {
        RTCRay16 record;
        set_origin(record, part.params.light);
        for (std::size_t block = 0; block < cpu::kSquareBlocks; ++block) {
            const cpu::SharedOriginRays& some = rays[block];
            int mask[kPacketSize];
            int any = 0;
            for (std::uint32_t i = 0; i < kPacketSize; ++i) any |= mask[i] = -int{some.has(i)};
            if (any == 0) continue;
            copy_shadow_rays(some, record);
            query.trace(scene, record, mask);
            for (std::size_t i = 0; i < kPacketSize; ++i)
                occluded[block * kPacketSize + i] = record.tfar[i] < 0 ? 1 : 0;
        }
    }
    shader.shade_shadows(part, occluded, lit);
}

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

EmbreeScene::EmbreeScene(const EmbreeDevice& device, const Topology& topology,
                         std::span<const vec3> positions, RTCBuildQuality quality, bool robust)
    : device_(&device),
      topology_(&topology),
      // Embree loads 16 bytes at each vertex.
      vertices_(positions.size() + 1),
      geometry_(rtcNewGeometry(device.handle.get(), RTC_GEOMETRY_TYPE_TRIANGLE)),
      scene_(rtcNewScene(device.handle.get())) {
    set_positions(positions);
    rtcSetSharedGeometryBuffer(geometry_.get(), RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                               vertices_.data(), 0, sizeof(vec3), topology.vertex_count);
    rtcSetSharedGeometryBuffer(geometry_.get(), RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                               topology.triangles.data(), 0, sizeof(uvec3),
                               topology.triangles.size());
    // Embree refits only with these three; otherwise it rebuilds silently.
    const bool refits = quality == RTC_BUILD_QUALITY_REFIT;
    rtcSetGeometryBuildQuality(geometry_.get(), quality);
    rtcSetSceneBuildQuality(scene_.get(), refits ? RTC_BUILD_QUALITY_LOW : quality);
    const int flags = (refits ? RTC_SCENE_FLAG_DYNAMIC : RTC_SCENE_FLAG_NONE) |
                      (robust ? RTC_SCENE_FLAG_ROBUST : RTC_SCENE_FLAG_NONE);
    rtcSetSceneFlags(scene_.get(), static_cast<RTCSceneFlags>(flags));
    rtcAttachGeometry(scene_.get(), geometry_.get());
    check(device, "make a scene");
}

void EmbreeScene::set_positions(std::span<const vec3> positions) {
    // Embree ignores triangles with NaN vertices, as morphray does those that are not finite.
    constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
    for (std::size_t i = 0; i < positions.size(); ++i)
        vertices_[i] = is_finite_vertex(positions[i]) ? positions[i] : vec3(kNan, kNan, kNan);
}

void EmbreeScene::commit() {
    rtcUpdateGeometryBuffer(geometry_.get(), RTC_BUFFER_TYPE_VERTEX, 0);
    rtcCommitGeometry(geometry_.get());
    rtcCommitScene(scene_.get());
    check(*device_, "commit a scene");
}

std::vector<EmbreeVariant> embree_variants(std::span<const EmbreeDevice> devices,
                                           const Topology& topology,
                                           std::span<const vec3> positions) {
    std::vector<EmbreeVariant> variants;
    for (const EmbreeDevice& device : devices) {
        for (const auto quality : {RTC_BUILD_QUALITY_MEDIUM, RTC_BUILD_QUALITY_HIGH}) {
            const char* const name = quality == RTC_BUILD_QUALITY_MEDIUM ? "MEDIUM" : "HIGH";
            for (const bool robust : {false, true}) {
                variants.push_back({EmbreeScene(device, topology, positions, quality, robust),
                                    robust, fmt::format("{} {}", name, device.isa)});
                variants.back().scene.commit();
            }
        }
    }
    return variants;
}

std::vector<Tracer> embree_peers(std::span<const EmbreeVariant> scenes, const RaySet& set) {
    EmbreePeers peers{scenes, set};
    peers.add<RTCRay, RTCRayHit>("1", true);
    if (set.kind == RayKind::kOneRay) return peers.all;
    peers.add<RTCRay16, RTCRayHit16>("16");
    if (set.in_packets()) return peers.all;
    peers.add<RTCRay, RTCRayHit>("1");
    peers.add<RTCRay4, RTCRayHit4>("4");
    peers.add<RTCRay8, RTCRayHit8>("8");
    if (kEmbreeHasStreams) peers.add<RTCRay, RTCRayHit, 256>("1M");
    return peers.all;
}

Tracer embree_tracer(const EmbreeScene& scene, const RaySet& set) {
    const auto tracer = std::make_shared<RecordTracer<RTCRayHit, 1>>(set);
    return {.name = "Intersect1",
            .trace = [tracer, &scene](const TileRange& range) { tracer->trace(scene, range); },
            .answers = [tracer] { return tracer->answers(); }};
}

void trace_frame(const EmbreeScene& scene, const ImageParams& params, const cpu::ShadedMesh& mesh,
                 const cpu::PixelShader& shader, Frame& frame) {
    static_assert(kPacketSize == cpu::kBlockRays && kBlockSize * kBlockSize == kPacketSize);
    const cpu::ImageTiles squares(params.width, params.height, cpu::kSquareSide);
    tbb::parallel_for(std::uint32_t{0}, squares.count(), [&](std::uint32_t i) {
        const FlushedDenormals flushed;
        const cpu::Tile tile = squares[i];
        trace_camera(scene.handle(), params, tile, frame);
        trace_shadows(scene.handle(), shader, {params, mesh, tile, frame});
    });
}

EmbreeQueries::EmbreeQueries(const EmbreeDevice& device, const Topology& topology,
                             std::span<const vec3> positions, bool robust, std::size_t most_rays)
    : name_(fmt::format("{} MEDIUM {}", robust ? "robust" : "fast", device.isa)),
      group_(robust ? "robust" : "fast"),
      scene_(device, topology, positions, RTC_BUILD_QUALITY_MEDIUM, robust),
      counts_(most_rays) {
    rtcSetGeometryUserData(scene_.geometry(), counts_.data());
    rtcSetGeometryIntersectFilterFunction(scene_.geometry(), count_and_reject);
    scene_.commit();
}

void EmbreeQueries::find_closest(std::span<const vec3> points,
                                 std::span<NearestPoint> nearest) const {
    constexpr float kInfinity = std::numeric_limits<float>::infinity();
    tbb::parallel_for(QueryRange(0, points.size(), kGrain), [&](const QueryRange& range) {
        const FlushedDenormals flushed;
        RTCPointQueryContext context;
        rtcInitPointQueryContext(&context);
        PointSearch search{scene_.topology().triangles.data(), scene_.vertices(), {}, {}, {}};
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
            rtcPointQuery(scene_.handle(), &query, &context, visit_triangle, &search);
            search.nearest.distance = std::sqrt(search.d2);
            nearest[i] = search.nearest;
        }
    });
}

void EmbreeQueries::count(std::span<const Ray> rays, bool coherent) {
    std::fill_n(counts_.begin(), rays.size(), 0);
    tbb::parallel_for(QueryRange(0, rays.size(), kGrain), [&](const QueryRange& range) {
        const FlushedDenormals flushed;
        EmbreeQuery query(coherent);
        RTCRayHit record;
        for (std::size_t i = range.begin(); i < range.end(); ++i) {
            set_ray(record.ray, 0, rays[i]);
            record.ray.id = static_cast<unsigned int>(i);
            clear_hits(record);
            query.trace(scene_.handle(), record);
        }
    });
}

}  // namespace mray::lab
