#include "lab/bench/embree/record_ways.h"

#include <array>
#include <cassert>
#include <limits>

#include "lab/bench/embree/embree_calls.h"
#include "lab/bench/embree/embree_records.h"

namespace mray::bench {
namespace {

/// Packets of N rays (1: single rays) with closest or any hit. Packets without an active ray are
/// left out.
template <int N, bool kAnyHit>
class PacketTracer : public EmbreeTracer {
protected:
    using Record = std::conditional_t<kAnyHit, typename EmbreeCalls<N>::RayRecord,
                                      typename EmbreeCalls<N>::HitRecord>;

public:
    explicit PacketTracer(const TraceWork& work) : work_(&work) {
        for (const TileRays& tile : work.tiles) {
            const std::size_t begin = records_.size();
            for (std::size_t first = tile.begin; first < tile.end; first += N) add_packet(first);
            ranges_.push_back({begin, records_.size()});
        }
    }

    void reset() override {
        for_each_range(work_->whole(), [&](std::size_t begin, std::size_t end) {
            for (std::size_t packet = begin; packet < end; ++packet) reset(packet);
        });
    }

    void trace(const EmbreeScene& scene, const WorkPart& part) override {
        for_each_range(part, [&](std::size_t begin, std::size_t end) {
            const FlushedDenormals flushed;
            embree::Query query(coherence_of(*work_));
            for (std::size_t i = begin; i < end; ++i) {
                call_embree<N, kAnyHit>(masks_[i].data(), scene.handle(), query, records_[i]);
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
    void for_each_range(const WorkPart& part, Visit visit) {
        tbb::parallel_for(part.first_tile, part.end_tile,
                          [&](std::size_t i) { visit(ranges_[i].begin, ranges_[i].end); });
    }

    std::vector<Record> records_;
    const TraceWork* work_;

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

    std::vector<Mask> masks_;
    std::vector<std::size_t> first_ray_;
    std::vector<Range> ranges_;
};

/// The rays of a tile as one stream.
template <bool kAnyHit>
class StreamTracer final : public PacketTracer<1, kAnyHit> {
public:
    using PacketTracer<1, kAnyHit>::PacketTracer;

    void trace(const EmbreeScene& scene, const WorkPart& part) override {
        this->for_each_range(part, [&](std::size_t begin, std::size_t end) {
            const FlushedDenormals flushed;
            embree::Query query(coherence_of(*this->work_));
            call_embree_stream<kAnyHit>(scene.handle(), query, this->records_.data() + begin,
                                        end - begin);
        });
    }
};

}  // namespace

template <int N>
std::unique_ptr<EmbreeTracer> trace_from_memory(const TraceWork& work) {
    if constexpr (N != kStream) {
        if (work.any_hit()) return std::make_unique<PacketTracer<N, true>>(work);
        return std::make_unique<PacketTracer<N, false>>(work);
    } else if constexpr (embree::kHasStreams) {
        if (work.any_hit()) return std::make_unique<StreamTracer<true>>(work);
        return std::make_unique<StreamTracer<false>>(work);
    } else {
        return nullptr;
    }
}

template std::unique_ptr<EmbreeTracer> trace_from_memory<kStream>(const TraceWork&);
template std::unique_ptr<EmbreeTracer> trace_from_memory<1>(const TraceWork&);
template std::unique_ptr<EmbreeTracer> trace_from_memory<4>(const TraceWork&);
template std::unique_ptr<EmbreeTracer> trace_from_memory<8>(const TraceWork&);
template std::unique_ptr<EmbreeTracer> trace_from_memory<16>(const TraceWork&);

}  // namespace mray::bench
