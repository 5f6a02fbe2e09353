// morphray trace: reads rays from a file and writes their hits to a file.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <string_view>

#include "app/backends/backends.h"
#include "app/base/library_calls.h"
#include "app/base/memory_budget.h"
#include "app/clip/clip_scene.h"
#include "app/clip/frames.h"
#include "app/commands/commands.h"
#include "app/files/ray_reader.h"
#include "app/terminal/interrupt.h"
#include "app/terminal/progress.h"
#include "common/base/output_file.h"
#include "common/scene/degenerate_count.h"
#include "common/text/message_text.h"

namespace mray::app {
namespace {

// Rays that are converted, traced and written together.
constexpr std::size_t kBatch = std::size_t{1} << 16;

/// Traces rays in batches and writes a line for each.
class RayTracer {
public:
    RayTracer(const SceneSpace& space, const morphray::Scene& scene)
        : space_(space), scene_(scene) {}

    /// The numbers of the ray are floats.
    void add(const WorldRay& ray) {
        if (!to_scene(space_, ray).valid) ++invalid_;
        // t may be beyond floats, and t of a ray whose direction is scaled to a length of about 1
        // is not. A power of two changes no other bit.
        const double largest =
            std::max({std::abs(ray.dir[0]), std::abs(ray.dir[1]), std::abs(ray.dir[2])});
        const int exponent = largest > 0 && std::isfinite(largest) ? std::ilogb(largest) : 0;
        const auto scaled = [](double v, int by) { return static_cast<float>(std::ldexp(v, by)); };
        rays_.push_back({{scaled(ray.org[0], 0), scaled(ray.org[1], 0), scaled(ray.org[2], 0)},
                         scaled(ray.tnear, exponent),
                         {scaled(ray.dir[0], -exponent), scaled(ray.dir[1], -exponent),
                          scaled(ray.dir[2], -exponent)},
                         scaled(ray.tfar, exponent)});
        exponents_.push_back(exponent);
        if (rays_.size() == kBatch) flush();
    }

    void flush() {
        throw_if_interrupted();
        hits_.resize(rays_.size());
        call_library([&] {
            scene_.intersect(std::span<const morphray::Ray>(rays_),
                             std::span<morphray::Hit>(hits_));
        });
        for (std::size_t i = 0; i < hits_.size(); ++i) write(hits_[i], exponents_[i]);
        total_ += rays_.size();
        rays_.clear();
        exponents_.clear();
    }

    const std::string& text() const { return text_; }
    std::uint64_t invalid() const { return invalid_; }
    std::uint64_t total() const { return total_; }

private:
    void write(const morphray::Hit& hit, int exponent) {
        if (!hit) {
            text_ += "M\n";
            return;
        }
        const double t = std::ldexp(static_cast<double>(hit.t), -exponent);
        fmt::format_to(std::back_inserter(text_), "H {:.9g} {} {:.9g} {:.9g}\n", t, hit.prim_id,
                       hit.u, hit.v);
    }

    const SceneSpace& space_;
    const morphray::Scene& scene_;
    std::vector<morphray::Ray> rays_;
    /// The power of two that each ray's direction was divided by.
    std::vector<int> exponents_;
    std::vector<morphray::Hit> hits_;
    std::string text_;
    std::uint64_t invalid_ = 0;
    std::uint64_t total_ = 0;
};

template <class Reader>
void trace_all(Reader reader, RayTracer& tracer, Progress& progress) {
    std::uint64_t traced = 0;
    for (WorldRay ray; reader.next(ray);) {
        tracer.add(ray);
        if (tracer.total() == traced) continue;
        traced = tracer.total();
        progress.update(reader.position());
    }
    tracer.flush();
    progress.finish();
}

/// The number of rays, or of the lines of a text.
std::uint64_t count_rays(const Options& options, std::string_view rays) {
    constexpr std::size_t kRayBytes = 32;
    if (options.binary_rays) return rays.size() / kRayBytes;
    const auto ends = static_cast<std::uint64_t>(std::ranges::count(rays, '\n'));
    return ends + (rays.empty() || rays.ends_with('\n') ? 0 : 1);
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
                    .devices = named_devices(options),
                    .kept_bytes = 2 * rays.size() + kBatch * 128},
                   options.scene);
    const double frame = select_frames(options, scene.clip(), DefaultFrames::kFirst).front();
    warn_of_damage(options, scene.clip(), {&frame, 1}, messages);
    const std::span<const vec3> positions = scene.positions(frame);
    if (const std::uint64_t bad = count_degenerate(topology, positions).not_finite) {
        messages.warn({shown(options.scene),
                       fmt::format("{} of {} triangles are not finite; they are never hit", bad,
                                   topology.triangles.size())});
    }
    std::vector<vec3> world(topology.vertex_count);
    scene.clip().positions(frame, world);
    const morphray::Device device = open_device(backend_of(options), messages);
    const morphray::Scene traced = call_library([&] {
        return morphray::Scene::build(
            mesh_of(topology, world), device,
            {.bounds = bounds_of(scene.clip()), .update = morphray::Refit{}});
    });

    const std::string name = options.ray_file == "-" ? "<stdin>" : options.ray_file;
    RayTracer tracer(scene.space(), traced);
    Progress progress("tracing", count_rays(options, rays), progress_mode(options));
    if (options.binary_rays) {
        trace_all(RayBinaryReader(name, rays), tracer, progress);
    } else {
        trace_all(RayTextReader(name, rays), tracer, progress);
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
