// morphray crosscheck: compares the images of all backends, trees and instruction sets.
#include <algorithm>
#include <exception>
#include <optional>
#include <span>

#include "app/animation/frames.h"
#include "app/backends/backends.h"
#include "app/commands/commands.h"
#include "app/commands/crosscheck/cross_checker.h"
#include "app/report/crosscheck/check_report.h"
#include "app/terminal/failure.h"
#include "app/terminal/messages.h"

namespace mray::app {
namespace {

/// Whether the scenes that are left are not checked after such an error.
bool ends_run(ErrorKind kind) {
    return kind != ErrorKind::kBadInput && kind != ErrorKind::kBadArgument &&
           kind != ErrorKind::kLimit;
}

/// Returns the more serious code: a difference, then a scene that could not be opened, then a
/// missing part; a if both are equally serious.
ExitCode worse(ExitCode a, ExitCode b) {
    const auto rank = [](ExitCode code) {
        if (code == ExitCode::kOk) return 0;
        if (code == ExitCode::kPartial) return 1;
        return code == ExitCode::kCheckFailed ? 3 : 2;
    };
    return rank(b) > rank(a) ? b : a;
}

/// Checks the scenes in turn and writes one set of reports, also about a run that ends early.
class Crosscheck {
public:
    Crosscheck(const CrosscheckOptions& options, const Messages& messages)
        : options_(options), messages_(messages), report_(empty_report(options)) {
        if (options.backend.choice != BackendChoice::kVulkan)
            report_["environment"]["simd"] = simd_to_check(options.backend.simd);
    }

    /// Returns the exit code; throws what ends the run.
    ExitCode run() {
        ExitCode code = ExitCode::kOk;
        for (Json& scene : report_["scenes"]) code = worse(code, check(scene));
        report_["complete"] =
            std::all_of(report_["scenes"].begin(), report_["scenes"].end(),
                        [](const Json& scene) { return scene["complete"].get<bool>(); });
        return code;
    }

    void end_early(const std::string& error) { report_["error"] = error; }

    /// Writes all reports. Throws Error.
    void write_reports() const {
        if (!options_.json.empty()) write_report(options_.json, json_text(report_));
        if (!options_.junit.empty()) write_report(options_.junit, to_junit(report_));
        if (!options_.html.empty()) write_report(options_.html, to_html(report_));
        if (!takes_stdout({options_.json, options_.junit, options_.html}))
            messages_.print(run_text(report_));
    }

private:
    ExitCode check(Json& scene) {
        CrosscheckOptions one = options_;
        one.source.scene = scene["spec"];
        const std::size_t warned = messages_.warnings().size();
        const auto end = [&] {
            const std::span<const std::string> all = messages_.warnings();
            for (const std::string& warning : all.subspan(warned))
                scene["warnings"].push_back(warning);
            if (!scene["equal"]) report_["equal"] = false;
        };
        ExitCode code = ExitCode::kOk;
        try {
            code = check_scene(one, scene);
            scene["complete"] = code == ExitCode::kOk;
        } catch (const Error& error) {
            end();
            scene["error"] = message_of(error);
            if (options_.scenes.size() == 1 || ends_run(error.kind())) throw;
            messages_.error(error);
            return scene["equal"] ? exit_code_of(error.kind()) : ExitCode::kCheckFailed;
        }
        end();
        return scene["equal"] ? code : ExitCode::kCheckFailed;
    }

    /// Returns kPartial, after a message, if a frame after the first one cannot be read. Throws
    /// the errors of scenes, of the builder and of backends.
    ExitCode check_scene(const CrosscheckOptions& options, Json& report) {
        SceneFrames scene(open_animation(options.source, messages_));
        const Animation& animation = scene.animation();
        const Topology& topology = animation.topology();
        add_scene(report, {"", animation.name(), topology.triangles.size(), topology.vertex_count,
                           options.view.width, options.view.height});
        const std::vector<double> frames =
            select_frames(options.frames, std::nullopt, animation, DefaultFrames::kFew);
        report["frames"] = frames;
        if (!backends_) {
            for (const morphray::VulkanDeviceInfo& device : devices_to_check(options.backend))
                report_["environment"]["devices"].push_back(of(device));
            backends_ = make_checked_backends(options.backend, messages_);
        }
        std::optional<Progress> building(std::in_place, "building the tree", 0, messages_);
        CrossChecker checker(options, scene, *backends_, report);
        building.reset();
        Progress progress("comparing", frames.size() * checker.comparisons_of_frame(), messages_);
        for (const double frame : frames) {
            try {
                checker.check(frame, progress);
            } catch (const Error& error) {
                if (error.kind() != ErrorKind::kBadInput || report["rows"].empty()) throw;
                messages_.error(error);
                report["error"] = message_of(error);
                return ExitCode::kPartial;
            }
        }
        return ExitCode::kOk;
    }

    const CrosscheckOptions& options_;
    const Messages& messages_;
    Json report_;
    /// Made for the first scene.
    std::optional<CheckedBackends> backends_;
};

}  // namespace

ExitCode run_command(const CrosscheckOptions& options, const Messages& messages) {
    check_reports({options.json, options.junit, options.html});
    Crosscheck crosscheck(options, messages);
    ExitCode code = ExitCode::kOk;
    try {
        code = crosscheck.run();
    } catch (...) {
        const std::exception_ptr failure = std::current_exception();
        crosscheck.end_early(describe_failure(failure).message);
        try {
            crosscheck.write_reports();
        } catch (...) {
            // The failure above ends the run.
            messages.error(describe_failure(std::current_exception()));
        }
        throw;
    }
    crosscheck.write_reports();
    return code;
}

}  // namespace mray::app
