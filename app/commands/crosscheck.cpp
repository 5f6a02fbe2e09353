// morphray crosscheck: compares the images of all backends, trees and instruction sets.
#include <fmt/format.h>

#include <exception>
#include <optional>

#include "app/backends/backends.h"
#include "app/clip/frames.h"
#include "app/commands/commands.h"
#include "app/commands/crosscheck/cross_checker.h"
#include "app/report/crosscheck/check_report.h"
#include "app/terminal/failure.h"
#include "app/terminal/progress.h"
#include "common/report/shell.h"

namespace mray::app {
namespace {

std::string command_text(const CrosscheckOptions& options) {
    std::vector<std::string> line = {"morphray"};
    line.insert(line.end(), options.arguments.begin(), options.arguments.end());
    return shell_line(line);
}

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
        : options_(options), messages_(messages) {
        run_.environment.command = command_text(options);
        run_.environment.simd = options.backend.choice == BackendChoice::kVulkan
                                    ? std::vector<std::string>{}
                                    : simd_to_check(options.backend.simd);
        // Then a report about a run that cannot begin names its scenes, too.
        for (const std::string& scene : options.scenes) {
            CheckReport& report = run_.scenes.emplace_back();
            report.spec = scene;
            report.complete = false;
            report.head.command = "crosscheck";
            report.head.scene = scene;
            report.head.width = options.view.width;
            report.head.height = options.view.height;
        }
    }

    /// Returns the exit code; throws what ends the run.
    ExitCode run() {
        ExitCode code = ExitCode::kOk;
        for (CheckReport& report : run_.scenes) code = worse(code, check(report));
        return code;
    }

    void end_early(const std::string& error) { run_.error = error; }

    /// Writes all reports. Throws Error.
    void write_reports() const {
        if (!options_.json.empty()) write_report(options_.json, to_json(run_));
        if (!options_.junit.empty()) write_report(options_.junit, to_junit(run_));
        if (!options_.html.empty()) write_report(options_.html, to_html(options_, run_));
        if (!takes_stdout({options_.json, options_.junit, options_.html}))
            messages_.print(run_text(options_, run_));
    }

private:
    ExitCode check(CheckReport& report) {
        CrosscheckOptions one = options_;
        one.source.scene = report.spec;
        const std::size_t warned = messages_.warnings().size();
        const auto keep_warnings = [&] {
            const std::vector<std::string>& all = messages_.warnings();
            report.warnings.assign(all.begin() + static_cast<std::ptrdiff_t>(warned), all.end());
        };
        ExitCode code = ExitCode::kOk;
        try {
            code = check_scene(one, report);
            report.complete = code == ExitCode::kOk;
        } catch (const Error& error) {
            keep_warnings();
            report.error = message_of(error);
            if (run_.scenes.size() == 1 || ends_run(error.kind())) throw;
            messages_.error(error);
            code = exit_code_of(error.kind());
        }
        keep_warnings();
        return report.equal() ? code : ExitCode::kCheckFailed;
    }

    /// Returns kPartial, after a message, if a frame after the first one cannot be read. Throws
    /// the errors of scenes, of the builder and of backends.
    ExitCode check_scene(const CrosscheckOptions& options, CheckReport& report) {
        SceneFrames scene(open_clip(options.source, messages_));
        const Clip& clip = scene.clip();
        const Topology& topology = clip.topology();
        report.head = {"crosscheck",          clip.name(),        topology.triangles.size(),
                       topology.vertex_count, options.view.width, options.view.height};
        report.frames = select_frames(options.frames, std::nullopt, clip, DefaultFrames::kFew);
        if (!backends_) {
            run_.environment.devices = devices_to_check(options.backend);
            backends_ = make_checked_backends(options.backend, messages_);
        }
        std::optional<Progress> building(std::in_place, "building the tree", 0, messages_);
        CrossChecker checker(options, scene, *backends_, report);
        building.reset();
        Progress progress("comparing", report.frames.size() * checker.comparisons_of_frame(),
                          messages_);
        for (const double frame : report.frames) {
            try {
                checker.check(frame, progress);
            } catch (const Error& error) {
                if (error.kind() != ErrorKind::kBadInput || report.rows.empty()) throw;
                messages_.error(error);
                report.error = message_of(error);
                return ExitCode::kPartial;
            }
        }
        return ExitCode::kOk;
    }

    const CrosscheckOptions& options_;
    const Messages& messages_;
    CheckRun run_;
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
