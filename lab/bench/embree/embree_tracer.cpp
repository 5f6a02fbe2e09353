// Compiled for the machine that builds it, so that rays are made and answers are stored in vectors.
#include <fmt/format.h>

#include <array>
#include <cstring>
#include <memory>

#include "lab/bench/embree/embree_peer.h"
#include "lab/bench/embree/embree_records.h"

namespace mray::bench {
namespace {

template <int N, bool kAnyHit>
using RecordOf = std::conditional_t<kAnyHit, typename EmbreeCalls<N>::RayRecord,
                                    typename EmbreeCalls<N>::HitRecord>;

template <class Record>
auto& ray_of(Record& record) {
    if constexpr (requires { record.ray; }) {
        return record.ray;
    } else {
        return record;
    }
}

/// Sets what no trace changes and what all rays share.
template <int N, class RayRecord>
void set_constants(RayRecord& record, const TraceWork& work) {
    for (std::size_t i = 0; i < N; ++i) {
        set_ray(record, i, {work.params.camera.org, 0, {0, 0, 1}, 0});
        if (work.kind != WorkKind::kShadow) continue;
        lane(record.org_x, i) = work.params.light.x;
        lane(record.org_y, i) = work.params.light.y;
        lane(record.org_z, i) = work.params.light.z;
    }
}

/// Sets mask[i] to -1 where ray i is active, else to 0; returns whether any is.
template <int N>
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
template <int N>
struct alignas(N == 1 ? 4 : 4 * N) HitBlock {
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

template <int N, bool kAnyHit>
class MadeTracer final : public EmbreeTracer {
public:
    explicit MadeTracer(const TraceWork& work) : work_(&work) {
        if (kAnyHit) {
            occluded_.resize(work.rays.size());
        } else {
            hits_.resize(work.rays.size() / N);
        }
    }

    void trace(const EmbreeScene& scene, const WorkPart& part) override {
        for_each_tile(*work_, part, [&](const TileRays& tile) {
            const FlushedDenormals flushed;
            embree::Query query(coherence_of(*work_));
            RecordOf<N, kAnyHit> record;
            set_constants<N>(ray_of(record), *work_);
            for (std::size_t first = tile.begin; first < tile.end; first += N) {
                alignas(4 * N) std::array<int, N> mask;
                if (!set_mask<N>(&work_->active[first], mask)) continue;
                make_rays(tile, first, ray_of(record));
                if constexpr (!kAnyHit) {
                    for (std::size_t i = 0; i < N; ++i) {
                        lane(record.hit.geomID, i) = RTC_INVALID_GEOMETRY_ID;
                        lane(record.hit.primID, i) = RTC_INVALID_GEOMETRY_ID;
                    }
                }
                call_embree<N, kAnyHit>(mask.data(), scene.handle(), query, record);
                store(first, record);
            }
        });
    }

    TraceAnswers answers() const override {
        TraceAnswers answers(*work_);
        for (std::size_t ray = 0; ray < work_->rays.size(); ++ray) {
            if constexpr (kAnyHit) {
                answers.occluded[ray] = occluded_[ray];
            } else {
                const HitBlock<N>& block = hits_[ray / N];
                const std::size_t i = ray % N;
                const bool missed = block.prim_id[i] == RTC_INVALID_GEOMETRY_ID;
                answers.hits[ray] =
                    missed ? no_hit() : Hit{block.t[i], block.u[i], block.v[i], block.prim_id[i]};
            }
        }
        return answers;
    }

private:
    template <class RayRecord>
    void make_rays(const TileRays& tile, std::size_t first, RayRecord& record) const {
        if constexpr (N == kPacketSize) {
            if (work_->kind == WorkKind::kPrimary) {
                const auto block = static_cast<std::uint32_t>((first - tile.begin) / kPacketSize);
                const BlockOffset corner = block_offset(block);
                return make_camera_rays(work_->params.camera, tile.tile.x0 + corner.x,
                                        tile.tile.y0 + corner.y, record);
            }
            if (work_->kind == WorkKind::kShadow)
                return copy_shadow_rays(work_->shadows[first / kPacketSize], record);
        }
        for (std::size_t i = 0; i < N; ++i) copy_ray(record, i, work_->rays[first + i]);
    }

