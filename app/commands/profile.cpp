// morphray profile: measures the stages of a frame, or compares policies.
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>

#include "app/animation/animation_scene.h"
#include "app/animation/devices.h"
#include "app/animation/frames.h"
#include "app/commands/commands.h"
#include "app/report/json_parts.h"
#include "common/bvh/bvh.h"
#include "common/text/text.h"
#include "common/version.h"
#include "library/src/engine.h"
#include "report/machine.h"
#include "report/plot.h"
#include "report/shell.h"
#include "report/spread.h"
#include "report/table.h"

namespace mray::app {
namespace {

namespace engine = morphray::engine;

/// A time is taken for more than noise from this number of rounds on.
constexpr int kEnoughRounds = 5;

Json profile_head(const ProfileOptions& options, const Animation& animation,
                  const std::vector<morphray::Device>& devices) {
    Json json = head_of("profile", animation);
    json["width"] = options.view.width;
    json["height"] = options.view.height;
    json["rays"] = name_of_rays(options.view.rays);
    json["repeat"] = *options.repeat;
    Json described = Json::object();
    for (const morphray::Device& device : devices) described[device.name()] = device.description();
    json["environment"] = {
        {"machine", machine_name()}, {"version", kVersionDetail}, {"devices", described}};
    return json;
}

/// "AMD EPYC, ...; cpu: avx2, 2 threads; morphray 0.2.0 (1a2b3c4d)".
std::string environment_text(const Json& report) {
    const Json& environment = report["environment"];
    std::string text = environment["machine"];
    for (const auto& [name, description] : environment["devices"].items())
        text += fmt::format("; {}: {}", name, description.get<std::string>());
    return fmt::format("{}; morphray {}", text, environment["version"].get<std::string>());
}

constexpr const char* kEnvironmentColumns[] = {"machine", "device", "version"};
/// Adds the cells of a CSV row that say where it was measured.
void add_environment(std::vector<std::string>& row, const Json& report,
                     const std::string& backend) {
    const Json& environment = report["environment"];
    row.insert(row.end(),
               {environment["machine"], environment["devices"][backend], environment["version"]});
}

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
    /// For each frame, its median round by cost.
    std::vector<Played> frames = {};
};

double cost_of(const Played& frame) { return frame.times.total_ms() + frame.trace_ms; }

/// The median round of each frame by cost; its step and reason are those of the last round.
std::vector<Played> median_frames(const std::vector<std::vector<Played>>& rounds) {
    std::vector<Played> frames = rounds.back();
    for (std::size_t f = 0; f < frames.size(); ++f) {
        std::vector<Played> played;
        for (const std::vector<Played>& round : rounds) played.push_back(round[f]);
        std::ranges::sort(played, {}, cost_of);
        const Played& middle = played[(played.size() - 1) / 2];
        frames[f].times = middle.times;
        frames[f].trace_ms = middle.trace_ms;
    }
    return frames;
}

/// Makes one row of policies that took the same steps in every round, on one backend: with the
/// times of the first.
void merge_equal(std::vector<PolicyRun>& runs, std::size_t first) {
    const auto steps_of = [](const PolicyRun& run) {
        std::vector<morphray::Step> steps;
        for (const std::vector<Played>& round : run.rounds)
            for (const Played& frame : round) steps.push_back(frame.update.step);
        return steps;
    };
    for (std::size_t i = first; i < runs.size(); ++i) {
        const std::vector<morphray::Step> steps = steps_of(runs[i]);
        for (std::size_t k = i + 1; k < runs.size();) {
            if (steps_of(runs[k]) != steps) {
                ++k;
                continue;
            }
            runs[i].policy += ", " + runs[k].policy;
            runs.erase(runs.begin() + static_cast<std::ptrdiff_t>(k));
        }
    }
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
    engine::backend(scene.scene()).trace_image(engine::image_params(scene.scene(), view), first);
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

std::string fixed_ms(double value) { return fmt::format("{:.3f}", value); }

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
            const UpdateTimes& times = f.times;
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
    const auto range = [](const Json& row) -> const Json& { return row["total"]; };
    // The first whose range of rounds meets that of the best.
    const auto rival = std::find_if(rows.begin() + 1, rows.end(), [&](const Json& row) {
        return range(row)["least_ms"] <= range(rows[0])["most_ms"];
    });
    if (rival == rows.end())
        return fmt::format("quickest on {}: {}, then {}", backend, text_of_row(rows[0]),
                           text_of_row(rows[1]));
    const auto spread = [&](const Json& row) {
        return range(row)["most_ms"].get<double>() - range(row)["least_ms"].get<double>();
    };
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
        .title = policies_sentence(report),
        .footer = fmt::format("{}, {} triangles, {}x{} pixels, {} rays; medians of {} rounds, "
                              "bands between quartiles; "
                              "{}",
                              report["scene"].get<std::string>(), text("triangles"), text("width"),
                              text("height"), report["rays"].get<std::string>(), text("repeat"),
                              environment_text(report)),
        .panels = panels_of(runs)};
    return plot::draw(figure, frames_table(report, runs).csv(),
                      lower_case(file).ends_with(".png") ? "png" : "svg");
}

