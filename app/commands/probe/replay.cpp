#include "app/commands/probe/replay.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <limits>

#include "app/backends/backends.h"
#include "app/commands/crosscheck/cross_checker.h"
#include "app/report/probe_report.h"
#include "common/bvh/box.h"
#include "common/bvh/builder/bvh_builder.h"
#include "common/interop/hit_rule.h"
#include "common/text/message_text.h"
#include "common/text/number_text.h"
#include "cpu/cpu_backend.h"
#include "tools/text/table.h"

namespace mray::app {
namespace {

// A scene of up to this many triangles is kept as a whole: half a megabyte of text.
constexpr std::size_t kSmallScene = 5000;

bool meets_own_box(const SlabRay& slab, const Topology& topology, std::span<const vec3> positions,
                   std::uint32_t prim_id) {
    const uvec3 corners = topology.triangles[prim_id];
    Box bounds;
    for (const std::uint32_t corner : {corners.x, corners.y, corners.z}) {
        if (!is_finite_vertex(positions[corner])) return false;
        bounds.extend(positions[corner]);
    }
    const Box box = padded(bounds);
    float t_least = 0;
    return hits_box(slab, box.lower, box.upper, t_least);
}

std::vector<std::uint32_t> triangles_to_keep(const ProbeReport& report, const Topology& topology,
                                             std::span<const vec3> positions, const Hit& brute) {
    const bool is_small = topology.triangles.size() <= kSmallScene;
    const SlabRay slab = slab_ray(report.ray.org, report.ray.dir);
    std::vector<std::uint32_t> kept;
    for (std::uint32_t id = 0; id < topology.triangles.size(); ++id) {
        const bool was_hit =
            id == report.image.prim_id || id == report.alone.prim_id || id == brute.prim_id;
        if (is_small || was_hit || meets_own_box(slab, topology, positions, id)) kept.push_back(id);
    }
    return kept;
}

/// An answer with its tracer.
struct Answer {
    std::string tracer;
    Hit hit;
};

bool same_bits(const Hit& a, const Hit& b) { return std::memcmp(&a, &b, sizeof(a)) == 0; }

/// Traces the bundle's ray with backends.
class Replay {
public:
    explicit Replay(const RayBundle& bundle, int threads)
        : bundle_(bundle),
          tree_(build_bvh(bundle.topology, bundle.positions, {.threads = threads})) {}

    /// Brute force traces no image, which would take long.
    void trace(const std::string& name, Backend& backend, bool image) {
        backend.set_scene(bundle_.topology, bundle_.positions, tree_);
        Hit hit = no_hit();
        backend.trace_rays({&bundle_.ray, 1}, {&hit, 1});
        answers_.push_back({name + ", alone", bundle_.in_scene(hit)});
        if (!image) return;
        Frame frame;
        backend.trace_image(bundle_.image, frame);
        const std::size_t pixel =
            std::size_t{bundle_.pixel.y} * bundle_.image.width + bundle_.pixel.x;
        answers_.push_back({name + ", in the image", bundle_.in_scene(frame.hits[pixel])});
    }

