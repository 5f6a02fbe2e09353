#include "lab/accuracy/charts.h"

#include <fmt/format.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <atomic>

#include "common/base/errors.h"
#include "lab/methods/report.h"
#include "lab/methods/rules.h"
#ifdef MORPHRAY_EMBREE
#include "lab/methods/embree.h"
#endif

namespace mray::lab {
namespace {

/// The exact answers to the rays of a set, which it outlives as the space does.
class Judge {
public:
    Judge(const ExactReferee& referee, const RaySet& set)
        : referee_(referee), set_(set), truths_(set.rays.size()) {
        for_each_ray([&](std::size_t i) { truths_[i] = referee.closest(set.rays[i]); });
    }

    VerdictCounts count(std::span<const Hit> hits) const {
        std::array<std::atomic<std::uint64_t>, kVerdictCount> counts{};
        for_each_ray([&](std::size_t i) {
            const Verdict verdict = referee_.judge(set_.rays[i], truths_[i], hits[i].prim_id);
            ++counts[static_cast<std::size_t>(verdict)];
        });
        VerdictCounts result;
        result.rays = set_.active_count;
        std::copy(counts.begin(), counts.end(), result.of.begin());
        return result;
    }

private:
    template <class Visit>
    void for_each_ray(const Visit& visit) const {
        for_each_tile(set_, set_.whole(), [&](const TileRays& tile) {
            for (std::size_t i = tile.begin; i < tile.end; ++i)
                if (set_.active[i] != 0) visit(i);
        });
    }

    const ExactReferee& referee_;
    const RaySet& set_;
    std::vector<Truth> truths_;
};

struct SpaceJudges {
    SpaceJudges(const ChartScene& scene, const ChartSpace& space)
        : referee(scene.topology, space.positions, space.bvh),
          camera(referee, space.camera),
          aimed(referee, space.aimed) {}