/// morphray profile --policies: compares update policies over an animation.
ExitCode profile_policies(const ProfileOptions& options, const Messages& messages) {
    if (!options.plot.empty()) {
        const std::string name = lower_case(options.plot);
        if (!name.ends_with(".svg") && !name.ends_with(".png"))
            throw Error(ErrorKind::kBadArgument, "--plot: {} ends neither in .svg nor in .png",
                        options.plot);
        if (*options.repeat < kEnoughRounds)
            throw Error(ErrorKind::kBadArgument,
                        "--plot: curves need at least {} rounds; give --repeat {} or more",
                        kEnoughRounds, kEnoughRounds);
        plot::require_matplotlib("--plot");
    }
    check_reports({options.json, options.csv, options.plot});
    const std::unique_ptr<Animation> animation = open_animation(options.source, messages);
    const std::vector<double> frames =
        select_frames(options.frames, options.tree.build_at, *animation, DefaultFrames::kAll);
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
            const std::size_t first = runs.size();
            for (const PolicySpec& policy : options.policies)
                runs.push_back({.policy = text_of(policy), .backend = name});
            // One animation after the other: a background build slows down its own policy alone.
            for (std::size_t i = 0; i < rounds * options.policies.size(); ++i) {
                const std::size_t p = i % options.policies.size();
                runs[first + p].rounds.push_back(play(options, options.policies[p], *animation,
                                                      frames, device, messages, begin_frame));
            }
            merge_equal(runs, first);
            double least = std::numeric_limits<double>::infinity();
            for (PolicyRun& run : std::span(runs).subspan(first)) {
                run.frames = median_frames(run.rounds);
                policies.push_back(policy_json(run));
                least = std::min(least, policies.back()["total_ms"].get<double>());
            }
            for (std::size_t i = first; i < policies.size() && least > 0; ++i)
                policies[i]["regret"] = policies[i]["total_ms"].get<double>() / least - 1;
        }
    }
    Json report = profile_head(options, *animation, devices);
    report["policies"] = policies;
    return write_reports(
        ExitCode::kOk, messages,
        {{options.json, [&] { return json_text(report); }},
         {options.csv, [&] { return frames_table(report, runs).csv(); }},
         {options.plot, [&] { return plot_policies(report, runs, options.plot); }}},
        [&] { return summary_of(report); });
}

/// The caches are a small part of the time of a stage that takes longer.
constexpr double kLongMs = 50;

/// One instance refits a tree from the first frame on, a second one traces a tree built for each
/// frame. Stages run in turn, so that what disturbs the machine for a while disturbs all of them.
class StageProfiler {
public:
    /// Builds the first tree. Options and animation must outlive it.
    StageProfiler(const ProfileOptions& options, const Animation& animation, double first_frame,
                  const morphray::Device& device, const Messages& messages)
        : options_(options),
          topology_(animation.topology()),
          view_(world_view(options.view, animation)),
          scene_(device, {.view = {}, .tree = options.tree}, animation, first_frame, messages),
          refits_(engine::backend(scene_.scene())),
          given_(engine::copy_on(device, scene_.scene())) {}

    std::string backend() const { return refits_.info().name; }

