#include "app/commands/profile/parts.h"

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <memory>
#include <numeric>
#include <set>

#include "app/animation/animation_scene.h"
#include "app/animation/frames.h"
#include "app/backends/backends.h"
#include "app/terminal/failure.h"
#include "app/terminal/messages.h"
#include "common/base/errors.h"
#include "common/report/plot.h"
#include "common/report/spread.h"
#include "common/report/table.h"
#include "common/text/text.h"
#include "library/src/engine.h"

namespace mray::app {
namespace {

struct Played {
    double frame = 0;
    morphray::Update update = {};
    UpdateTimes times = {};
    double trace_ms = 0;
    std::uint64_t hits_hash = 0;
};

/// One policy on one backend. Its costs leave out the first build and deforming.
struct PolicyRun {
    std::string policy;
    std::string backend;
    std::vector<std::vector<Played>> rounds = {};
    /// For each frame, its median round by cost; `total_ms` adds their costs up.
    std::vector<Played> frames = {};
    double total_ms = 0;
    /// total_ms beyond the least of all policies on the backend, relative to it.
    double regret = 0;

    Spread of_rounds(std::size_t frame, double (*value)(const Played&)) const {
        std::vector<double> values;
        for (const std::vector<Played>& round : rounds) values.push_back(value(round[frame]));
        return spread_of(values);
    }
};

double trace_of(const Played& frame) { return frame.trace_ms; }
double cost_of(const Played& frame) { return frame.times.total_ms() + frame.trace_ms; }

std::vector<double> costs_of(const std::vector<Played>& frames) {
    std::vector<double> costs;
    for (const Played& frame : frames) costs.push_back(cost_of(frame));
    return costs;
}

double total_of(const std::vector<Played>& frames) {
    const std::vector<double> costs = costs_of(frames);
    return std::accumulate(costs.begin(), costs.end(), 0.0);
}

void compare(std::span<PolicyRun> runs) {
    for (PolicyRun& run : runs) {
        run.frames = run.rounds.back();
        for (std::size_t f = 0; f < run.frames.size(); ++f) {
            std::vector<Played> played;
            for (const std::vector<Played>& round : run.rounds) played.push_back(round[f]);
            // The step and its reason are those of the last round.
            std::ranges::sort(played, {}, cost_of);
            const Played& middle = played[(played.size() - 1) / 2];
            run.frames[f].times = middle.times;
            run.frames[f].trace_ms = middle.trace_ms;
        }
        run.total_ms = total_of(run.frames);
    }
    const double least = std::ranges::min_element(runs, {}, &PolicyRun::total_ms)->total_ms;
    for (PolicyRun& run : runs)
        if (least > 0) run.regret = run.total_ms / least - 1;
}

/// Plays the animation under one policy. Calls `on_frame` before each frame.
std::vector<Played> play(const ProfileOptions& options, const PolicySpec& policy,
                         const Animation& animation, const std::vector<double>& frames,
                         const morphray::Device& device, const Messages& messages,
                         const std::function<void()>& on_frame) {
    morphray::View view = world_view(options.view, animation);
    view.cancel = &interrupt_flag();
    const TreeOptions tree = {policy, true, options.tree.build_at};
    AnimationScene scene(device, {.view = {}, .tree = tree}, animation, frames.front(), messages);
    // The first trace of a scene is slower than all others. The policy does not see this one.
    Frame first;
    morphray::engine::backend(scene.scene())
        .trace_image(morphray::engine::image_params(scene.scene(), view), first);
    morphray::Image image;
    std::vector<Played> played;
    for (const double number : frames) {
        scene.advance(number);
        on_frame();
        scene.render(view, image);
        const bool is_built = scene.update().step == morphray::Step::build;
        played.push_back({.frame = number,
                          .update = scene.update(),
                          .times = is_built ? UpdateTimes() : scene.times().update,
                          .trace_ms = image.trace_ms,
                          .hits_hash = image.hits_hash});
    }
    return played;
}

Json policy_json(const PolicyRun& run) {
    const auto is_build = [](const Played& frame) {
        return frame.update.step == morphray::Step::rebuild ||
               frame.update.step == morphray::Step::swap;
    };
    Json hashes = Json::array();
    for (const Played& frame : run.frames) hashes.push_back(hash_text(frame.hits_hash));
    const std::vector<double> costs = costs_of(run.frames);
    std::vector<double> totals;
    for (const std::vector<Played>& round : run.rounds) totals.push_back(total_of(round));
    const Spread total = spread_of(totals);
    return {{"policy", run.policy},
            {"backend", run.backend},
            {"total_ms", run.total_ms},
            {"median_frame_ms", median(costs)},
            {"worst_frame_ms", std::ranges::max(costs)},
            {"regret", run.regret},
            // The trees built after the first.
            {"rebuilds", std::ranges::count_if(run.frames, is_build)},
            {"total",
             {{"least_ms", total.least},
              {"median_ms", total.median},
              {"spread_percent", total.percent}}},
            {"hits_hashes", hashes}};
}

std::string fixed_ms(double value) { return fmt::format("{:.3f}", value); }

Table frames_table(const std::vector<PolicyRun>& runs) {
    Table table({"policy", "backend", "frame", "update", "upload ms", "refit ms", "decide ms",
                 "restructure ms", "rebuild ms", "trace ms", "cost ratio", "hits hash", "reason",
                 "median trace ms", "lower trace ms", "upper trace ms", "median cost ms",
                 "lower cost ms", "upper cost ms"});
    for (const PolicyRun& run : runs) {
        for (std::size_t i = 0; i < run.frames.size(); ++i) {
            const Played& f = run.frames[i];
            const UpdateTimes& times = f.times;
            const Spread trace = run.of_rounds(i, trace_of);
            const Spread cost = run.of_rounds(i, cost_of);
            table.add({run.policy, run.backend, fmt::format("{}", f.frame),
                       to_string(f.update.step), fixed_ms(times.upload_ms),
                       fixed_ms(times.refit_ms), fixed_ms(times.decide_ms),
                       fixed_ms(times.restructure_ms), fixed_ms(times.rebuild_ms),
                       fixed_ms(f.trace_ms), fmt::format("{:.4f}", f.update.cost_ratio),
                       hash_text(f.hits_hash), f.update.reason, fixed_ms(trace.median),
                       fixed_ms(trace.lower), fixed_ms(trace.upper), fixed_ms(cost.median),
                       fixed_ms(cost.lower), fixed_ms(cost.upper)});
        }
    }
    return table;
}

/// "quickest: auto on cpu with 9.01 ms, refit on vulkan with 290 ms".
std::string policies_sentence(const Json& policies) {
    std::string text;
    for (const Json& run : policies) {
        if (run["regret"] != 0) continue;
        text += fmt::format("{}{} on {} with {:.4g} ms", text.empty() ? "quickest: " : ", ",
                            run["policy"].get<std::string>(), run["backend"].get<std::string>(),
                            run["total_ms"].get<double>());
    }
    return text;
}

std::string summary_of(const Json& report) {
    Table table({"policy", "backend", "total", "spread", "median", "worst", "regret", "rebuilds"});
    for (const Json& run : report["policies"]) {
        const auto fixed = [](const Json& number, int digits, double scale = 1) {
            return fmt::format("{:.{}f}", scale * number.get<double>(), digits);
        };
        table.add({run["policy"], run["backend"], fixed(run["total_ms"], 2),
                   fixed(run["total"]["spread_percent"], 1), fixed(run["median_frame_ms"], 2),
                   fixed(run["worst_frame_ms"], 2), fixed(run["regret"], 1, 100),
                   run["rebuilds"].dump()});
    }
    const int repeat = report["repeat"];
    return fmt::format(
        "{}\n\ntimes in ms of {} round{}; total: the medians of its frames; spread: of the totals\n"
        "of rounds, in %; median, worst: of a frame; regret: beyond the least total, in %\n{}",
        policies_sentence(report["policies"]), repeat, repeat == 1 ? "" : "s", table.text());
}

std::vector<plot::Panel> panels_of(const std::vector<PolicyRun>& runs) {
    std::vector<plot::Panel> panels;
    std::set<std::string> backends;
    for (const PolicyRun& run : runs) {
        if (!backends.insert(run.backend).second) continue;
        const auto add = [&](const std::string& title, const char* y, const char* unit,
                             const char* lower, const char* upper) {
            panels.push_back({{"kind", "lines"},
                              {"title", title + ", " + run.backend},
                              {"x", "frame"},
                              {"y", y},
                              {"series", "policy"},
                              {"xlabel", "frame"},
                              {"ylabel", unit},
                              {"where", "backend"},
                              {"is", run.backend},
                              {"lower", lower},
                              {"upper", upper}});
        };
        add("trace", "median trace ms", "ms", "lower trace ms", "upper trace ms");
        add("quality of the tree", "cost ratio", "SAH cost / that at its build", "", "");
        add("update and trace", "median cost ms", "ms", "lower cost ms", "upper cost ms");
    }
    return panels;
}

std::string plot_policies(const Json& report, const std::vector<PolicyRun>& runs,
                          const std::string& file) {
    const auto text = [&](const char* key) { return report[key].dump(); };
    const plot::Figure figure{
        .title = policies_sentence(report["policies"]),
        .footer = fmt::format(
            "{}, {} triangles, {}x{} pixels, {} rays; {}", report["scene"].get<std::string>(),
            text("triangles"), text("width"), text("height"), report["rays"].get<std::string>(),
            report["repeat"] == 1
                ? "one round"
                : fmt::format("medians of {} rounds, bands between quartiles", text("repeat"))),
        .panels = panels_of(runs)};
    return plot::draw(figure, frames_table(runs).csv(),
                      lower_case(file).ends_with(".png") ? "png" : "svg");
}

void require_plotter(const std::string& file) {
    if (!lower_case(file).ends_with(".svg") && !lower_case(file).ends_with(".png")) {
        throw Error(ErrorKind::kBadArgument, "--plot: {} ends neither in .svg nor in .png", file);
    }
    plot::require_gnuplot("--plot");
}

}  // namespace

ExitCode profile_policies(const ProfileOptions& options, const Messages& messages) {
    check_reports({options.json, options.csv, options.plot});
    if (!options.plot.empty()) require_plotter(options.plot);
    const std::unique_ptr<Animation> animation = open_animation(options.source, messages);
    const std::vector<double> frames =
        select_frames(options.frames, options.tree.build_at, *animation, DefaultFrames::kAll);
    std::vector<PolicyRun> runs;
    const std::vector<morphray::Device> devices = open_devices(options.backend, messages);
    {
        const std::size_t rounds = static_cast<std::size_t>(*options.repeat);
        Progress progress("measuring",
                          frames.size() * rounds * options.policies.size() * devices.size(),
                          messages);
        std::uint64_t done = 0;
        for (const morphray::Device& device : devices) {
            const std::string& name = device.name();
            const auto begin_frame = [&] {
                throw_if_interrupted();
                progress.update(done++);
                progress.begin(name);
            };
            const std::size_t first = runs.size();
            for (const PolicySpec& policy : options.policies)
                runs.push_back({.policy = text_of(policy), .backend = name});
            // One animation after the other: a background build slows down its own policy alone.
            for (std::size_t i = 0; i < rounds * options.policies.size(); ++i) {
                const std::size_t p = i % options.policies.size();
                runs[first + p].rounds.push_back(play(options, options.policies[p], *animation,
                                                      frames, device, messages, begin_frame));
            }
            compare(std::span(runs).subspan(first));
        }
    }
    Json report = profile_head(options, *animation);
    report["policies"] = Json::array();
    for (const PolicyRun& run : runs) report["policies"].push_back(policy_json(run));
    return write_reports(
        ExitCode::kOk, messages,
        {{options.json, [&] { return json_text(report); }},
         {options.csv, [&] { return frames_table(runs).csv(); }},
         {options.plot, [&] { return plot_policies(report, runs, options.plot); }}},
        [&] { return summary_of(report); });
}

}  // namespace mray::app
