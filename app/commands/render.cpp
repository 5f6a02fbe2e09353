// morphray render: writes an image for each frame.
#include <fmt/format.h>

#include <filesystem>
#include <optional>
#include <set>

#include "app/backends.h"
#include "app/commands/commands.h"
#include "app/files/hits_file.h"
#include "app/files/output_folder.h"
#include "app/frames.h"
#include "app/memory_budget.h"
#include "app/report/report_json.h"
#include "app/report/reports.h"
#include "app/terminal/interrupt.h"
#include "app/terminal/progress.h"
#include "common/base/output_file.h"
#include "common/image/png.h"
#include "common/text/table.h"

namespace mray::app {
namespace {

// Width of an image in the contact sheet, which is about square and 1536 pixels wide. Only these
// small images stay in memory until the end.
std::uint32_t thumbnail_width(std::size_t frames) {
    if (frames <= 4) return 768;
    return frames <= 16 ? 384 : 192;
}

std::string image_name(double frame) { return fmt::format("frame_{}.png", frame_label(frame)); }

class Renderer {
public:
    Renderer(const Options& options, SceneFrames& scene, const std::vector<double>& frames,
             const std::filesystem::path& folder, const Messages& messages)
        : options_(options),
          scene_(scene),
          messages_(messages),
          folder_(folder),
          params_(make_image_params(options.view, scene.clip().bounds(), scene.space())),
          session_(open_session(options, scene, frames.front(), messages)),
          thumbnail_width_(thumbnail_width(frames.size())) {
        if (!options.hits.empty()) hits_.emplace(params_.width, params_.height);
        const Topology& topology = scene.clip().topology();
        report_.head = {
            "render",      scene.clip().name(), topology.triangles.size(), topology.vertex_count,
            params_.width, params_.height};
        report_.backend = session_.tracer().name();
        report_.device = session_.tracer().description();
        report_.rays = name_of_rays(params_.rays);
    }

    void render(double frame_number) {
        session_.advance(frame_number);
        messages_.note(fmt::format("frame {}: {}, {}", frame_number,
                                   name_of(session_.last_update().step),
                                   session_.last_update().reason));
        session_.trace(params_, frame_);
        Image image{frame_.width, frame_.height, frame_.pixels};
        const std::string file = image_name(frame_number);
        write_file(folder_ / file, encode_png(image));
        if (hits_) hits_->add(frame_, params_.camera, scene_.space());
        thumbnails_.push_back(contact_sheet({&image, 1}, thumbnail_width_));
        report_.frames.push_back(
            report_frame(session_, frame_number, frame_, !options_.json.empty()));
        report_.frames.back().file = file;
    }

    std::size_t finished() const { return report_.frames.size(); }

    /// Writes the outputs that concern all frames.
    void finish(bool complete) {
        report_.complete = complete;
        if (thumbnails_.size() > 1) {
            write_file(folder_ / "sheet.png", encode_png(contact_sheet(thumbnails_)));
        }
        if (hits_) write_file(options_.hits, hits_->bytes());
        if (!options_.json.empty()) write_report(options_.json, to_json(report_));
        if (!takes_stdout({options_.json})) messages_.print(table());
    }

private:
    std::string table() const {
        Table table({"frame", "tree", "update ms", "trace ms", "Mray/s", "hits", "file"});
        for (const FrameReport& frame : report_.frames) {
            const double update = frame.times.total_ms() - frame.times.trace_ms;
            const double rate =
                static_cast<double>(frame.times.rays) / (frame.times.trace_ms * 1e3 + 1e-9);
            table.add({fmt::format("{}", frame.frame), frame.update, fmt::format("{:.2f}", update),
                       fmt::format("{:.2f}", frame.times.trace_ms), fmt::format("{:.2f}", rate),
                       fmt::format("{}", frame.hits), (folder_ / frame.file).string()});
        }
        return table.text();
    }

    const Options& options_;
    SceneFrames& scene_;
    const Messages& messages_;
    std::filesystem::path folder_;
    ImageParams params_;
    Session session_;
    Frame frame_;
    std::uint32_t thumbnail_width_;
    std::optional<HitsFile> hits_;
    std::vector<Image> thumbnails_;
    RenderReport report_;
};

void require_memory_for(const Options& options, const Clip& clip, std::size_t frames) {
    const std::uint64_t pixels = std::uint64_t{options.view.width} * options.view.height;
    // The hits of all frames, twice, because a growing array is copied.
    const std::uint64_t kept =
        options.hits.empty()
            ? 0
            : 2 * frames * HitsFile::bytes_per_frame(options.view.width, options.view.height);
    // A background build holds one more tree.
    const std::uint64_t background_build = options.tree.update == "auto" ? 1 : 0;
    require_memory(
        {.triangles = clip.topology().triangles.size(),
         .vertices = clip.topology().vertex_count,
         .pixels = pixels,
         .backends = (options.tree.refit_on == RefitOn::kOwn ? 1u : 2u) + background_build,
         .kept_bytes = kept});
}

void require_distinct_names(const std::vector<double>& frames) {
    std::set<std::string> names;
    for (const double frame : frames) {
        if (names.insert(image_name(frame)).second) continue;
        throw Error(ErrorKind::kBadArgument,
                    fmt::format("--frames: two frames would both become {}; "
                                "choose a larger step",
                                image_name(frame)));
    }
}

}  // namespace

ExitCode run_render(const Options& options, const Messages& messages) {
    check_reports({options.json, options.hits});
    const OutputFolder folder(options.out.empty() ? "out" : options.out);
    SceneFrames scene = open_frames(options, messages);
    const std::vector<double> frames = select_frames(options, scene.clip(), DefaultFrames::kAll);
    warn_of_damage(options, scene.clip(), frames, messages);
    require_distinct_names(frames);
    require_memory_for(options, scene.clip(), frames.size());
    Renderer renderer(options, scene, frames, folder.path(), messages);

    ExitCode code = ExitCode::kOk;
    Progress progress("rendering", frames.size(), progress_mode(options.quiet));
    for (const double frame : frames) {
        throw_if_interrupted();
        try {
            renderer.render(frame);
        } catch (const Error& error) {
            progress.hide();
            // Frames before one that cannot be read are kept.
            if (error.kind() != ErrorKind::kBadInput || renderer.finished() == 0) throw;
            messages.error(error);
            code = ExitCode::kPartial;
            break;
        }
        progress.update(renderer.finished());
    }
    progress.hide();
    renderer.finish(code == ExitCode::kOk);
    return code;
}

}  // namespace mray::app