    /// Frames must come in order. Returns medians, and in "samples_ms" the times of all runs:
    /// "update" is upload and refit of each run, "trace_rebuilt" the trace of the rebuilt tree.
    Json measure(double frame) {
        std::map<std::string, std::vector<double>> samples;
        const std::span<const vec3> positions = engine::positions(scene_.scene());
        Bvh rebuilt;
        for (int round = 0; round < *options_.repeat; ++round) {
            const auto add = [&](std::vector<double>& of_stage,
                                 const std::function<double()>& stage_ms) {
                of_stage.push_back(run(stage_ms, round == 0));
            };
            add(samples["deform"], [&] { return scene_.deform(frame); });
            UpdateTimes update;
            add(samples["update"], [&] {
                refits_.refit(RefitExtent::kAll);
                update = refits_.finish().update;
                return update.upload_ms + update.refit_ms;
            });
            samples["upload"].push_back(update.upload_ms);
            samples["refit"].push_back(update.refit_ms);
            add(samples["rebuild"], [&] {
                const Stopwatch watch;
                rebuilt = build_bvh(topology_, positions, build_config(options_.backend));
                return watch.ms();
            });
            add(samples["trace"], [&] { return trace(refits_); });
            if (round == 0) given_->set_tree(rebuilt);
            add(samples["trace_rebuilt"], [&] { return trace(*given_); });
        }
        const FrameTimes times = {.deform_ms = median(samples["deform"]),
                                  .update = {.upload_ms = median(samples["upload"]),
                                             .refit_ms = median(samples["refit"]),
                                             .rebuild_ms = median(samples["rebuild"])},
                                  .trace_ms = median(samples["trace"]),
                                  .rays = refits_.finish().rays};
        refits_.read_tree(tree_);
        Json row = {{"frame", frame}, {"backend", backend()}};
        add_times(row, times);
        row["total_ms"] = times.total_ms();
        row["trace_rebuilt_ms"] = median(samples["trace_rebuilt"]);
        row["rays"] = times.rays;
        row["sah_cost"] = bvh_stats(tree_).sah_cost;
        row["rebuilt_sah_cost"] = bvh_stats(rebuilt).sah_cost;
        row["trace_spread_percent"] = spread_of(samples["trace"]).percent;
        row["samples_ms"] = samples;
        return row;
    }

private:
    /// The time of a run, after one to warm up in the first round, and for short stages in all.
    double run(const std::function<double()>& stage_ms, bool is_first_round) {
        const double first = stage_ms();
        return is_first_round || first < kLongMs ? stage_ms() : first;
    }

    double trace(Backend& backend) {
        backend.trace_image(engine::image_params(scene_.scene(), view_), frame_);
        return backend.finish().trace_ms;
    }

    const ProfileOptions& options_;
    const Topology& topology_;
    morphray::View view_;
    AnimationScene scene_;
    Backend& refits_;
    std::unique_ptr<Backend> given_;
    Bvh tree_;
    Frame frame_;
};

/// The given options that decide what is measured, apart from scene, frames, size and rays.
std::string measured_options(const ProfileOptions& options) {
    std::vector<std::string> line = arguments_of(options.source);
    std::vector<std::string> view = arguments_of(options.view, options.view.rays, false);
    // The size comes first.
    line.insert(line.end(), view.begin() + 2, view.end());
    const auto add = [&line](const char* name, const std::string& value) {
        if (!value.empty()) line.insert(line.end(), {name, value});
    };
    if (options.backend.threads > 0) add("--threads", fmt::format("{}", options.backend.threads));
    add("--simd", options.backend.simd);
    add("--device", options.backend.device);
    if (options.tree.build_at) add("--build-at", fmt::format("{}", *options.tree.build_at));
    if (options.backend.validate) line.emplace_back("--validate");
    return shell_line(line);
}

Json backends_of(const Json& frames) {
    Json backends = Json::array();
    for (const Json& first : frames) {
        if (!backends.empty() && backends.back()["backend"] == first["backend"]) continue;
        const auto median_of = [&](const std::function<double(const Json&)>& value) {
            std::vector<double> values;
            for (const Json& frame : frames)
                if (frame["backend"] == first["backend"]) values.push_back(value(frame));
            return median(values);
        };
        Json& row = backends.emplace_back(Json{{"backend", first["backend"]}});
        for (const char* key :
             {"deform_ms", "upload_ms", "refit_ms", "rebuild_ms", "trace_ms", "trace_rebuilt_ms",
              "rays", "sah_cost", "rebuilt_sah_cost", "trace_spread_percent"})
            row[key] = median_of([&](const Json& frame) { return frame[key].get<double>(); });
    }
    return backends;
}

