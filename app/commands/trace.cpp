// morphray trace: reads rays from a file and writes their hits to a file.
#include "app/animation/animation_scene.h"
#include "app/base/ray_reader.h"
#include "app/commands/commands.h"
#include "library/src/engine.h"

namespace mray::app {
namespace {

/// Traces rays in batches and gathers their hits as lines.
class RayTracer {
public:
    RayTracer(const Options& options, const PosedAnimation& posed)
        : options_(options),
          scene_(posed.scene->scene()),
          origin_(posed.animation->origin()),
          space_(morphray::engine::space(scene_)) {}

    /// `excluded` has the size of `rays`, or is empty.
    void trace(std::span<const WorldRay> rays, std::span<const morphray::Primitive> excluded) {
        query_.excluded = excluded.empty() ? std::nullopt : std::optional(excluded);
        rays_.clear();
        exponents_.clear();
        for (WorldRay ray : rays) {
            ray.org = glm::dvec3(origin_.to_world(ray.org));
            if (!to_scene(space_, ray).valid && invalid_rays_++ == 0) first_invalid_ = ray_count_;
            add(ray);
            ++ray_count_;
        }
        call_library([&] { options_.all_hits ? trace_all() : trace_closest(); });
    }

    const std::string& text() const { return text_; }

    /// Warns of rays that hit nothing in any scene, and of hits that are left out.
    void warn(const Messages& messages) const {
        const std::string name = escape(input_name(options_.ray_file));
        if (invalid_rays_ > 0)
            messages.warn(
                {name, fmt::format("{} of {} rays (first: {}, counted from 0) hit nothing: not "
                                   "finite, without direction or interval, or leading past the "
                                   "scene from far away",
                                   invalid_rays_, ray_count_, first_invalid_)});
        if (cut_rays_ > 0)
            messages.warn(
                {name, fmt::format("{} of {} rays have more hits than --max-hits {}; {} hits are "
                                   "left out",
                                   cut_rays_, ray_count_, options_.hit_lists.max_hits, left_out_)});
    }

private:
    /// The numbers of the ray are floats.
    void add(const WorldRay& ray) {
        // t may be beyond floats unless the length is 1. A power of two keeps the bits.
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
    }

    void trace_closest() {
        hits_.resize(rays_.size());
        scene_.intersect(std::span<const morphray::Ray>(rays_), std::span<morphray::Hit>(hits_),
                         query_);
        for (std::size_t i = 0; i < hits_.size(); ++i)
            text_ += hits_[i] ? line_of(hits_[i], exponents_[i]) : "M\n";
    }

    void trace_all() {
        const morphray::AllHits all = scene_.intersect_all(rays_, options_.hit_lists, query_);
        for (std::size_t i = 0; i < rays_.size(); ++i) {
            const std::span<const morphray::Hit> hits = all.of_ray(i);
            fmt::format_to(std::back_inserter(text_), "R {} {}\n", hits.size(), all.left_out[i]);
            for (const morphray::Hit& hit : hits) text_ += line_of(hit, exponents_[i]);
            left_out_ += all.left_out[i];
            cut_rays_ += all.left_out[i] > 0;
        }
    }

    /// The t is that of the ray as it was given, which may be beyond floats.
    static std::string line_of(const morphray::Hit& hit, int exponent) {
        return fmt::format("H {:.9g} {} {:.9g} {:.9g}\n",
                           std::ldexp(static_cast<double>(hit.t), -exponent), hit.prim_id, hit.u,
                           hit.v);
    }

    const Options& options_;
    const morphray::Scene& scene_;
    Origin origin_;
    const SceneSpace& space_;
    morphray::QueryOptions query_{.coherence = morphray::Coherence::sort(),
                                  .cancel = &interrupt_flag()};
    std::vector<morphray::Ray> rays_;
    /// The power of two that each ray's direction was divided by.
    std::vector<int> exponents_;
    std::vector<morphray::Hit> hits_;
    std::string text_;
    std::uint64_t ray_count_ = 0;
    /// Rays that hit nothing in any scene.
    std::uint64_t invalid_rays_ = 0;
    std::uint64_t first_invalid_ = 0;
    /// The hits that are left out, and the rays that lack some.
    std::uint64_t left_out_ = 0;
    std::uint64_t cut_rays_ = 0;
};

}  // namespace

ExitCode run_trace(const Options& options, const Messages& messages) {
    check_reports({options.out});
    const RayFile file = read_rays(options.ray_file, options.binary_rays);
    const std::span rays(file.rays);
    const std::span excluded(file.excluded);
    const PosedAnimation posed = pose_animation(options, messages);
    const std::size_t triangles = posed.animation->topology().triangles.size();
    const auto unknown = std::ranges::find_if(excluded, [&](const morphray::Primitive& triangle) {
        return triangle != morphray::Primitive{} && triangle.prim_id >= triangles;
    });
    if (unknown != excluded.end())
        throw Error(ErrorKind::kBadInput,
                    "{}: ray {}, counted from 0, leaves out triangle {}, but there are {}; give "
                    "numbers of triangles as hits have them",
                    escape(input_name(options.ray_file)), unknown - excluded.begin(),
                    unknown->prim_id, triangles);
    RayTracer tracer(options, posed);
    in_batches("tracing", rays.size(), messages, [&](std::size_t first, std::size_t count) {
        tracer.trace(rays.subspan(first, count),
                     excluded.empty() ? excluded : excluded.subspan(first, count));
    });
    tracer.warn(messages);
    write_report(options.out, tracer.text());
    return ExitCode::kOk;
}

}  // namespace mray::app
