#include "lab/accuracy/charts/charts.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <mutex>

#include "common/frame_times.h"

namespace mray::accuracy {
namespace {

template <class Visit>
void for_each_batch(std::size_t count, Visit visit) {
    tbb::parallel_for(std::size_t{0}, (count + kChartTile - 1) / kChartTile, [&](std::size_t i) {
        visit(i * kChartTile, std::min(count, (i + 1) * kChartTile));
    });
}

void trace_rays(const Method& method, std::span<const Ray> rays, std::span<Hit> hits) {
    if (method.alone) {
        method.trace(rays, hits);
        return;
    }
    for_each_batch(rays.size(), [&](std::size_t begin, std::size_t end) {
        method.trace(rays.subspan(begin, end - begin), hits.subspan(begin, end - begin));
    });
}

void trace_camera(const Method& method, const ChartScene& scene, std::span<Hit> hits) {
    if (!method.trace_tile) {
        trace_rays(method, method.space(scene).camera_rays, hits);
        return;
    }
    for_each_batch(hits.size(), [&](std::size_t begin, std::size_t end) {
        method.trace_tile(begin / kChartTile, hits.subspan(begin, end - begin));
    });
}

/// The exact answers to rays of a scene in one of its spaces; all outlive it.
class Judge {
public:
    Judge(const ChartScene& scene, const ChartSpace& space, const std::vector<Ray>& rays)
        : rays_(rays), referee_(scene.topology, space.positions, space.bvh), truths_(rays.size()) {
        for_each_batch(rays.size(), [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i) truths_[i] = referee_.closest(rays[i]);
        });
    }

    VerdictCounts count(std::span<const Hit> hits) const {
        VerdictCounts counts;
        counts.rays = rays_.size();
        std::mutex mutex;
        for_each_batch(rays_.size(), [&](std::size_t begin, std::size_t end) {
            VerdictCounts batch;
            for (std::size_t i = begin; i < end; ++i) {
                const Verdict verdict = referee_.judge(rays_[i], truths_[i], hits[i].prim_id);
                ++batch.of[static_cast<std::size_t>(verdict)];
            }
            const std::lock_guard lock(mutex);
            counts = counts + batch;
        });
        return counts;
    }

private:
    const std::vector<Ray>& rays_;
    ExactReferee referee_;
    std::vector<Truth> truths_;
};

struct Judges {
    Judges(const ChartScene& scene, const ChartSpace& space)
        : camera(scene, space, space.camera_rays), aimed(scene, space, space.aimed_rays) {}

    Judge camera;
    Judge aimed;
};

}  // namespace

std::uint64_t VerdictCounts::wrong() const {
    std::uint64_t sum = 0;
    for (std::size_t i = 0; i < kVerdictCount; ++i) {
        if (is_wrong(static_cast<Verdict>(i))) sum += of[i];
    }
    return sum;
}

double VerdictCounts::wrong_per_million() const {
    return rays == 0 ? 0 : 1e6 * static_cast<double>(wrong()) / static_cast<double>(rays);
}

VerdictCounts VerdictCounts::operator+(const VerdictCounts& other) const {
    VerdictCounts sum = *this;
    for (std::size_t i = 0; i < kVerdictCount; ++i) sum.of[i] += other.of[i];
    sum.rays += other.rays;
    return sum;
}

std::vector<Measured> measure(const ChartScene& scene, std::span<const Method> methods,
                              int rounds) {
    const Judges in_scene_space(scene, scene.scene_space);
    const Judges in_world_space(scene, scene.world_space);
    std::vector<Hit> hits(scene.scene_space.camera_rays.size());
    std::vector<Hit> aimed(scene.scene_space.aimed_rays.size());
    std::vector<Measured> all;
    for (const Method& method : methods) {
        const Judges& judges = method.in_scene_space ? in_scene_space : in_world_space;
        Measured& one = all.emplace_back();
        one.method = method.name;
        trace_camera(method, scene, hits);
        one.camera = judges.camera.count(hits);
        trace_rays(method, method.space(scene).aimed_rays, aimed);
        one.aimed = judges.aimed.count(aimed);
    }
    for (int round = 0; round < rounds; ++round) {
        for (std::size_t i = 0; i < methods.size(); ++i) {
            const Stopwatch watch;
            trace_camera(methods[i], scene, hits);
            all[i].mrays =
                std::max(all[i].mrays, static_cast<double>(hits.size()) / (1e3 * watch.ms()));
        }
    }
    return all;
}

}  // namespace mray::accuracy
