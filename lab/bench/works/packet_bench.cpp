#include <algorithm>

#include "common/base/thread_arena.h"
#include "lab/bench/works/packet_sweep.h"
#include "lab/bench/works/works.h"

namespace mray::bench {
namespace {

/// The methods on one target, the stream first.
std::vector<OurTracer> methods_on(const Bvh& bvh, const SimdTarget& target, WorkKind kind) {
    if (kind == WorkKind::kAo) return batches_of_each_size(bvh, target);
    std::vector<OurTracer> tracers = {ray_streams(bvh, target)};
    for (OurTracer& tracer : packets_of_each_shape(bvh, target)) {
        if (std::ranges::count(tracer.works, kind) != 0) tracers.push_back(std::move(tracer));
    }
    return tracers;
}

}  // namespace

void bench_packet(const Rig& rig, const BenchScene& scene, const TraceWork& work) {
    ThreadArena arena(rig.threads);
    for (const SimdTarget& target : rig.targets) {
        const std::vector<OurTracer> tracers = methods_on(scene.bvh, target, work.kind);
        std::vector<TraceAnswers> answers(tracers.size(), TraceAnswers(work));
        std::vector<Method> methods;
        for (std::size_t i = 0; i < tracers.size(); ++i) {
            methods.push_back({tracers[i].name, {}, [&, i] {
                                   arena.execute([&] { tracers[i].trace(work, answers[i]); });
                               }});
        }
        const std::vector<Samples> samples = time_interleaved(methods, rig.repeat);
        for (std::size_t i = 1; i < tracers.size(); ++i) {
            if (tracers[i].in_image_order && !work.any_hit()) to_ray_order(work, answers[i].hits);
            Row row = row_of(rig, scene, work, answers[0]);
            row.tracer = tracers[i].name;
            row.target = tracers[i].target;
            row.peer = tracers[0].name;
            row.mismatches = compare_answers(work, answers[i], answers[0]);
            set_times(row, times_of(samples[i]), times_of(samples[0]), Unit::kMrayPerSecond,
                      work.active_count);
            rig.report(row);
        }
    }
}

}  // namespace mray::bench
