#include "bench/embree/embree_tracer.h"

#include <array>
#include <cassert>
#include <limits>

#include "bench/embree/embree_records.h"

namespace mray::bench {
namespace {

// Embree's records and calls by packet size. A single ray has no mask.
template <int N>
struct Api;
template <>
struct Api<1> {
    using RayRecord = RTCRay;
    using HitRecord = RTCRayHit;
    static void intersect(const int*, RTCScene scene, RTCIntersectContext* context, HitRecord* r) {
        rtcIntersect1(scene, context, r);
    }
    static void occluded(const int*, RTCScene scene, RTCIntersectContext* context, RayRecord* r) {
        rtcOccluded1(scene, context, r);
    }
};
template <>
struct Api<4> {
    using RayRecord = RTCRay4;
    using HitRecord = RTCRayHit4;
    static constexpr auto* occluded = rtcOccluded4;
};
template <>
struct Api<8> {
    using RayRecord = RTCRay8;
    using HitRecord = RTCRayHit8;
    static constexpr auto* occluded = rtcOccluded8;
};
template <>
struct Api<16> {
    using RayRecord = RTCRay16;
    using HitRecord = RTCRayHit16;
    static constexpr auto* intersect = rtcIntersect16;
    static constexpr auto* occluded = rtcOccluded16;
};

/// Packets of N rays (1: single rays) with closest or any hit. Packets without an active ray are
/// left out.
template <int N, bool kAnyHit>
class PacketTracer : public EmbreeTracer {
protected:
    using Record =
        std::conditional_t<kAnyHit, typename Api<N>::RayRecord, typename Api<N>::HitRecord>;

public:
    PacketTracer(const TraceWork& work, RTCIntersectContextFlags flags)
        : flags_(flags), work_(&work) {
        for (const TileRays& tile : work.tiles) {
            const std::size_t begin = records_.size();
            for (std::size_t first = tile.begin; first < tile.end; first += N) add_packet(first);
            ranges_.push_back({begin, records_.size()});
        }
    }

    void reset() override {
        for_each_range([&](std::size_t begin, std::size_t end) {
            for (std::size_t packet = begin; packet < end; ++packet) reset(packet);
        });
    }

    void trace(const EmbreeScene& scene) override {
        for_each_range([&](std::size_t begin, std::size_t end) {
            const FlushedDenormals flushed;
            RTCIntersectContext context = make_context(flags_);
            for (std::size_t i = begin; i < end; ++i) {
                if constexpr (kAnyHit) {
                    Api<N>::occluded(masks_[i].data(), scene.handle(), &context, &records_[i]);
                } else {
                    Api<N>::intersect(masks_[i].data(), scene.handle(), &context, &records_[i]);
                }
            }
        });
    }

    TraceAnswers answers() const override {
        TraceAnswers answers(*work_);
        for (Hit& hit : answers.hits) hit = no_hit();
        for (std::size_t packet = 0; packet < records_.size(); ++packet) {
            const Record& record = records_[packet];
            for (std::size_t i = 0; i < N; ++i) {
                const std::size_t ray = first_ray_[packet] + i;
                if constexpr (kAnyHit) {
                    answers.occluded[ray] = lane(record.tfar, i) < 0;
                } else if (lane(record.hit.geomID, i) != RTC_INVALID_GEOMETRY_ID) {
                    answers.hits[ray] = {lane(record.ray.tfar, i), lane(record.hit.u, i),
                                         lane(record.hit.v, i), lane(record.hit.primID, i)};
                }
            }
        }
        return answers;
    }

protected:
    /// visit(begin, end): the packets of each tile.
    template <class Visit>
    void for_each_range(Visit visit) {
        tbb::parallel_for(std::size_t{0}, ranges_.size(),
                          [&](std::size_t i) { visit(ranges_[i].begin, ranges_[i].end); });
    }

    std::vector<Record> records_;
    RTCIntersectContextFlags flags_;

private:
    struct Range {
        std::size_t begin, end;
    };
    struct alignas(N * 4) Mask : std::array<int, N> {};

    void add_packet(std::size_t first) {
        Record record{};
        Mask mask;
        bool any = false;
        for (std::size_t i = 0; i < N; ++i) {
            const Ray& ray = work_->rays[first + i];
            if constexpr (kAnyHit) {
                set_ray(record, i, ray);
            } else {
                set_ray(record.ray, i, ray);
            }
            const bool active = work_->active[first + i] != 0;
            mask[i] = active ? -1 : 0;
            any = any || active;
        }
        if (!any) return;
        records_.push_back(record);
        masks_.push_back(mask);
        first_ray_.push_back(first);
    }

    void reset(std::size_t packet) {
        Record& record = records_[packet];
        for (std::size_t i = 0; i < N; ++i) {
            const float tfar = work_->rays[first_ray_[packet] + i].tfar;
            if constexpr (kAnyHit) {
                lane(record.tfar, i) = tfar;
            } else {
                lane(record.ray.tfar, i) = tfar;
                lane(record.hit.geomID, i) = RTC_INVALID_GEOMETRY_ID;
            }
        }
    }

    const TraceWork* work_;
    std::vector<Mask> masks_;
    std::vector<std::size_t> first_ray_;
    std::vector<Range> ranges_;
};

/// The rays of a tile as one stream.
class OccludedStream final : public PacketTracer<1, true> {
public:
    using PacketTracer::PacketTracer;

    void trace(const EmbreeScene& scene) override {
        for_each_range([&](std::size_t begin, std::size_t end) {
            const FlushedDenormals flushed;
            RTCIntersectContext context = make_context(flags_);
            rtcOccluded1M(scene.handle(), &context, records_.data() + begin,
                          static_cast<unsigned int>(end - begin), sizeof(Record));
        });
    }
};

template <class Tracer>
EmbreeWay way(std::string name, int group, RTCIntersectContextFlags flags) {
    return {std::move(name), group,
            [flags](const TraceWork& work) { return std::make_unique<Tracer>(work, flags); }};
}

}  // namespace

std::vector<EmbreeWay> embree_ways(std::uint32_t rays) {
    constexpr auto kCoherent = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
    constexpr auto kIncoherent = RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
    if (rays == kRaysPrimary) {
        return {way<PacketTracer<16, false>>("Intersect16 coherent", 0, kCoherent),
                way<PacketTracer<1, false>>("Intersect1", 1, kCoherent)};
    }
    if (rays == kRaysShadow) {
        return {way<PacketTracer<16, true>>("Occluded16 coherent", 0, kCoherent),
                way<PacketTracer<1, true>>("Occluded1", 1, kCoherent)};
    }
    return {way<PacketTracer<1, true>>("Occluded1", 0, kIncoherent),
            way<PacketTracer<4, true>>("Occluded4", 0, kIncoherent),
            way<PacketTracer<8, true>>("Occluded8", 0, kIncoherent),
            way<PacketTracer<16, true>>("Occluded16", 0, kIncoherent),
            way<OccludedStream>("Occluded1M", 0, kIncoherent)};
}

}  // namespace mray::bench
