// Compiled for the machine that builds it, so that rays are made and answers are stored in vectors.
#include <fmt/format.h>

#include <array>
#include <cstring>
#include <memory>

#include "lab/bench/embree/embree_peer.h"
#include "lab/bench/embree/embree_records.h"

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

/// How many rays a record has.
template <class Record>
inline constexpr std::size_t kLanesOf = sizeof(ray_of(std::declval<Record&>()).org_x) /
                                        sizeof(float);

/// Sets what no trace changes and what all rays share.
template <class RayRecord>
void set_constants(RayRecord& record, const TraceWork& work) {
    for (std::size_t i = 0; i < kLanesOf<RayRecord>; ++i) {
        set_ray(record, i, {work.params.camera.org, 0, {0, 0, 1}, 0});
        if (work.kind != WorkKind::kShadow) continue;
        lane(record.org_x, i) = work.params.light.x;
        lane(record.org_y, i) = work.params.light.y;
        lane(record.org_z, i) = work.params.light.z;
    }
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

/// The answers of N rays as Embree has them. t means nothing where prim_id is
/// RTC_INVALID_GEOMETRY_ID.
template <std::size_t N>
struct alignas(4 * N) HitBlock {
    float t[N];
    float u[N];
    float v[N];
    std::uint32_t prim_id[N];
};

/// A way to trace a work, which outlives it, as does the scene.
class EmbreeTracer {
public:
    virtual ~EmbreeTracer() = default;

    /// Finds t, u, v and primID of closest hits, or what is occluded, in the calling thread's
    /// arena.
    virtual void trace(const EmbreeScene& scene, const WorkPart& part) = 0;
    /// The answers of the last trace of each part.
    virtual TraceAnswers answers() const = 0;
};

template <class Record>
class MadeTracer final : public EmbreeTracer {
public:
    explicit MadeTracer(const TraceWork& work) : work_(&work) {
        if (kAnyHit<Record>) {
            occluded_.resize(work.rays.size());
        } else {
            hits_.resize(work.rays.size() / kRays);
        }
    }

    void trace(const EmbreeScene& scene, const WorkPart& part) override {
        for_each_tile(*work_, part, [&](const TileRays& tile) {
            const FlushedDenormals flushed;
            embree::Query query(coherence_of(*work_));
            Record record;
            set_constants(ray_of(record), *work_);
            for (std::size_t first = tile.begin; first < tile.end; first += kRays) {
                alignas(4 * kRays) std::array<int, kRays> mask;
                if (!set_mask<kRays>(&work_->active[first], mask)) continue;
                make_rays(tile, first, ray_of(record));
                if constexpr (!kAnyHit<Record>) {
                    for (std::size_t i = 0; i < kRays; ++i) clear_hit(record, i);
                }
                query.trace(scene.handle(), record, mask.data());
                store(first, record);
            }
        });
    }

    TraceAnswers answers() const override {
        TraceAnswers answers(*work_);
        for (std::size_t ray = 0; ray < work_->rays.size(); ++ray) {
            if constexpr (kAnyHit<Record>) {
                answers.occluded[ray] = occluded_[ray];
            } else {
                const HitBlock<kRays>& block = hits_[ray / kRays];
                const std::size_t i = ray % kRays;
                const bool missed = block.prim_id[i] == RTC_INVALID_GEOMETRY_ID;
                answers.hits[ray] =
                    missed ? no_hit() : Hit{block.t[i], block.u[i], block.v[i], block.prim_id[i]};
            }
        }
        return answers;
    }

private:
    static constexpr std::size_t kRays = kLanesOf<Record>;

    template <class RayRecord>
    void make_rays(const TileRays& tile, std::size_t first, RayRecord& record) const {
        if constexpr (kRays == kPacketSize) {
            if (work_->kind == WorkKind::kPrimary) {
                const auto block = static_cast<std::uint32_t>((first - tile.begin) / kPacketSize);
                const BlockOffset corner = block_offset(block);
                return make_camera_rays(work_->params.camera, tile.tile.x0 + corner.x,
                                        tile.tile.y0 + corner.y, record);
            }
            if (work_->kind == WorkKind::kShadow)
                return copy_shadow_rays(work_->shadows[first / kPacketSize], record);
        }
        for (std::size_t i = 0; i < kRays; ++i) copy_ray(record, i, work_->rays[first + i]);
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

    const TraceWork* work_;
    AlignedVector<HitBlock<kRays>> hits_;
    std::vector<std::uint8_t> occluded_;
};

/// Streams of up to kMost rays, whose records stay in the cache.
template <class Record>
class MadeStreamTracer final : public EmbreeTracer {
public:
    explicit MadeStreamTracer(const TraceWork& work) : work_(&work), answers_(work) {}

    void trace(const EmbreeScene& scene, const WorkPart& part) override {
        for_each_tile(*work_, part, [&](const TileRays& tile) {
            const FlushedDenormals flushed;
            embree::Query query(coherence_of(*work_));
            std::array<Record, kMost> records;
            for_each_active_run(*work_, tile, [&](std::size_t begin, std::size_t end) {
                for (std::size_t count = 0; begin < end; begin += count) {
                    count = std::min(kMost, end - begin);
                    for (std::size_t i = 0; i < count; ++i) make(begin + i, records[i]);
                    query.stream(scene.handle(), records.data(), count);
                    for (std::size_t i = 0; i < count; ++i) store(begin + i, records[i]);
                }
            });
        });
    }

    TraceAnswers answers() const override { return answers_; }

private:
    static constexpr std::size_t kMost = 256;

    void make(std::size_t ray, Record& record) const {
        set_ray(ray_of(record), 0, work_->rays[ray]);
        if constexpr (!kAnyHit<Record>) clear_hit(record, 0);
    }

    void store(std::size_t ray, const Record& record) {
        if constexpr (kAnyHit<Record>) {
            answers_.occluded[ray] = record.tfar < 0;
        } else {
            answers_.hits[ray] = hit_of(record, 0);
        }
    }

    const TraceWork* work_;
    TraceAnswers answers_;
};

/// For any hits or for the closest ones.
template <class AnyHits, class ClosestHits>
std::unique_ptr<EmbreeTracer> make_tracer(const TraceWork& work) {
    if (work.any_hit()) return std::make_unique<AnyHits>(work);
    return std::make_unique<ClosestHits>(work);
}

constexpr auto make_single = make_tracer<MadeTracer<RTCRay>, MadeTracer<RTCRayHit>>;
constexpr auto make_4 = make_tracer<MadeTracer<RTCRay4>, MadeTracer<RTCRayHit4>>;
constexpr auto make_8 = make_tracer<MadeTracer<RTCRay8>, MadeTracer<RTCRayHit8>>;
constexpr auto make_16 = make_tracer<MadeTracer<RTCRay16>, MadeTracer<RTCRayHit16>>;
constexpr auto make_stream = make_tracer<MadeStreamTracer<RTCRay>, MadeStreamTracer<RTCRayHit>>;

/// One of Embree's ways to trace a work.
struct EmbreeWay {
    /// "Intersect16"
    std::string name;
    /// One ray a call.
    bool one_ray;
    std::unique_ptr<EmbreeTracer> (*make)(const TraceWork&);
};

std::vector<EmbreeWay> embree_ways(WorkKind kind) {
    const bool any = kind == WorkKind::kShadow || kind == WorkKind::kAo;
    const std::string name = any ? "Occluded" : "Intersect";
    std::vector<EmbreeWay> ways = {{name + "1", true, make_single}};
    if (kind == WorkKind::kOneRay) return ways;
    ways.push_back({name + "16", false, make_16});
    if (kind == WorkKind::kPrimary || kind == WorkKind::kShadow) return ways;
    ways.push_back({name + "1", false, make_single});
    ways.push_back({name + "4", false, make_4});
    ways.push_back({name + "8", false, make_8});
    if (embree::kHasStreams) ways.push_back({name + "1M", false, make_stream});
    return ways;
}

}  // namespace

EmbreeScenes::EmbreeScenes(std::span<const EmbreeDevice> devices, const BenchScene& scene)
    : mesh_(scene.topology(), scene.positions) {
    for (const EmbreeDevice& device : devices) {
        const auto add = [&](EmbreeTree tree, const char* name) {
            for (const bool robust : {false, true}) {
                variants_.push_back({EmbreeScene(device, mesh_, tree, robust), robust,
                                     fmt::format("{}, {}", name, device.isa())});
            }
        };
        add(EmbreeTree::kMedium, "MEDIUM");
        add(EmbreeTree::kHigh, "HIGH");
    }
}

AlignedVector<Hit> embree_hits(const EmbreeScene& scene, const TraceWork& work) {
    const std::unique_ptr<EmbreeTracer> tracer = make_single(work);
    tracer->trace(scene, work.whole());
    return tracer->answers().hits;
}

std::vector<Tracer> embree_peers(const EmbreeScenes& scenes, const TraceWork& work) {
    std::vector<Tracer> peers;
    for (const EmbreeWay& way : embree_ways(work.kind)) {
        const std::shared_ptr<EmbreeTracer> tracer = way.make(work);
        for (const EmbreeScenes::Variant& variant : scenes.variants()) {
            const EmbreeScene& scene = variant.scene;
            peers.push_back(
                {.name = fmt::format("{} {}, {}", way.name, variant.robust ? "robust" : "fast",
                                     variant.name),
                 .group = fmt::format("embree {} {}", way.one_ray, variant.robust),
                 .at_once = way.one_ray ? RaysAtOnce::kOne : RaysAtOnce::kPacket,
                 .trace = [tracer, &scene](const WorkPart& part) { tracer->trace(scene, part); },
                 .answers = [tracer] { return tracer->answers(); }});
        }
    }
    return peers;
}

}  // namespace mray::bench
