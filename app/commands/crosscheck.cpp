// morphray crosscheck: compares the images of all backends, trees and instruction sets.
#include <fmt/format.h>

#include <exception>
#include <optional>

#include "app/backends/backends.h"
#include "app/clip/frames.h"
#include "app/commands/commands.h"
#include "app/commands/crosscheck/scene_check.h"
#include "app/report/crosscheck/check_report.h"
#include "app/terminal/failure.h"
#include "common/report/shell.h"

namespace mray::app {
namespace {

/// The command line, ready for a shell.
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
        find_devices();
        std::optional<CheckedBackends> backends;
        const SceneCheckContext context{messages_, run_.environment.devices, backends};
        ExitCode code = ExitCode::kOk;
        for (std::size_t i = 0; i < run_.scenes.size(); ++i) code = worse(code, check(i, context));
        return code;
    }

    void end_early(const std::string& error) { run_.error = error; }

    /// Writes all reports, then throws the first error, if one could not be written.
    void write_reports() const {
        std::exception_ptr failure;
        const auto attempt = [&failure](auto&& write) {
            try {
                write();
            } catch (...) {
                if (!failure) failure = std::current_exception();
            }
        };
        const auto write = [&attempt](const std::string& file, auto&& text) {
            if (!file.empty()) attempt([&] { write_report(file, text()); });
        };
        write(options_.json, [&] { return to_json(run_); });
        write(options_.junit, [&] { return to_junit(run_); });
        write(options_.html, [&] { return to_html(options_, run_); });
        if (!takes_stdout({options_.json, options_.junit, options_.html}))
            attempt([&] { messages_.print(run_text(options_, run_)); });
        if (failure) std::rethrow_exception(failure);
    }

private:
    /// Throws the error of a scene that cannot be opened, if there is one, before that of a device
    /// that cannot be had: the one is to be mended on any machine.
    void find_devices() {
        try {
            run_.environment.devices = devices_to_check(options_.backend, options_.all_devices);
        } catch (const Error&) {
            for (CheckReport& report : run_.scenes) require_scene(report);
            throw;
        }
    }

    void require_scene(CheckReport& report) const {
        SourceOptions one = options_.source;
        one.scene = report.spec;
        try {
            open_clip(one, messages_);
        } catch (const Error& error) {
            report.error = error.what();
            throw;
        }
    }

    ExitCode check(std::size_t index, const SceneCheckContext& context) {
        CheckReport& report = run_.scenes[index];
        CrosscheckOptions one = options_;
        one.source.scene = report.spec;
        const std::size_t warned = messages_.warnings().size();
        const auto keep_warnings = [&] {
            const std::vector<std::string>& all = messages_.warnings();
            report.warnings.assign(all.begin() + static_cast<std::ptrdiff_t>(warned), all.end());
        };
        ExitCode code = ExitCode::kOk;
        try {
            code = check_scene(one, context, report);
            report.complete = code == ExitCode::kOk;
        } catch (const Error& error) {
            keep_warnings();
            report.error = describe_failure(std::current_exception()).message;
            if (run_.scenes.size() == 1 || ends_run(error.kind())) throw;
            messages_.error(error);
            code = exit_code_of(error.kind());
        }
        keep_warnings();
        return report.equal() ? code : ExitCode::kCheckFailed;
    }

    const CrosscheckOptions& options_;
    const Messages& messages_;
    CheckRun run_;
};

}  // namespace

ExitCode run_crosscheck(const CrosscheckOptions& options, const Messages& messages) {
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
