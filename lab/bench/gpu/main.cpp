// morphray on a Vulkan device beside the peer on the same device: camera, shadow and diffuse rays,
// and a refit beside a copy of as many bytes. Scenes, --repeat, --size, and --csv are those
// of lab/bench/run. Mismatches are rays that hit another triangle than by the peer's rule.
#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "common/base/errors.h"
#include "common/base/output_file.h"
#include "common/base/stopwatch.h"
#include "common/report/shell.h"
#include "common/version.h"
#include "gpu/shared_device.h"
#include "lab/bench/bench_scene.h"
#include "lab/bench/gpu/peer_tracer.h"
#include "lab/bench/options.h"
#include "lab/bench/ours.h"
#include "lab/bench/report.h"
#include "lab/bench/trace_work.h"

namespace mray::bench {
namespace {

/// A way to do a work. Returns milliseconds on the device.
struct DeviceMethod {
    const char* name;
    std::function<double()> run;
};

/// The times of a method by both clocks.
struct Clocks {
    Samples device, wall;
};

/// Each once to warm up, then rounds of both in turn.
std::pair<Clocks, Clocks> time_both(const DeviceMethod& ours, const DeviceMethod& peer,
                                    int repeat) {
    std::pair<Clocks, Clocks> clocks;
    for (int round = -1; round < repeat; ++round) {
        for (const bool is_ours : {true, false}) {
            const Stopwatch watch;
            const double device_ms = (is_ours ? ours : peer).run();
            if (round < 0) continue;
            Clocks& c = is_ours ? clocks.first : clocks.second;
            c.device.push_back(device_ms);
            c.wall.push_back(watch.ms());
        }
    }
    return clocks;
}

class VulkanBench {
public:
    VulkanBench(const BenchScene& scene, int repeat, const std::function<void(const Row&)>& report)
        : scene_(scene),
          repeat_(repeat),
          report_(report),
          primary_(make_primary_work(scene.params)),
          tree_(build_peer_tree(scene.topology().triangles, scene.positions)),
          diffuse_(diffuse_rays()),
          shared_(gpu::open_device({})),
          ours_(gpu::make_vulkan_backend(shared_)),
          peer_(shared_, tree_, scene.params, diffuse_) {
        ours_->set_scene(scene.topology(), scene.positions, scene.bvh);
    }

    void run() {
        trace("primary", kRaysPrimary, kPeerCamera);
        trace("shadow", kRaysShadow, kPeerShadow);
        trace_diffuse();
        refit();
    }

private:
    std::vector<Ray> diffuse_rays() const {
        const AlignedVector<Hit> hits = reference_hits(scene_.bvh, primary_);
        const TraceWork work =
            make_secondary_work(primary_, hits, scene_.mesh(), WorkKind::kDiffuse);
        std::vector<Ray> rays;
        for (std::size_t i = 0; i < work.rays.size(); ++i)
            if (work.active[i] != 0) rays.push_back(work.rays[i]);
        return rays;
    }

    std::uint64_t pixels() const {
        return std::uint64_t{scene_.params.width} * scene_.params.height;
    }

    Row row(const std::string& work, const char* clock, const char* peer) const {
        Row row;
        row.scene = scene_.name;
        row.triangles = scene_.topology().triangles.size();
        row.view = name_of(scene_.view_kind);
        row.work = work;
        row.tracer = clock;
        row.target = "vulkan";
        row.peer = peer;
        return row;
    }

    void report(const std::string& work, const DeviceMethod& peer,
                const std::pair<Clocks, Clocks>& clocks, Unit unit, std::uint64_t count,
                std::uint64_t rays, std::uint64_t mismatches) const {
        for (const bool is_device : {true, false}) {
            Row result = row(work, is_device ? "device clock" : "wall clock", peer.name);
            result.rays = rays;
            result.mismatches.prim_id = mismatches;
            const auto& [ours, theirs] = clocks;
            const Samples& own = is_device ? ours.device : ours.wall;
            const Samples& other = is_device ? theirs.device : theirs.wall;
            set_times(result, times_of({&own, 1}), times_of({&other, 1}), unit, count);
            report_(result);
        }
    }