    const std::vector<Answer>& answers() const { return answers_; }

private:
    const RayBundle& bundle_;
    Bvh tree_;
    std::vector<Answer> answers_;
};

std::vector<Answer> trace_all(const Options& options, const RayBundle& bundle,
                              const Messages& messages) {
    Replay replay(bundle, options.backend.threads);
    BackendOptions one = options.backend;
    const BackendChoice choice = one.choice;
    replay.trace("brute", *make_backend(BackendChoice::kBrute, one, messages), false);
    if (choice == BackendChoice::kAuto || choice == BackendChoice::kCpu) {
        one.simd = kSimdOff;
        replay.trace("cpu", *make_backend(BackendChoice::kCpu, one, messages), true);
        for (const std::string& name : simd_to_check(options.backend.simd)) {
            one.simd = name;
            replay.trace(fmt::format("cpu {}", name),
                         *make_backend(BackendChoice::kCpu, one, messages), true);
        }
    }
    if (choice != BackendChoice::kAuto && choice != BackendChoice::kVulkan) return replay.answers();
    try {
        replay.trace("vulkan", *make_backend(BackendChoice::kVulkan, one, messages), true);
    } catch (const Error& error) {
        const bool wanted = choice == BackendChoice::kVulkan || asks_for_vulkan(options.backend);
        if (wanted || !is_lack_of_vulkan(error)) throw;
        messages.warn({{}, fmt::format("{}; left out", error.what())});
    }
    return replay.answers();
}

void add_answer(Table& table, const std::string& tracer, const Hit& hit, const Hit& expected) {
    const char* const verdict = same_bits(hit, expected) ? "equal" : "differs";
    if (hit.prim_id == kNoPrim) {
        table.add({tracer, "miss", "", "", "", verdict});
    } else {
        table.add({tracer, fmt::format("{}", hit.prim_id), hex_text(hit.t), hex_text(hit.u),
                   hex_text(hit.v), verdict});
    }
}

std::string text_of(const RayBundle& bundle, const std::vector<Answer>& answers) {
    std::string text = fmt::format("{}, frame {}, pixel {},{} of {}x{}: {} of {} triangles\n\n",
                                   shown(bundle.scene), bundle.frame, bundle.pixel.x,
                                   bundle.pixel.y, bundle.image.width, bundle.image.height,
                                   bundle.prim_ids.size(), bundle.scene_triangles);
    Table table({"answer", "prim", "t", "u", "v", "against brute"});
    add_answer(table, "recorded, brute", bundle.brute, bundle.brute);
    add_answer(table, "recorded, alone", bundle.alone, bundle.brute);
    add_answer(table, "recorded, in the image", bundle.in_image, bundle.brute);
    for (const Answer& answer : answers) add_answer(table, answer.tracer, answer.hit, bundle.brute);
    return text + table.text() + fmt::format("\nrecorded on {}\n", shown(bundle.traced_by));
}

std::string json_of(const RayBundle& bundle, const std::vector<Answer>& answers) {
    std::vector<ReplayReport::Answer> rows;
    for (const Answer& answer : answers)
        rows.push_back({answer.tracer, answer.hit, same_bits(answer.hit, bundle.brute)});
    return to_json(ReplayReport{bundle.scene, bundle.frame, bundle.brute, rows});
}

}  // namespace

RayBundle make_bundle(const ProbeReport& report, const ImageParams& params,
                      const Topology& topology, std::span<const vec3> positions) {
    RayBundle bundle;
    bundle.scene = report.head.scene;
    bundle.scene_triangles = topology.triangles.size();
    bundle.traced_by =
        fmt::format("{}, {}, tree: {}{}", report.backend, report.device, report.update,
                    report.refit_on.empty() ? "" : " on " + report.refit_on);
    bundle.frame = report.frame;
    bundle.pixel = report.pixel;
    bundle.image = params;
    bundle.ray = report.ray;
    bundle.in_image = report.image;
    bundle.alone = report.alone;
    if (!report.candidates.empty() && report.candidates.front().is_hit) {
        const Candidate& c = report.candidates.front();
        bundle.brute = {c.t, c.u, c.v, c.prim_id};
    }
    constexpr std::uint32_t kUnused = std::numeric_limits<std::uint32_t>::max();
    std::vector<std::uint32_t> place(positions.size(), kUnused);
    bundle.prim_ids = triangles_to_keep(report, topology, positions, bundle.brute);
    for (const std::uint32_t id : bundle.prim_ids) {
        uvec3 corners = topology.triangles[id];
        for (std::uint32_t* const corner : {&corners.x, &corners.y, &corners.z}) {
            std::uint32_t& at = place[*corner];
            if (at == kUnused) {
                at = static_cast<std::uint32_t>(bundle.positions.size());
                bundle.positions.push_back(positions[*corner]);
            }
            *corner = at;
        }
        bundle.topology.triangles.push_back(corners);
    }
    return bundle;
}

ExitCode run_replay(const Options& options, const Messages& messages) {
    const RayBundle bundle = read_bundle(options.scene);
    const std::vector<Answer> answers = trace_all(options, bundle, messages);
    if (!options.json.empty()) write_report(options.json, json_of(bundle, answers));
    if (!takes_stdout({options.json})) messages.print(text_of(bundle, answers));
    const bool equal = std::ranges::all_of(
        answers, [&](const Answer& answer) { return same_bits(answer.hit, bundle.brute); });
    return equal ? ExitCode::kOk : ExitCode::kCheckFailed;
}

}  // namespace mray::app
