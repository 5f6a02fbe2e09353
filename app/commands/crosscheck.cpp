// morphray crosscheck: compares the images of all backends, trees and instruction sets.
#include <algorithm>
#include <optional>

#include "app/animation/devices.h"
#include "app/animation/frames.h"
#include "app/base/messages.h"
#include "app/commands/commands.h"
#include "app/commands/cross_checker.h"
#include "app/report/check_report.h"
#include "common/text/text.h"
#include "library/src/engine.h"

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
        warn_of_numbered_scenes(options.scenes, messages);
    }

    ExitCode run() {
        Failure end;
        ExitCode code = ExitCode::kOk;
        attempt(end, messages_, [&] {
            for (Json& scene : report_["scenes"]) {
                const ExitCode one = check(scene);
                // A scene that could not be opened is worse than one with a missing part.
                if (!scene["equal"])
                    code = ExitCode::kCheckFailed;
                else if (code == ExitCode::kOk ||
                         (code == ExitCode::kPartial && one != ExitCode::kOk))
                    code = one;
            }
        });
        report_["error"] = end.message;
        conclude(report_, unfinished_.empty() ? end.message : unfinished_);
        return write_reports(
            end.code == ExitCode::kOk ? code : end.code, messages_,
            {{options_.json, [&] { return json_text(report_); }},
             {options_.junit, [&] { return to_junit(report_); }},
             {options_.html, [&] { return to_html(report_); }}},
            [&] { return run_text(report_); }, report_["verdict"]);
    }

private:
    ExitCode check(Json& scene) {
        CrosscheckOptions one = options_;
        one.source.scene = scene["spec"];
        const auto add_warnings = [&] {
            for (; warned_ < messages_.warnings().size(); ++warned_)
                scene["warnings"].push_back(messages_.warnings()[warned_]);
        };
        try {
            check_scene(one, scene);
            scene["complete"] = true;
        } catch (const Error& error) {
            add_warnings();
            const bool is_clear = options_.scenes.size() == 1 ||
                                  error.kind() == ErrorKind::kBadInput || ends_run(error.kind());
            const std::string name = is_clear ? "" : one.source.scene + ": ";
            leave(scene, {error.kind(), name + error.what(), error.hint()});
            if (ends_run(error.kind())) throw;
            const ExitCode code = exit_code_of(error.kind());
            messages_.error({scene["error"], code});
            const bool is_later = code == ExitCode::kBadInput && !scene["rows"].empty();
            return is_later ? ExitCode::kPartial : code;
        }
        add_warnings();
        return ExitCode::kOk;
    }

    void check_scene(const CrosscheckOptions& options, Json& report) {
        const std::unique_ptr<Animation> opened = open_animation(options.source, messages_);
        const Animation& animation = *opened;
        report["scene"] = animation.name();
        report["triangles"] = animation.topology().triangles.size();
        report["vertices"] = animation.topology().vertex_count;
        const std::vector<double> frames =
            select_frames(options.frames, std::nullopt, animation, DefaultFrames::kFew);
        report["frames"] = frames;
        if (!devices_) {
            add_chosen_device(options.backend);
            devices_ = open_checked_devices(options.backend, messages_);
        }
        std::optional<Progress> building(std::in_place, "building the tree", 0, messages_);
        CrossChecker checker(options, animation, *devices_, report, messages_);
        building.reset();
        Progress progress("comparing", frames.size(), messages_);
        std::uint64_t done = 0;
        for (const double frame : frames) {
            checker.check(frame, progress);
            progress.update(++done);
        }
        const auto has_hits = [](const Json& row) { return row["hits"] > 0; };
        if (options.query_count > 0 || std::ranges::any_of(report["rows"], has_hits)) return;
        report["equal"] = false;
        throw Error(
            ErrorKind::kBadArgument,
            "no camera ray hits anything, so nothing was checked; choose --eye and --target");
    }

    /// The Vulkan device that is checked, unless the options choose the CPU.
    void add_chosen_device(const BackendOptions& options) {
        if (options.choice == BackendChoice::kCpu) return;
        const std::vector<morphray::VulkanDeviceInfo> devices = vulkan_devices();
        const std::uint32_t chosen = morphray::engine::device_index(options.device);
        for (const morphray::VulkanDeviceInfo& device : devices)
            if (device.index == chosen) report_["environment"]["devices"].push_back(of(device));
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
    /// The warnings that a scene of the report has.
    std::size_t warned_ = 0;
    /// Opened for the first scene. They are shared because a device takes a second to start.
    std::optional<CheckedDevices> devices_;
};

}  // namespace

ExitCode run_command(const CrosscheckOptions& options, const Messages& messages) {
    check_reports({options.json, options.junit, options.html});
    return Crosscheck(options, messages).run();
}

}  // namespace mray::app
