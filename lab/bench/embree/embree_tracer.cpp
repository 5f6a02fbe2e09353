// Compiled for the machine that builds it, so that rays are made and answers are stored in vectors.
#include <fmt/format.h>

#include <array>
#include <cstring>
#include <memory>

#include "lab/bench/embree/embree_peer.h"

namespace mray::bench {
namespace {

using namespace embree;

/// An RTCRay, RTCRay4 and so on is for any hits, an RTCRayHit for the closest ones.
template <class Record>
inline constexpr bool kAnyHit = !requires(Record record) {
    record.ray;
};

template <class Record>
auto& ray_of(Record& record) {
    if constexpr (requires { record.ray; }) {
        return record.ray;
    } else {
        return record;
    }
}

template <class Record>
inline constexpr std::size_t kLanesOf = sizeof(ray_of(std::declval<Record&>()).org_x) /
                                        sizeof(float);

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
};

/// By records of a ray or a packet: one a call, or streams of up to kMost, for the cache.
template <class Record, std::size_t kMost>
class RecordTracer {
public:
    explicit RecordTracer(const TraceWork& work) : work_(work) {
        if (kAnyHit<Record>) {
            occluded_.resize(work.rays.size());
        } else {
            hits_.resize(work.rays.size() / kRays);
        }
    }

    /// In the calling thread's arena.
    void trace(const EmbreeScene& scene, const WorkPart& part) {
        const bool is_shadow = work_.kind == WorkKind::kShadow;
        const vec3 origin = is_shadow ? work_.params.light : work_.params.camera.org;
        const bool is_incoherent = work_.kind == WorkKind::kDiffuse || work_.kind == WorkKind::kAo;
        for_each_tile(work_, part, [&](const TileRays& tile) {
            const FlushedDenormals flushed;
            Query query(is_incoherent ? Coherence::kIncoherent : Coherence::kCoherent);
            std::array<Record, kMost> records;
            for (Record& record : records) {
                for (std::size_t i = 0; i < kRays; ++i)
                    set_ray(ray_of(record), i, {origin, 0, {0, 0, 1}, 0});
            }
            if constexpr (kMost == 1) {
                trace_packets(scene, tile, query, records[0]);
            } else {
                trace_streams(scene, tile, query, records);
            }
        });
    }

    TraceAnswers answers() const {
        TraceAnswers answers(work_);
        answers.occluded = occluded_;
        for (std::size_t ray = 0; ray < answers.hits.size(); ++ray) {
            const HitBlock<kRays>& block = hits_[ray / kRays];
            const std::size_t i = ray % kRays;
            const bool missed = block.prim_id[i] == RTC_INVALID_GEOMETRY_ID;
            answers.hits[ray] =
                missed ? no_hit() : Hit{block.t[i], block.u[i], block.v[i], block.prim_id[i]};
        }
        return answers;
    }

private:
    static constexpr std::size_t kRays = kLanesOf<Record>;

    void trace_packets(const EmbreeScene& scene, const TileRays& tile, Query& query,
                       Record& record) {
        for (std::size_t first = tile.begin; first < tile.end; first += kRays) {
            alignas(4 * kRays) std::array<int, kRays> mask;
            if (!set_mask<kRays>(&work_.active[first], mask)) continue;
            make(tile, first, record);
            query.trace(scene.handle(), record, mask.data());
            store(first, record);
        }
    }

    void trace_streams(const EmbreeScene& scene, const TileRays& tile, Query& query,
                       std::array<Record, kMost>& records) {
        for_each_active_run(work_, tile, [&](std::size_t begin, std::size_t end) {
            for (std::size_t count = 0; begin < end; begin += count) {
                count = std::min(kMost, end - begin);
                for (std::size_t i = 0; i < count; ++i) make(tile, begin + i, records[i]);
                query.stream(scene.handle(), records.data(), count);
                for (std::size_t i = 0; i < count; ++i) store(begin + i, records[i]);
            }
        });
    }

    void make(const TileRays& tile, std::size_t first, Record& record) const {
        make_rays(tile, first, ray_of(record));
        if constexpr (!kAnyHit<Record>) {
            for (std::size_t i = 0; i < kRays; ++i) clear_hit(record, i);
        }
    }