    void trace(const char* work, std::uint32_t rays, std::uint32_t mode) {
        ImageParams params = scene_.params;
        params.rays = rays;
        Frame frame;
        frame.with_pixels = false;
        frame.with_hits = false;
        const DeviceMethod ours = {"vulkan", [&] {
                                       ours_->trace_image(params, frame);
                                       const BackendTimes& t = ours_->finish();
                                       return rays == kRaysPrimary ? t.trace_ms : t.secondary_ms;
                                   }};
        const DeviceMethod peer = {"bvh2", [&] { return peer_.trace(mode); }};
        const auto clocks = time_both(ours, peer, repeat_);
        frame.with_hits = true;
        ours_->trace_image(params, frame);
        std::uint64_t mismatches = 0;
        if (mode == kPeerCamera) {
            const std::vector<Hit> theirs = peer_.hits(pixels());
            for (std::size_t i = 0; i < theirs.size(); ++i)
                mismatches += frame.hits[i].prim_id != theirs[i].prim_id;
        }
        const std::uint64_t ray_count =
            rays == kRaysPrimary ? pixels()
                                 : count_hits(frame) * rays_per_hit(rays, params.ao_count);
        report(work, peer, clocks, Unit::kMrayPerSecond, ray_count, ray_count, mismatches);
    }

    void trace_diffuse() {
        std::vector<Hit> hits(diffuse_.size());
        const DeviceMethod ours = {"vulkan", [&] {
                                       ours_->trace({diffuse_, hits});
                                       return ours_->finish().trace_ms;
                                   }};
        const DeviceMethod peer = {"bvh2", [&] { return peer_.trace(kPeerRays); }};
        const auto clocks = time_both(ours, peer, repeat_);
        const std::vector<Hit> theirs = peer_.hits(hits.size());
        std::uint64_t mismatches = 0;
        for (std::size_t i = 0; i < hits.size(); ++i)
            mismatches += hits[i].prim_id != theirs[i].prim_id;
        report("diffuse", peer, clocks, Unit::kMrayPerSecond, hits.size(), hits.size(), mismatches);
    }

    /// Bytes that a refit reads and writes, half of which a copy reads, and half of which it
    /// writes.
    std::uint64_t refit_bytes() const {
        const std::uint64_t leaves = scene_.bvh.leaves.size();
        const std::uint64_t nodes = scene_.bvh.nodes.size();
        constexpr std::uint64_t kBoxes = 16 * kQuarterVec4s;
        constexpr std::uint64_t kPlanes = 24;
        return sizeof(vec3) * scene_.positions.size() +
               leaves * (4 * kLeafVertices + 4 + 2 * 16 * kLeafVertices + kPlanes + kBoxes) +
               nodes * (sizeof(Node) - 64 + 4 + kPlanes + kBoxes);
    }

    std::span<const vec3> next_positions() {
        is_moved_ = !is_moved_;
        return is_moved_ ? scene_.moved : scene_.positions;
    }

    void refit() {
        const DeviceMethod ours = {"vulkan", [&] {
                                       ours_->refit(next_positions(), RefitExtent::kAll);
                                       return ours_->finish().update.refit_ms;
                                   }};
        const DeviceMethod peer = {"copy-of-its-bytes",
                                   [&] { return peer_.copy(refit_bytes() / 2); }};
        const std::uint64_t triangles = scene_.topology().triangles.size();
        report("refit", peer, time_both(ours, peer, repeat_), Unit::kNsPerTriangle, triangles, 0,
               0);
    }

    const BenchScene& scene_;
    int repeat_;
    const std::function<void(const Row&)>& report_;
    TraceWork primary_;
    PeerTree tree_;
    std::vector<Ray> diffuse_;
    std::shared_ptr<gpu::SharedDevice> shared_;
    std::unique_ptr<Backend> ours_;
    PeerTracer peer_;
    bool is_moved_ = false;
};

void run(const std::vector<std::string>& arguments) {
    const BenchOptions options = parse_options(arguments);
    if (!options.help.empty()) {
        fmt::print("{}", options.help);
        return;
    }
    const std::string head = fmt::format(
        "# {}, {}; morphray {}\n# morphray_gpu_bench {}\n", machine_name(),
        gpu::make_vulkan_backend()->info().description, kVersionDetail, shell_line(arguments));
    fmt::print("{}", head);
    std::vector<Row> rows;
    const auto report = [&](const Row& row) {
        rows.push_back(row);
        fmt::print("{}", table_line(row));
        std::fflush(stdout);
        if (!options.csv.empty()) write_file(options.csv, head + to_csv(rows));
    };
    for (const std::string& spec : options.scenes) {
        const BenchScene scene = open_bench_scene(spec, options.view_kind, options.view);
        fmt::print("{}", table_header());
        VulkanBench(scene, options.repeat, report).run();
    }
}

}  // namespace
}  // namespace mray::bench

int main(int argc, char** argv) {
    try {
        mray::bench::run(std::vector<std::string>(argv + 1, argv + argc));
        return 0;
    } catch (const std::exception& error) {
        fmt::print(stderr, "morphray_gpu_bench: {}\n", error.what());
        return 1;
    }
}
