// morphray trace: reads rays from a file and writes their hits to a file.
#include <fmt/format.h>

#include <cmath>
#include <iterator>

#include "app/backends.h"
#include "app/commands/commands.h"
#include "app/files/ray_reader.h"
#include "app/frames.h"
#include "app/memory_budget.h"
#include "app/terminal/interrupt.h"
#include "common/base/output_file.h"
#include "common/bvh/bvh_stats.h"
#include "common/text/message_text.h"

namespace mray::app {
namespace {

// Rays that are converted, traced and written together.
constexpr std::size_t kBatch = std::size_t{1} << 16;

/// Traces rays in batches and writes a line for each.
class RayTracer {
public:
    RayTracer(const SceneSpace& space, Backend& backend) : space_(space), backend_(backend) {}

    void add(const WorldRay& ray) {
        const SceneRay scene_ray = to_scene(space_, ray);
        if (scene_ray.valid) {
            rays_.push_back(scene_ray.ray);
        } else {
            ++invalid_;
        }
        batch_.push_back({scene_ray.valid, scene_ray.t_exponent});
        if (batch_.size() == kBatch) flush();
    }

    void flush() {
        throw_if_interrupted();
        hits_.resize(rays_.size());
        if (!rays_.empty()) backend_.trace_rays(rays_, hits_);
        auto hit = hits_.begin();
        for (const Answered& ray : batch_) write(ray.valid ? *hit++ : no_hit(), ray.t_exponent);
        total_ += batch_.size();
        batch_.clear();
        rays_.clear();
    }

    const std::string& text() const { return text_; }
    std::uint64_t invalid() const { return invalid_; }
    std::uint64_t total() const { return total_; }

private:
    struct Answered {
        bool valid;
        int t_exponent;
    };

    void write(const Hit& hit, int t_exponent) {
        if (hit.prim_id == kNoPrim) {
            text_ += "M\n";
            return;
        }
        const double t = std::ldexp(static_cast<double>(hit.t), t_exponent);
        fmt::format_to(std::back_inserter(text_), "H {:.9g} {} {:.9g} {:.9g}\n", t, hit.prim_id,
                       hit.u, hit.v);
    }

    const SceneSpace& space_;
    Backend& backend_;
    std::vector<Ray> rays_;
    std::vector<Hit> hits_;
    std::vector<Answered> batch_;
    std::string text_;
    std::uint64_t invalid_ = 0;
    std::uint64_t total_ = 0;
};

template <class Reader>
void trace_all(Reader reader, RayTracer& tracer) {
    for (WorldRay ray; reader.next(ray);) tracer.add(ray);
    tracer.flush();
}

// Rays from a file come in any order, for which the CPU is fast. A device is used if --backend,
// --device or --validate asks for one.
BackendOptions backend_of(const Options& options) {
    BackendOptions backend = options.backend;
    const bool device = !backend.device.empty() || backend.validate;
    if (!backend.choice_given && !device) backend.choice = BackendChoice::kCpu;
    return backend;
}

}  // namespace

ExitCode run_trace(const Options& given, const Messages& messages) {
    Options options = given;
    options.lenient = true;
    check_reports({options.out});
    const std::string rays = read_rays(options.ray_file);
    SceneFrames scene = open_frames(options, messages);
    const Topology& topology = scene.clip().topology();
    require_memory({.triangles = topology.triangles.size(),
                    .vertices = topology.vertex_count,
                    .kept_bytes = 2 * rays.size() + kBatch * 128});
    const double frame = select_frames(options, scene.clip(), DefaultFrames::kFirst).front();
    warn_of_damage(options, scene.clip(), {&frame, 1}, messages);
    const std::span<const vec3> positions = scene.positions(frame);
    if (const std::uint64_t bad = count_degenerate(topology, positions).not_finite) {
        messages.warn({shown(options.scene),
                       fmt::format("{} of {} triangles are not finite; they are never hit", bad,
                                   topology.triangles.size())});
    }
    const std::unique_ptr<Backend> backend = make_backend(backend_of(options), messages);
    backend->set_scene(topology, positions,
                       build_bvh(topology, positions, {.threads = options.backend.threads}));

    const std::string name = options.ray_file == "-" ? "<stdin>" : options.ray_file;
    RayTracer tracer(scene.space(), *backend);
    if (options.binary_rays) {
        trace_all(RayBinaryReader(name, rays), tracer);
    } else {
        trace_all(RayTextReader(name, rays), tracer);
    }
    if (tracer.invalid() > 0) {
        messages.warn({shown(name),
                       fmt::format("{} of {} rays are not finite, have no direction or no length, "
                                   "or start too far away; they hit nothing",
                                   tracer.invalid(), tracer.total())});
    }
    write_report(options.out, tracer.text());
    return ExitCode::kOk;
}

}  // namespace mray::app