/// "refit 0.09 ms on cpu; 60 times as fast as a rebuild; the refitted tree traces 4 % slower".
std::string sentence_of(const Json& backends) {
    const auto on_each = [&](const std::function<std::string(const Json&)>& text) {
        std::vector<std::string> parts;
        for (const Json& row : backends) parts.push_back(text(row));
        return fmt::format("{}", fmt::join(parts, " and "));
    };
    const auto number = [](double value) {
        return value < 10 ? fmt::format("{:.2g}", value) : fmt::format("{:.0f}", value);
    };
    const auto update_ms = [](const Json& row) {
        return row["upload_ms"].get<double>() + row["refit_ms"].get<double>();
    };
    return fmt::format(
        "refit {}; {} times as fast as a rebuild; the refitted tree traces {}",
        on_each([&](const Json& row) {
            return number(update_ms(row)) + " ms on " + row["backend"].get<std::string>();
        }),
        on_each([&](const Json& row) {
            return number(row["rebuild_ms"].get<double>() / (update_ms(row) + 1e-9));
        }),
        on_each([&](const Json& row) {
            const double ratio =
                row["trace_ms"].get<double>() / (row["trace_rebuilt_ms"].get<double>() + 1e-9);
            const double percent = std::round(100 * (ratio - 1));
            if (percent == 0) return std::string("as fast as a new one");
            return fmt::format("{} % {}", std::abs(percent), percent > 0 ? "slower" : "faster");
        }));
}

/// For people, or as CSV with units and where it was measured.
Table table_of(const Json& report, const Json& rows, bool is_csv) {
    std::vector<std::string> header = {"frame", "backend",   "deform", "update", "rebuild",
                                       "trace", "new trace", "spread", "Mray/s", "SAH"};
    if (is_csv) {
        for (std::size_t i = 2; i < 7; ++i) header[i] += " [ms]";
        header[7] = "spread of trace [%]";
        header[9] = "SAH ratio";
        header.emplace_back("runs");
        header.insert(header.end(), std::begin(kEnvironmentColumns), std::end(kEnvironmentColumns));
    }
    Table table(std::move(header));
    for (const Json& row : rows) {
        const auto number = [&](const char* key) { return row[key].get<double>(); };
        std::vector<std::string> cells = {
            row.contains("frame") ? fmt::format("{}", number("frame")) : "all",
            row["backend"],
            fixed_ms(number("deform_ms")),
            fixed_ms(number("upload_ms") + number("refit_ms")),
            fixed_ms(number("rebuild_ms")),
            fixed_ms(number("trace_ms")),
            fixed_ms(number("trace_rebuilt_ms")),
            fmt::format("{:.1f}", number("trace_spread_percent")),
            fmt::format("{:.1f}", number("rays") / (number("trace_ms") * 1e3 + 1e-9)),
            fmt::format("{:.3f}", number("sah_cost") / number("rebuilt_sah_cost"))};
        if (is_csv) {
            cells.push_back(report["repeat"].dump());
            add_environment(cells, report, row["backend"]);
        }
        table.add(std::move(cells));
    }
    return table;
}

}  // namespace

ExitCode run_command(const ProfileOptions& given, const Messages& messages) {
    ProfileOptions options = given;
    // An animation under several policies takes long.
    if (!options.repeat) options.repeat = options.policies.empty() ? 10 : 5;
    if (!options.policies.empty()) return profile_policies(options, messages);
    check_reports({options.json, options.csv});
    const std::unique_ptr<Animation> animation = open_animation(options.source, messages);
    const std::vector<double> frames =
        select_frames(options.frames, options.tree.build_at, *animation, DefaultFrames::kFew);
    const std::vector<morphray::Device> devices = open_devices(options.backend, messages);
    Json report = profile_head(options, *animation, devices);
    report["options"] = measured_options(options);
    report["frames"] = Json::array();
    {
        Progress progress("measuring", frames.size() * devices.size(), messages);
        for (const morphray::Device& device : devices) {
            progress.begin("tree");
            StageProfiler profiler(options, *animation, frames.front(), device, messages);
            for (const double frame : frames) {
                throw_if_interrupted();
                progress.begin(fmt::format("frame {} on {}", frame, profiler.backend()));
                report["frames"].push_back(profiler.measure(frame));
                progress.update(report["frames"].size());
            }
        }
    }
    const auto text = [&] {
        const Json backends = backends_of(report["frames"]);
        return fmt::format(
            "{}\n\n{}\n\nmedians of {} run{} and {} frame{} in ms; update: upload and refit; new\n"
            "trace: in the tree that a rebuild makes; spread: of traces, between quartiles,\n"
            "in %; SAH: estimated cost of a ray in the refitted tree over that in the new one\n{}",
            wrapped(sentence_of(backends)), wrapped(environment_text(report)), *options.repeat,
            *options.repeat == 1 ? "" : "s", frames.size(), frames.size() == 1 ? "" : "s",
            table_of(report, backends, false).text());
    };
    return write_reports(
        ExitCode::kOk, messages,
        {{options.json, [&] { return json_text(report); }},
         {options.csv, [&] { return table_of(report, report["frames"], true).csv(); }}},
        text);
}

}  // namespace mray::app