    ExactReferee referee;
    Judge camera;
    Judge aimed;
};

ChartMethod single_method(const ChartScene& scene) {
    return {"single", &scene.scene_space, [&scene](const RaySet& set) {
                return stream_tracer(scene.scene_space.bvh, best_simd_target(), set);
            }};
}

/// By another rule or tracer over world space.
std::vector<ChartMethod> peer_methods(const ChartScene& scene) {
    const ChartSpace& space = scene.world_space;
    std::vector<ChartMethod> methods;
    const auto add_rule = [&](const char* name, const auto& trace) {
        methods.push_back({name, &space, [&space, trace](const RaySet& set) {
                               return stream_tracer(
                                   "", std::bind_front(trace, std::cref(space.bvh)), set);
                           }});
    };
    add_rule("rule: Moeller-Trumbore", trace_by_moeller_trumbore);
    add_rule("rule: Woop", trace_by_woop);
#ifdef MORPHRAY_EMBREE
    struct OwnScene {
        OwnScene(const ChartScene& chart, bool robust)
            : scene(device, chart.topology, chart.world_space.positions, RTC_BUILD_QUALITY_MEDIUM,
                    robust) {
            scene.commit();
        }
        EmbreeDevice device{0, ""};
        EmbreeScene scene;
    };
    for (const bool robust : {false, true}) {
        methods.push_back({robust ? "Embree robust" : "Embree fast", &space,
                           [own = std::make_shared<const OwnScene>(scene, robust)](
                               const RaySet& set) { return embree_tracer(own->scene, set); }});
    }
#endif
    return methods;
}

Table table_with(std::vector<std::string> header) {
    header.insert(header.end(), {"Mray/s", "leaks", "false misses", "false hits", "wrong triangles",
                                 "close", "displaced", "beside"});
    return Table(header);
}

void add_row(Table& table, std::vector<std::string> row, const Measured& measured) {
    const VerdictCounts both = measured.camera + measured.aimed;
    row.push_back(fmt::format("{:.4g}", measured.mrays));
    for (const Verdict verdict :
         {Verdict::kLeak, Verdict::kFalseMiss, Verdict::kFalseHit, Verdict::kWrongTriangle,
          Verdict::kClose, Verdict::kDisplaced, Verdict::kBeside})
        row.push_back(std::to_string(both[verdict]));
    table.add(row);
}

void add_counts(std::vector<std::string>& row, const VerdictCounts& counts) {
    row.push_back(std::to_string(counts.rays));
    row.push_back(std::to_string(counts.wrong()));
    row.push_back(fmt::format("{:.4g}", counts.wrong_per_million()));
}

plot::Panel panel_of(const std::string& title, const std::string& rays, std::uint64_t count) {
    const double one = 1e6 / static_cast<double>(std::max<std::uint64_t>(1, count));
    const int threads = tbb::this_task_arena::max_concurrency();
    return {{"kind", "points"},
            {"title", title},
            {"x", rays + " wrong/M"},
            {"y", "Mray/s"},
            {"series", "method"},
            {"xlabel", fmt::format("wrong answers per million rays (one ray: {:.2g})", one)},
            {"ylabel", fmt::format("Mray/s on {} thread{}", threads, threads == 1 ? "" : "s")},
            {"logx", "10"}};
}

/// "5 of 9 methods have no wrong answer; the fastest of them is packets with 102 Mray/s".
std::string sentence_of(const std::vector<Measured>& points) {
    const Measured* fastest = nullptr;
    std::size_t right = 0;
    for (const Measured& point : points) {
        if (point.camera.wrong() + point.aimed.wrong() > 0) continue;
        ++right;
        if (fastest == nullptr || point.mrays > fastest->mrays) fastest = &point;
    }
    if (right == 0) return fmt::format("each of {} methods has wrong answers", points.size());
    return fmt::format(
        "{} of {} methods have no wrong answer; the fastest of them is {} with {:.3g} Mray/s",
        right, points.size(), fastest->method, fastest->mrays);
}

std::vector<ChartMethod> with_peers(std::vector<ChartMethod> methods, const ChartScene& scene) {
    std::ranges::move(peer_methods(scene), std::back_inserter(methods));
    return methods;
}

}  // namespace

std::vector<ChartMethod> our_methods(const ChartScene& scene, const MakeBackend& make_vulkan) {
    const Bvh& bvh = scene.scene_space.bvh;
    const ChartSpace* const space = &scene.scene_space;
    std::vector<ChartMethod> methods = {
        {"scalar", space, [&bvh](const RaySet& set) { return reference_tracer(bvh, set); }},
        single_method(scene),
        {"packets", space, [&bvh](const RaySet& set) {
             const SimdTarget best = best_simd_target();
             if (set.kind != RayKind::kPrimary) return stream_tracer(bvh, best, set);
             return packet_tracer(bvh, best, set, cpu::PacketUse::kAlways);
         }}};
    std::shared_ptr<Backend> backend;
    try {
        backend = make_vulkan();
    } catch (const Error& error) {
        if (error.kind() != ErrorKind::kUnavailable) throw;
        return methods;
    }
    backend->set_scene(scene.topology, space->positions, bvh);
    methods.push_back({"Vulkan", space, [backend](const RaySet& set) {
                           const auto answers = std::make_shared<TraceAnswers>(set);
                           return Tracer{.name = "Vulkan",
                                         .trace =
                                             [backend, answers, &set](const TileRange&) {
                                                 backend->trace({set.rays, answers->hits});
                                             },
                                         .answers = [answers] { return *answers; }};
                       }});
    return methods;
}

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

std::vector<Measured> measure(const ChartScene& scene, std::span<const ChartMethod> methods,
                              int rounds) {
    const SpaceJudges in_scene_space(scene, scene.scene_space);
    const SpaceJudges in_world_space(scene, scene.world_space);
    std::vector<Tracer> camera;
    std::vector<Method> timed_methods;
    for (const ChartMethod& method : methods) camera.push_back(method.tracer(method.space->camera));
    for (std::size_t i = 0; i < methods.size(); ++i) {
        timed_methods.push_back(
            {methods[i].name, {}, [&, i](std::size_t) {
                 return timed([&] { camera[i].trace(methods[i].space->camera.whole()); });
             }});
    }
    const std::vector<Times> times = time_in_turn(timed_methods, 1, rounds);
    std::vector<Measured> all;
    for (std::size_t i = 0; i < methods.size(); ++i) {
        const ChartSpace& space = *methods[i].space;
        const SpaceJudges& judges = &space == &scene.scene_space ? in_scene_space : in_world_space;
        const TraceAnswers aimed = trace_all(methods[i].tracer(space.aimed), space.aimed);
        all.push_back({methods[i].name, judges.camera.count(camera[i].answers().hits),
                       judges.aimed.count(aimed.hits),
                       static_cast<double>(space.camera.rays.size()) / (1e3 * times[i].least_ms)});
    }
    return all;
}

Chart accuracy_chart(const ChartContext& context, const ChartInput& input,
                     const std::string& suffix) {
    const Effort& effort = context.effort;
    const ChartScene scene = make_chart_scene(input, effort.side, effort.aimed_rays);
    const std::vector<Measured> points = measure(
        scene, with_peers(our_methods(scene, context.make_vulkan_backend), scene), effort.rounds);
    Table table = table_with({"method", "camera rays", "camera wrong", "camera wrong/M",
                              "aimed rays", "aimed wrong", "aimed wrong/M"});
    for (const Measured& point : points) {
        std::vector<std::string> row = {point.method};
        for (const VerdictCounts& counts : {point.camera, point.aimed}) add_counts(row, counts);
        add_row(table, row, point);
    }
    const std::size_t pixels = scene.scene_space.camera.active_count;
    const std::size_t aimed = scene.scene_space.aimed.active_count;
    const plot::Figure figure{
        .title = fmt::format("Speed against accuracy on {} ({} triangles): {}", input.name,
                             input.topology.triangles.size(), sentence_of(points)),
        .footer = context.footer,
        .panel_height = 300,
        .panels = {
            panel_of(fmt::format("{} pixels of a camera", pixels), "camera", pixels),
            panel_of(fmt::format("{} rays at vertices, edges, faces", aimed), "aimed", aimed)}};
    return {"accuracy" + suffix, table, figure};
}

Chart failure_chart(const ChartContext& context, const std::vector<ChartInput>& more) {
    // The images have so many times fewer pixels a side.
    constexpr std::uint32_t kLessSide = 8;
    std::vector<ChartInput> inputs = failure_scenes();
    inputs.insert(inputs.end(), more.begin(), more.end());
    Table table = table_with({"scene", "method", "row", "column", "rays", "wrong", "wrong/M"});
    // The methods, and on how many scenes each is wrong.
    std::vector<std::pair<std::string, std::size_t>> failures;
    for (std::size_t row = 0; row < inputs.size(); ++row) {
        const ChartScene scene =
            make_chart_scene(inputs[row], std::max(kTileSize, context.effort.side / kLessSide),
                             context.effort.failure_rays);
        const std::vector<Measured> cells =
            measure(scene, with_peers({single_method(scene)}, scene), 1);
        for (std::size_t column = 0; column < cells.size(); ++column) {
            std::vector<std::string> text = {inputs[row].name, cells[column].method,
                                             std::to_string(row), std::to_string(column)};
            const VerdictCounts counts = cells[column].camera + cells[column].aimed;
            add_counts(text, counts);
            if (row == 0) failures.emplace_back(cells[column].method, 0);
            failures[column].second += counts.wrong() > 0;
            add_row(table, text, cells[column]);
        }
    }
    std::vector<std::string> never;
    std::vector<std::string> others;
    for (const auto& [method, scenes] : failures) {
        if (scenes == 0)
            never.push_back(method);
        else
            others.push_back(fmt::format("{} on {}", method, scenes));
    }
    const plot::Figure figure{
        .title =
            fmt::format("Wrong answers per million rays on {} scenes. Never wrong: {}. Wrong: {}",
                        inputs.size(), fmt::join(never, ", "), fmt::join(others, ", ")),
        .footer = context.footer,
        .panel_height = static_cast<int>(28 * inputs.size()),
        .panels = {{{"kind", "map"},
                    {"x", "column"},
                    {"y", "row"},
                    {"series", "scene"},
                    {"across", "method"},
                    {"shade", "wrong/M"}}}};
    return {"failures", table, figure};
}

}  // namespace mray::lab
