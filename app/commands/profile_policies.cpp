// morphray profile --policies: compares update policies over an animation.
#include "app/animation/animation_scene.h"
#include "app/animation/devices.h"
#include "app/animation/frames.h"
#include "app/commands/profile.h"
#include "library/src/engine.h"
#include "report/spread.h"
#include "report/table.h"

namespace mray::app {
namespace {

namespace engine = morphray::engine;

/// A time is taken for more than noise from this number of rounds on.
constexpr int kEnoughRounds = 5;

struct Played {
    double frame = 0;
    /// Its times are 0 for the first build.
    morphray::Update update = {};
    double trace_ms = 0;
    std::uint64_t hits_hash = 0;
};

/// One policy on one backend. Its costs leave out the first build and deforming.
struct PolicyRun {
    std::string policy;
    std::string backend;
    std::vector<std::vector<Played>> rounds = {};
    std::vector<Played> frames = {};
};

double cost_of(const Played& frame) { return frame.update.milliseconds() + frame.trace_ms; }

/// The median round of each frame by cost; its step and reason are those of the last round.
std::vector<Played> median_frames(const std::vector<std::vector<Played>>& rounds) {
    std::vector<Played> frames = rounds.back();
    for (std::size_t f = 0; f < frames.size(); ++f) {
        std::vector<Played> played;
        for (const std::vector<Played>& round : rounds) played.push_back(round[f]);
        std::ranges::sort(played, {}, cost_of);
        Played& middle = played[(played.size() - 1) / 2];
        middle.update.step = frames[f].update.step;
        middle.update.reason = frames[f].update.reason;
        middle.update.cost_ratio = frames[f].update.cost_ratio;
        frames[f] = middle;
    }
    return frames;
}

std::vector<morphray::Step> steps_of(const PolicyRun& run) {
    std::vector<morphray::Step> steps;
    for (const std::vector<Played>& round : run.rounds)
        for (const Played& frame : round) steps.push_back(frame.update.step);
    return steps;
}

/// Makes one row of policies that took the same steps in every round: with the times of the first.
std::vector<PolicyRun> merge_equal(std::vector<PolicyRun> runs) {
    std::vector<PolicyRun> merged;
    for (PolicyRun& run : runs) {
        const auto equal = std::ranges::find(merged, steps_of(run), steps_of);
        if (equal == merged.end())
            merged.push_back(std::move(run));
        else
            equal->policy += ", " + run.policy;
    }
    return merged;
}

/// Plays the animation under one policy. Calls `on_frame` before each frame.
std::vector<Played> play(const Options& options, const PolicySpec& policy,
                         const Animation& animation, const std::vector<double>& frames,
                         const morphray::Device& device, const Messages& messages,
                         const std::function<void()>& on_frame) {
    morphray::View view = world_view(options.view, animation);
    view.cancel = &interrupt_flag();
    const TreeOptions tree = {policy, true, options.tree.build_at};
    AnimationScene scene(device, {.view = {}, .tree = tree}, animation, frames.front(), messages);
    // The first trace of a scene is slower than all others. The policy does not see this one.
    Frame first;
    engine::backend(scene.scene()).trace_image(engine::image_params(scene.scene(), view), first);
    morphray::Image image;
    std::vector<Played> played;
    for (const double number : frames) {
        scene.advance(number);
        on_frame();
        scene.render(view, image);
        morphray::Update update = scene.update();
        update.read_ms = 0;
        if (update.step == morphray::Step::build)
            update = {update.step, update.reason, update.cost_ratio};
        played.push_back({number, update, image.trace_ms, image.hits_hash});
    }
    return played;
}

Json policy_json(const PolicyRun& run) {
    const auto is_build = [](const Played& frame) {
        return frame.update.step == morphray::Step::rebuild ||
               frame.update.step == morphray::Step::swap;
    };
    std::vector<double> totals;
    for (const std::vector<Played>& round : run.rounds) {
        double& total = totals.emplace_back(0);
        for (const Played& frame : round) total += cost_of(frame);
    }
    Json hashes = Json::array();
    std::vector<double> costs;
    for (const Played& frame : run.frames) {
        hashes.push_back(hash_text(frame.hits_hash));
        costs.push_back(cost_of(frame));
    }
    return {
        {"policy", run.policy},
        {"backend", run.backend},
        {"total_ms", median(totals)},
        {"median_frame_ms", median(costs)},
        {"worst_frame_ms", std::ranges::max(costs)},
        // Set below: beyond the least total of all policies on the backend, relative to it.
        {"regret", 0.0},
        // The trees built after the first.
        {"rebuilds", std::ranges::count_if(run.frames, is_build)},
        {"total", {{"least_ms", std::ranges::min(totals)}, {"most_ms", std::ranges::max(totals)}}},
        {"hits_hashes", hashes}};
}

Table frames_table(const Json& report, const std::vector<PolicyRun>& runs) {
    std::vector<std::string> header = {
        "policy",         "backend",        "frame",          "update",          "upload ms",
        "refit ms",       "decide ms",      "restructure ms", "rebuild ms",      "trace ms",
        "cost ratio",     "hits hash",      "reason",         "median trace ms", "lower trace ms",
        "upper trace ms", "median cost ms", "lower cost ms",  "upper cost ms",   "rounds"};
    header.insert(header.end(), std::begin(kEnvironmentColumns), std::end(kEnvironmentColumns));
    Table table(std::move(header));
    for (const PolicyRun& run : runs) {
        for (std::size_t i = 0; i < run.frames.size(); ++i) {
            const Played& f = run.frames[i];
            const morphray::Update& times = f.update;
            std::vector<double> traces;
            std::vector<double> costs;
            for (const std::vector<Played>& round : run.rounds) {
                traces.push_back(round[i].trace_ms);
                costs.push_back(cost_of(round[i]));
            }
            std::vector<std::string> row = {run.policy, run.backend, fmt::format("{}", f.frame),
                                            to_string(f.update.step)};
            for (const double ms : {times.upload_ms, times.refit_ms, times.decide_ms,
                                    times.restructure_ms, times.rebuild_ms, f.trace_ms})
                row.push_back(fixed_ms(ms));
            row.insert(row.end(), {fmt::format("{:.4f}", f.update.cost_ratio),
                                   hash_text(f.hits_hash), f.update.reason});
            for (const Spread& spread : {spread_of(traces), spread_of(costs)})
                for (const double ms : {spread.median, spread.lower, spread.upper})
                    row.push_back(fixed_ms(ms));
            row.push_back(report["repeat"].dump());
            add_environment(row, report, run.backend);
            table.add(std::move(row));
        }
    }
    return table;
}

/// Says which of the policies on one backend was the quickest, by ascending total.
std::string finding_of(const std::vector<Json>& rows, int rounds) {
    const auto text_of_row = [](const Json& row) {
        return fmt::format("{} {:.2f} ms", row["policy"].get<std::string>(),
                           row["total_ms"].get<double>());
    };
    const std::string backend = rows[0]["backend"];
    if (rows.size() == 1) {
        const bool merged = rows[0]["policy"].get<std::string>().find(',') != std::string::npos;
        return fmt::format("{} on {}{}", text_of_row(rows[0]), backend,
                           merged ? ", by the same steps" : "");
    }
    if (rounds < kEnoughRounds)
        return fmt::format("too few rounds to name the quickest on {}: {}, {}", backend,
                           text_of_row(rows[0]), text_of_row(rows[1]));
    const auto least = [](const Json& row) { return row["total"]["least_ms"].get<double>(); };
    const auto most = [](const Json& row) { return row["total"]["most_ms"].get<double>(); };
    // The first whose range of rounds meets that of the best.
    const auto rival = std::find_if(rows.begin() + 1, rows.end(),
                                    [&](const Json& row) { return least(row) <= most(rows[0]); });
    if (rival == rows.end())
        return fmt::format("quickest on {}: {}, then {}", backend, text_of_row(rows[0]),
                           text_of_row(rows[1]));
    const auto spread = [&](const Json& row) { return most(row) - least(row); };
    return fmt::format("no difference found on {}: {} against {}, spread {:.2f} ms", backend,
                       text_of_row(rows[0]), text_of_row(*rival),
                       std::max(spread(rows[0]), spread(*rival)));
}

/// A policy is the quickest if all its rounds took less than all those of every other.
std::string policies_sentence(const Json& report) {
    std::map<std::string, std::vector<Json>> backends;
    for (const Json& row : report["policies"]) backends[row["backend"]].push_back(row);
    std::vector<std::string> findings;
    for (auto& [backend, rows] : backends) {
        std::ranges::stable_sort(rows, {},
                                 [](const Json& row) { return row["total_ms"].get<double>(); });
        findings.push_back(finding_of(rows, report["repeat"]));
    }
    return fmt::format("{}", fmt::join(findings, "; "));
}

std::string summary_of(const Json& report) {
    Table table(
        {"policy", "backend", "total", "least", "most", "median", "worst", "regret", "rebuilds"});
    for (const Json& run : report["policies"]) {
        const auto fixed = [](const Json& number, int digits, double scale = 1) {
            return fmt::format("{:.{}f}", scale * number.get<double>(), digits);
        };
        table.add({run["policy"], run["backend"], fixed(run["total_ms"], 2),
                   fixed(run["total"]["least_ms"], 2), fixed(run["total"]["most_ms"], 2),
                   fixed(run["median_frame_ms"], 2), fixed(run["worst_frame_ms"], 2),
                   fixed(run["regret"], 1, 100), run["rebuilds"].dump()});
    }
    const int repeat = report["repeat"];
    return fmt::format(
        "{}\n\n{}\n\ntimes in ms of {} round{}; total, least, most: of the rounds, the median\n"
        "first; median, worst: of a frame; regret: beyond the least total, in %\n{}",
        wrapped(policies_sentence(report)), wrapped(environment_text(report)), repeat,
        repeat == 1 ? "" : "s", table.text());
}

}  // namespace

ExitCode profile_policies(const Options& options, const Messages& messages) {
    check_reports({options.json, options.csv});
    const std::unique_ptr<Animation> animation = open_animation(options.source, messages);
    const std::vector<double> frames = select_frames(options, *animation, DefaultFrames::kAll);
    std::vector<PolicyRun> runs;
    Json policies = Json::array();
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
            std::vector<PolicyRun> here;
            for (const PolicySpec& policy : options.policies)
                here.push_back({.policy = text_of(policy), .backend = name});
            // One animation after the other: a background build slows down its own policy alone.
            for (std::size_t i = 0; i < rounds * here.size(); ++i) {
                const std::size_t p = i % here.size();
                here[p].rounds.push_back(play(options, options.policies[p], *animation, frames,
                                              device, messages, begin_frame));
            }
            here = merge_equal(std::move(here));
            Json rows = Json::array();
            double least = std::numeric_limits<double>::infinity();
            for (PolicyRun& run : here) {
                run.frames = median_frames(run.rounds);
                rows.push_back(policy_json(run));
                least = std::min(least, rows.back()["total_ms"].get<double>());
            }
            for (Json& row : rows) {
                if (least > 0) row["regret"] = row["total_ms"].get<double>() / least - 1;
                policies.push_back(row);
            }
            std::ranges::move(here, std::back_inserter(runs));
        }
    }
    Json report = profile_head(options, *animation, devices);
    report["policies"] = policies;
    return write_reports(ExitCode::kOk, messages,
                         {{options.json, [&] { return json_text(report); }},
                          {options.csv, [&] { return frames_table(report, runs).csv(); }}},
                         [&] { return summary_of(report); });
}

}  // namespace mray::app
