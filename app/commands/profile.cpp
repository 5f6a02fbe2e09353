// morphray profile: measures the stages of a frame.
#include "app/commands/profile.h"

#include <map>

#include "app/animation/animation_scene.h"
#include "app/animation/devices.h"
#include "app/animation/frames.h"
#include "library/src/engine.h"
#include "report/machine.h"
#include "report/shell.h"
#include "report/spread.h"
#include "report/table.h"

namespace mray::app {
namespace {

namespace engine = morphray::engine;

/// The caches are a small part of the time of a stage that takes longer.
constexpr double kLongMs = 50;

/// One instance refits a tree from the first frame on, a second one traces a tree built for each
/// frame. Stages run in turn, so that what disturbs the machine for a while disturbs all of them.
class StageProfiler {
public:
    /// Builds the first tree. Options and animation must outlive it.
    StageProfiler(const Options& options, const Animation& animation, double first_frame,
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
        Json row = {{"frame", frame}, {"backend", backend()}};
        double total_ms = 0;
        for (const std::string stage :
             {"deform", "upload", "refit", "decide", "restructure", "rebuild", "trace"}) {
            const double ms = samples.contains(stage) ? median(samples[stage]) : 0;
            row[stage + "_ms"] = ms;
            total_ms += ms;
        }
        row["total_ms"] = total_ms;
        row["trace_rebuilt_ms"] = median(samples["trace_rebuilt"]);
        row["rays"] = refits_.finish().rays;
        refits_.read_tree(tree_);
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

    const Options& options_;
    const Topology& topology_;
    morphray::View view_;
    AnimationScene scene_;
    Backend& refits_;
    std::unique_ptr<Backend> given_;
    Bvh tree_;
    Frame frame_;
};

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
    const auto number = [](double value) {
        return value < 10 ? fmt::format("{:.2g}", value) : fmt::format("{:.0f}", value);
    };
    std::vector<std::string> refits, ratios, traces;
    for (const Json& row : backends) {
        const auto ms = [&](const char* key) { return row[key].get<double>(); };
        const double update_ms = ms("upload_ms") + ms("refit_ms");
        refits.push_back(number(update_ms) + " ms on " + row["backend"].get<std::string>());
        ratios.push_back(number(ms("rebuild_ms") / (update_ms + 1e-9)));
        const double ratio = ms("trace_ms") / (ms("trace_rebuilt_ms") + 1e-9);
        const double percent = std::round(100 * (ratio - 1));
        traces.push_back(percent == 0 ? "as fast as a new one"
                                      : fmt::format("{} % {}", std::abs(percent),
                                                    percent > 0 ? "slower" : "faster"));
    }
    return fmt::format("refit {}; {} times as fast as a rebuild; the refitted tree traces {}",
                       fmt::join(refits, " and "), fmt::join(ratios, " and "),
                       fmt::join(traces, " and "));
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

Json profile_head(const Options& options, const Animation& animation,
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

std::string environment_text(const Json& report) {
    const Json& environment = report["environment"];
    std::string text = environment["machine"];
    for (const auto& [name, description] : environment["devices"].items())
        text += fmt::format("; {}: {}", name, description.get<std::string>());
    return fmt::format("{}; morphray {}", text, environment["version"].get<std::string>());
}

void add_environment(std::vector<std::string>& row, const Json& report,
                     const std::string& backend) {
    const Json& environment = report["environment"];
    row.insert(row.end(),
               {environment["machine"], environment["devices"][backend], environment["version"]});
}

ExitCode run_profile(const Options& given, const Messages& messages) {
    Options options = given;
    // An animation under several policies takes long.
    if (!options.repeat) options.repeat = options.policies.empty() ? 10 : 5;
    if (!options.policies.empty()) return profile_policies(options, messages);
    check_reports({options.json, options.csv});
    const std::unique_ptr<Animation> animation = open_animation(options.source, messages);
    const std::vector<double> frames = select_frames(options, *animation, DefaultFrames::kFew);
    const std::vector<morphray::Device> devices = open_devices(options.backend, messages);
    Json report = profile_head(options, *animation, devices);
    report["options"] = shell_line(options.arguments);
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
