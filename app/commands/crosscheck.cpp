// morphray crosscheck: compares the images of all backends, trees and instruction sets.
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
#include "common/text/text_parts.h"

namespace mray::app {
namespace {

/// Whether the scenes that are left are not checked after such an error.
bool ends_run(ErrorKind kind) {
    return kind != ErrorKind::kBadInput && kind != ErrorKind::kBadArgument &&
           kind != ErrorKind::kLimit;
}

/// Checks the scenes in turn and writes one set of reports, also about a run that ends early.
class Crosscheck {
public:
    Crosscheck(const CrosscheckOptions& options, const Messages& messages)
        : options_(options), messages_(messages), report_(empty_report(options)) {
        if (options.backend.choice != BackendChoice::kVulkan)
            report_["environment"]["simd"] = simd_to_check(options.backend.simd);
    }

    ExitCode run() {
        ExitCode code = ExitCode::kOk;
        try {
            for (Json& scene : report_["scenes"]) {
                const ExitCode one = check(scene);
                // A scene that could not be opened is worse than one with a missing part.
                if (code == ExitCode::kOk || (code == ExitCode::kPartial && one != ExitCode::kOk))
                    code = one;
            }
            conclude(report_, unfinished_);
            if (!report_["equal"]) code = ExitCode::kCheckFailed;
        } catch (...) {
            const Failure failure = describe_failure(std::current_exception());
            messages_.error(failure);
            code = failure.code;
            report_["error"] = failure.message;
            conclude(report_, unfinished_.empty() ? failure.message : unfinished_);
        }
        return code;
    }

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
        const auto add_warnings = [&] {
            const std::span<const std::string> all = messages_.warnings();
            for (const std::string& warning : all.subspan(warned))
                scene["warnings"].push_back(warning);
        };
        ExitCode code = ExitCode::kOk;
        try {
            code = check_scene(one, scene);
            scene["complete"] = code == ExitCode::kOk;
        } catch (const Error& error) {
            add_warnings();
            leave(scene, error);
            if (ends_run(error.kind())) throw;
            messages_.error(error);
            return exit_code_of(error.kind());
        }
        add_warnings();
        return code;
    }

    /// Returns kPartial, after a message, if a frame after the first one cannot be read.
    ExitCode check_scene(const CrosscheckOptions& options, Json& report) {
        SceneFrames scene(open_animation(options.source, messages_), warn_by(messages_));
        const Animation& animation = scene.animation();
        report["scene"] = animation.name();
        report["triangles"] = animation.topology().triangles.size();
        report["vertices"] = animation.topology().vertex_count;
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
        Progress progress("comparing", frames.size(), messages_);
        std::uint64_t done = 0;
        for (const double frame : frames) {
            try {
                checker.check(frame, progress);
                progress.update(++done);
            } catch (const Error& error) {
                if (error.kind() != ErrorKind::kBadInput || report["rows"].empty()) throw;
                messages_.error(error);
                leave(report, error);
                return ExitCode::kPartial;
            }
        }
        return ExitCode::kOk;
    }

    void leave(Json& scene, const Error& error) {
        scene["error"] = message_of(error);
        if (!unfinished_.empty()) return;
        unfinished_ = error.kind() == ErrorKind::kBadInput
                          ? escape(scene["spec"].get<std::string>()) + " could not be read"
                          : message_of(error);
    }

    const CrosscheckOptions& options_;
    const Messages& messages_;
    Json report_;
    /// Why the first scene that is not finished is not; empty if all are.
    std::string unfinished_;
    /// Made for the first scene.
    std::optional<CheckedBackends> backends_;
};

}  // namespace

ExitCode run_command(const CrosscheckOptions& options, const Messages& messages) {
    check_reports({options.json, options.junit, options.html});
    Crosscheck crosscheck(options, messages);
    const ExitCode code = crosscheck.run();
    crosscheck.write_reports();
    return code;
}

}  // namespace mray::app
