// morphray trace: reads rays from a file and writes their hits to a file.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string_view>

#include "app/base/library_calls.h"
#include "app/clip/posed_scene.h"
#include "app/commands/commands.h"
#include "app/files/ray_reader.h"
#include "app/report/answers.h"
#include "app/terminal/interrupt.h"
#include "app/terminal/progress.h"
#include "common/text/text_parts.h"

namespace mray::app {
namespace {

// Rays that are converted, traced and written together.
constexpr std::size_t kRaysOfBatch = std::size_t{1} << 16;

/// Traces rays in batches and gathers their hits.
class RayTracer {
public:
    RayTracer(const TraceOptions& options, const PosedScene& scene)
        : options_(options), scene_(scene), answers_(options.format, options.all_hits) {}

    /// The numbers of the ray are floats.
    void add(const WorldRay& ray) {
        if (!to_scene(scene_.space(), ray).valid) ++invalid_;
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
        if (rays_.size() == kRaysOfBatch) flush();
    }

    void flush() {
        throw_if_interrupted();
        call_library([&] { options_.all_hits ? add_all_hits() : add_closest_hits(); });
        rays_.clear();
        exponents_.clear();
    }

    const RayHits& answers() const { return answers_; }
    std::uint64_t invalid() const { return invalid_; }

private:
    void add_closest_hits() {
        hits_.resize(rays_.size());
        scene_.scene().intersect(std::span<const morphray::Ray>(rays_),
                                 std::span<morphray::Hit>(hits_), morphray::Coherence::sort(),
                                 &interrupt_flag());
        for (std::size_t i = 0; i < hits_.size(); ++i)
            answers_.add(std::span(&hits_[i], hits_[i] ? 1 : 0), exponents_[i]);
    }

    void add_all_hits() {
        const morphray::AllHits all = scene_.scene().intersect_all(rays_, options_.hit_lists);
        for (std::size_t i = 0; i < rays_.size(); ++i)
            answers_.add(all.of_ray(i), exponents_[i], all.left_out[i]);
    }

    const TraceOptions& options_;
    const PosedScene& scene_;
    std::vector<morphray::Ray> rays_;
    /// The power of two that each ray's direction was divided by.
    std::vector<int> exponents_;
    std::vector<morphray::Hit> hits_;
    RayHits answers_;
    std::uint64_t invalid_ = 0;
};

template <class Reader>
void trace_all(Reader reader, RayTracer& tracer, Progress& progress) {
    std::uint64_t traced = 0;
    for (WorldRay ray; reader.next(ray);) {
        tracer.add(ray);
        if (tracer.answers().ray_count() == traced) continue;
        traced = tracer.answers().ray_count();
        progress.update(reader.position());
    }
    tracer.flush();
}

/// The number of rays, or of the lines of a text.
std::uint64_t count_rays(const TraceOptions& options, std::string_view rays) {
    constexpr std::size_t kRayBytes = 32;
    return options.binary_rays ? rays.size() / kRayBytes : count_lines(rays);
}

}  // namespace

ExitCode run_trace(const TraceOptions& given, const Messages& messages) {
    TraceOptions options = given;
    options.hit_lists.cancel = &interrupt_flag();
    check_reports({options.out});
    const std::string rays = read_input(options.ray_file, "rays");
    const PosedScene scene(options.source, options.backend, options.frame, messages);
    const std::string name = input_name(options.ray_file);
    RayTracer tracer(options, scene);
    Progress progress("tracing", count_rays(options, rays), messages);
    if (options.binary_rays) {
        trace_all(RayBinaryReader(name, rays), tracer, progress);
    } else {
        trace_all(RayTextReader(name, rays), tracer, progress);
    }
    const RayHits& answers = tracer.answers();
    if (tracer.invalid() > 0) {
        messages.warn({escape(name),
                       fmt::format("{} of {} rays are not finite, have no direction or no length, "
                                   "or start too far away; they hit nothing",
                                   tracer.invalid(), answers.ray_count())});
    }
    if (answers.cut_rays() > 0) {
        messages.warn(
            {escape(name),
             fmt::format("{} of {} rays have more hits than --max-hits {}; {} hits are left out",
                         answers.cut_rays(), answers.ray_count(), options.hit_lists.max_hits,
                         answers.left_out())});
    }
    const Topology& topology = scene.topology();
    const ReportHead head{"trace", scene.name(), topology.triangles.size(), topology.vertex_count};
    write_report(options.out, answers.file(head, scene.frame(), options.hit_lists.crossing));
    return ExitCode::kOk;
}

}  // namespace mray::app