    template <class RayRecord>
    void make_rays(const TileRays& tile, std::size_t first, RayRecord& record) const {
        if constexpr (kRays == kPacketSize) {
            if (work_.kind == WorkKind::kPrimary) {
                const auto block = static_cast<std::uint32_t>((first - tile.begin) / kPacketSize);
                const BlockOffset corner = block_offset(block);
                return make_camera_rays(work_.params.camera, tile.tile.x0 + corner.x,
                                        tile.tile.y0 + corner.y, record);
            }
            if (work_.kind == WorkKind::kShadow)
                return copy_shadow_rays(work_.shadows[first / kPacketSize], record);
        }
        for (std::size_t i = 0; i < kRays; ++i) copy_ray(record, i, work_.rays[first + i]);
    }

    void store(std::size_t first, const Record& record) {
        if constexpr (kAnyHit<Record>) {
            for (std::size_t i = 0; i < kRays; ++i) occluded_[first + i] = lane(record.tfar, i) < 0;
        } else {
            HitBlock<kRays>& block = hits_[first / kRays];
            std::memcpy(block.t, &record.ray.tfar, sizeof(block.t));
            std::memcpy(block.u, &record.hit.u, sizeof(block.u));
            std::memcpy(block.v, &record.hit.v, sizeof(block.v));
            std::memcpy(block.prim_id, &record.hit.primID, sizeof(block.prim_id));
        }
    }

    const TraceWork& work_;
    AlignedVector<HitBlock<kRays>> hits_;
    std::vector<std::uint8_t> occluded_;
};

struct EmbreePeers {
    const EmbreeScenes& scenes;
    const TraceWork& work;
    std::vector<Tracer> all = {};

    /// By records for any hits or for the closest ones; `suffix` is that of Embree's function.
    template <class AnyHits, class ClosestHits, std::size_t kMost = 1>
    void add(const std::string& suffix, bool one_ray = false) {
        if (work.any_hit()) {
            add_by<AnyHits, kMost>("Occluded" + suffix, one_ray);
        } else {
            add_by<ClosestHits, kMost>("Intersect" + suffix, one_ray);
        }
    }

    /// One for each scene; they have their answers in common.
    template <class Record, std::size_t kMost>
    void add_by(const std::string& function, bool one_ray) {
        const auto tracer = std::make_shared<RecordTracer<Record, kMost>>(work);
        for (const EmbreeScenes::Variant& variant : scenes.variants()) {
            const EmbreeScene& scene = variant.scene;
            all.push_back(
                {.name = fmt::format("{} {} {}", function, variant.robust ? "robust" : "fast",
                                     variant.name),
                 .group = fmt::format("embree {} {}", one_ray, variant.robust),
                 .at_once = one_ray ? RaysAtOnce::kOne : RaysAtOnce::kPacket,
                 .trace = [tracer, &scene](const WorkPart& part) { tracer->trace(scene, part); },
                 .answers = [tracer] { return tracer->answers(); }});
        }
    }
};

}  // namespace

AlignedVector<Hit> embree_hits(const EmbreeScene& scene, const TraceWork& work) {
    RecordTracer<RTCRayHit, 1> tracer(work);
    tracer.trace(scene, work.whole());
    return tracer.answers().hits;
}

std::vector<Tracer> embree_peers(const EmbreeScenes& scenes, const TraceWork& work) {
    EmbreePeers peers{scenes, work};
    peers.add<RTCRay, RTCRayHit>("1", true);
    if (work.kind == WorkKind::kOneRay) return peers.all;
    peers.add<RTCRay16, RTCRayHit16>("16");
    if (work.kind == WorkKind::kPrimary || work.kind == WorkKind::kShadow) return peers.all;
    peers.add<RTCRay, RTCRayHit>("1");
    peers.add<RTCRay4, RTCRayHit4>("4");
    peers.add<RTCRay8, RTCRayHit8>("8");
    if (kHasStreams) peers.add<RTCRay, RTCRayHit, 256>("1M");
    return peers.all;
}

}  // namespace mray::bench