    void store(std::size_t first, const RecordOf<N, kAnyHit>& record) {
        if constexpr (kAnyHit) {
            for (std::size_t i = 0; i < N; ++i)
                occluded_[first + i] = read_lane(record.tfar, i) < 0;
        } else {
            HitBlock<N>& block = hits_[first / N];
            std::memcpy(block.t, &record.ray.tfar, sizeof(block.t));
            std::memcpy(block.u, &record.hit.u, sizeof(block.u));
            std::memcpy(block.v, &record.hit.v, sizeof(block.v));
            std::memcpy(block.prim_id, &record.hit.primID, sizeof(block.prim_id));
        }
    }

    const TraceWork* work_;
    AlignedVector<HitBlock<N>> hits_;
    std::vector<std::uint8_t> occluded_;
};

/// Streams of up to kMost rays, whose records stay in the cache.
template <bool kAnyHit>
class MadeStreamTracer final : public EmbreeTracer {
public:
    explicit MadeStreamTracer(const TraceWork& work) : work_(&work), answers_(work) {}

    void trace(const EmbreeScene& scene, const WorkPart& part) override {
        for_each_tile(*work_, part, [&](const TileRays& tile) {
            const FlushedDenormals flushed;
            embree::Query query(coherence_of(*work_));
            std::array<RecordOf<1, kAnyHit>, kMost> records;
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

    void make(std::size_t ray, RecordOf<1, kAnyHit>& record) const {
        set_ray(ray_of(record), 0, work_->rays[ray]);
        if constexpr (!kAnyHit) record.hit.geomID = record.hit.primID = RTC_INVALID_GEOMETRY_ID;
    }

    void store(std::size_t ray, const RecordOf<1, kAnyHit>& record) {
        if constexpr (kAnyHit) {
            answers_.occluded[ray] = record.tfar < 0;
        } else if (record.hit.primID == RTC_INVALID_GEOMETRY_ID) {
            answers_.hits[ray] = no_hit();
        } else {
            answers_.hits[ray] = {record.ray.tfar, record.hit.u, record.hit.v, record.hit.primID};
        }
    }

    const TraceWork* work_;
    TraceAnswers answers_;
};

/// Stands for a stream of a tile's single rays where the rays of a packet are counted.
constexpr int kStream = 0;

/// Packets of N rays (1, 4, 8, 16 or kStream; 1: single rays). Null for a stream if Embree has
/// none.
template <int N>
std::unique_ptr<EmbreeTracer> make_tracer(const TraceWork& work) {
    if constexpr (N != kStream) {
        if (work.any_hit()) return std::make_unique<MadeTracer<N, true>>(work);
        return std::make_unique<MadeTracer<N, false>>(work);
    } else if constexpr (embree::kHasStreams) {
        if (work.any_hit()) return std::make_unique<MadeStreamTracer<true>>(work);
        return std::make_unique<MadeStreamTracer<false>>(work);
    } else {
        return nullptr;
    }
}

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
    std::vector<EmbreeWay> ways = {{name + "1", true, make_tracer<1>}};
    if (kind == WorkKind::kOneRay) return ways;
    ways.push_back({name + "16", false, make_tracer<16>});
    if (kind == WorkKind::kPrimary || kind == WorkKind::kShadow) return ways;
    ways.push_back({name + "1", false, make_tracer<1>});
    ways.push_back({name + "4", false, make_tracer<4>});
    ways.push_back({name + "8", false, make_tracer<8>});
    if (embree::kHasStreams) ways.push_back({name + "1M", false, make_tracer<kStream>});
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
    const std::unique_ptr<EmbreeTracer> tracer = make_tracer<1>(work);
    tracer->trace(scene, work.whole());
    return tracer->answers().hits;
}

std::vector<Peer> embree_peers(const EmbreeScenes& scenes, const TraceWork& work) {
    std::vector<Peer> peers;
    for (const EmbreeWay& way : embree_ways(work.kind)) {
        const std::shared_ptr<EmbreeTracer> tracer = way.make(work);
        for (const EmbreeScenes::Variant& variant : scenes.variants()) {
            const EmbreeScene& scene = variant.scene;
            peers.push_back(
                {.name = fmt::format("Embree {} {} ({})", way.name,
                                     variant.robust ? "robust" : "fast", variant.name),
                 .group = fmt::format("embree {} {}", way.one_ray, variant.robust),
                 .one_ray = way.one_ray,
                 .trace = [tracer, &scene](const WorkPart& part) { tracer->trace(scene, part); },
                 .answers = [tracer] { return tracer->answers(); }});
        }
    }
    return peers;
}

}  // namespace mray::bench
