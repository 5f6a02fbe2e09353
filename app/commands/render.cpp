// morphray render: writes an image for each frame.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <optional>
#include <set>

#include "app/clip_scene.h"
#include "app/commands/commands.h"
#include "app/commands/render/output_queue.h"
#include "app/commands/render/render_command.h"
#include "app/files/exr_writer.h"
#include "app/files/output_folder.h"
#include "app/frames.h"
#include "app/library_calls.h"
#include "app/memory_budget.h"
#include "app/report/report_json.h"
#include "app/report/reports.h"
#include "app/terminal/interrupt.h"
#include "app/terminal/progress.h"
#include "common/base/output_file.h"
#include "common/base/stopwatch.h"
#include "common/image/png.h"
#include "common/text/table.h"
#include "morphray/hits.hpp"

namespace mray::app {
namespace {

// Width of an image in the contact sheet, which is about square and 1536 pixels wide. Only these
// small images stay in memory until the end.
std::uint32_t thumbnail_width(std::size_t frames) {
    if (frames <= 4) return 768;
    return frames <= 16 ? 384 : 192;
}

/// The contact sheet shows every n-th frame, so that it is square for clips of any length.
std::size_t sheet_step(std::size_t frames) {
    constexpr std::size_t kMostImages = 64;
    return (frames + kMostImages - 1) / kMostImages;
}

/// Whether --out names one image instead of a folder.
bool is_one_image(const Options& options) {
    return options.out.ends_with(".png") && !std::filesystem::is_directory(options.out);
}

std::filesystem::path folder_of(const Options& options) {
    if (options.out.empty()) return "out";
    if (!is_one_image(options)) return options.out;
    const std::filesystem::path folder = std::filesystem::path(options.out).parent_path();
    return folder.empty() ? "." : folder;
}

std::string image_name(const Options& options, double frame) {
    if (is_one_image(options)) return std::filesystem::path(options.out).filename();
    return fmt::format("frame_{}.png", frame_label(frame));
}

/// The kinds of rays that an image is made of.
std::string rays_text(const Options& options) {
    using morphray::Shading;
    const Shading shading = *options.shading.shading;
    if (shading == Shading::plain) return name_of_rays(options.view.rays);
    if (shading != Shading::lit) return name_of_rays(kRaysPrimary);
    return options.view.ao_count == 0 ? "shadow" : "shadow, ao";
}

// Images that are encoded and written while the next is traced.
constexpr std::size_t kMostBehind = 2;
// Of an image with its hits, a pixel or sample.
constexpr std::uint64_t kTracedBytesPerPixel = 28;

std::uint64_t pixel_count(const Options& options) {
    return std::uint64_t{options.view.width} * options.view.height * *options.shading.samples;
}

/// How many images may be written behind: none of images so large that memory should not hold
/// several.
std::size_t images_behind(const Options& options, std::size_t frames) {
    constexpr std::uint64_t kMostBytes = std::uint64_t{256} << 20;
    if (pixel_count(options) * kTracedBytesPerPixel > kMostBytes) return 0;
    return std::min(kMostBehind, frames - 1);
}

/// Traces images while earlier ones are written, and the positions of the next frame are read.
class Renderer {
public:
    Renderer(const Options& options, const Clip& clip, const std::vector<double>& frames,
             const std::filesystem::path& folder, const Messages& messages)
        : options_(options),
          messages_(messages),
          folder_(folder),
          scene_(options, clip, frames.front(), messages),
          thumbnail_width_(thumbnail_width(frames.size())),
          sheet_step_(sheet_step(frames.size())),
          behind_(images_behind(options, frames.size())),
          queue_(behind_) {
        const ViewSpec& view = options.view;
        if (!options.hits.empty()) hits_.emplace(view.width, view.height);
        const Topology& topology = clip.topology();
        report_.head = {"render",   clip.name(), topology.triangles.size(), topology.vertex_count,
                        view.width, view.height};
        report_.backend = scene_.scene().device().name();
        report_.device = scene_.scene().device().description();
        report_.rays = rays_text(options);
        report_.shading = name_of(*options.shading.shading);
        report_.samples = *options.shading.samples;
    }

    /// `next` is the frame of the next call, if there is one.
    void render(double frame_number, std::optional<double> next) {
        scene_.advance(frame_number);
        messages_.note(fmt::format("frame {}: {}, {}", frame_number,
                                   to_string(scene_.update().step), scene_.update().reason));
        if (next) scene_.prepare(*next);
        // The queue has left this image when it accepted the last one.
        morphray::Image& traced = traced_[report_.frames.size() % (behind_ + 1)];
        scene_.render(options_.view, options_.shading, traced);
        FrameReport& report = report_.frames.emplace_back(
            report_frame(scene_, frame_number, traced, !options_.json.empty()));
        report.file = image_name(options_, frame_number);
        report.read_wait_ms = scene_.read_wait_ms();
        const Stopwatch watch;
        queue_.add([this, frame_number, &traced] { write(frame_number, traced); });
        report_.frames.back().write_wait_ms = watch.ms();
    }

    /// Waits until all images are written.
    void wait() { queue_.finish(); }

    std::size_t finished() const { return report_.frames.size(); }

    /// Writes the outputs that concern all frames.
    void finish(bool complete) {
        wait();
        for (std::size_t i = 0; i < write_ms_.size(); ++i)
            report_.frames[i].write_ms = write_ms_[i];
        report_.complete = complete;
        if (thumbnails_.size() > 1) {
            write_file(folder_ / "sheet.png", encode_png(contact_sheet(thumbnails_)));
        }
        if (hits_) call_library([&] { hits_->write(options_.hits); });
        if (!options_.json.empty()) write_report(options_.json, to_json(report_));
        if (!takes_stdout({options_.json})) messages_.print(table());
    }

private:
    /// Writes the outputs of a frame. Runs in the queue's thread.
    void write(double frame_number, morphray::Image& traced) {
        const Stopwatch watch;
        if (hits_) call_library([&] { hits_->add(traced); });
        const std::vector<PngText> texts = image_texts(options_, frame_number, traced);
        const std::filesystem::path file = folder_ / image_name(options_, frame_number);
        if (!options_.shading.exr.empty()) {
            const ExrColours colours =
                options_.shading.exr == "float" ? ExrColours::kFloat : ExrColours::kHalf;
            write_file(std::filesystem::path(file).replace_extension(".exr"),
                       encode_exr(traced, colours, texts));
        }
        Image image{traced.width, traced.height, std::move(traced.pixels)};
        write_file(file, encode_png(image, texts));
        if (write_ms_.size() % sheet_step_ == 0)
            thumbnails_.push_back(contact_sheet({&image, 1}, thumbnail_width_));
        traced.pixels = std::move(image.pixels);
        write_ms_.push_back(watch.ms());
    }

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
    const Messages& messages_;
    std::filesystem::path folder_;
    ClipScene scene_;
    std::uint32_t thumbnail_width_;
    std::size_t sheet_step_;
    RenderReport report_;
    // While the queue has tasks, its thread alone uses these.
    std::optional<morphray::HitsWriter> hits_;
    std::vector<Image> thumbnails_;
    std::vector<double> write_ms_;
    std::size_t behind_;
    /// The image that is traced, and those that are written.
    std::array<morphray::Image, kMostBehind + 1> traced_;
    /// Ends before what its tasks use.
    OutputQueue queue_;
};

// What a file of hits takes for each pixel of an image: a hit, and a count of occluded rays.
constexpr std::uint64_t kHitsFileBytesPerPixel = 20;
// What a sample takes while it is shaded: a second traced image.
constexpr std::uint64_t kShadedBytesPerSample = 24;
// Texture coordinates and the number of a texture, of the clip, of a scene and while it is made.
// What texels take is checked as the textures are read.
constexpr std::uint64_t kTextureBytesPerTriangle = 3 * 28;

/// Refuses images whose samples are beyond what an image may have, though its pixels are not.
void require_samples_fit(const Options& options) {
    const std::uint32_t samples = *options.shading.samples;
    const std::uint64_t side = morphray::sample_side(samples);
    const std::uint64_t width = options.view.width * side;
    const std::uint64_t height = options.view.height * side;
    if (samples == 1 || (std::max(width, height) <= kMaxImageSide && width * height <= kMaxPixels))
        return;
    throw Error(
        ErrorKind::kLimit,
        fmt::format("{}x{} pixels of {} samples are too many; at most {} a side and {} in "
                    "all are possible, give a smaller --size or --samples",
                    options.view.width, options.view.height, samples, kMaxImageSide, kMaxPixels));
}

void require_memory_for(const Options& options, const Clip& clip, std::size_t frames) {
    const std::uint64_t pixels = pixel_count(options);
    // The hits of all frames, twice, because a growing array is copied.
    const std::uint64_t kept =
        (options.hits.empty() ? 0 : 2 * frames * pixels * kHitsFileBytesPerPixel) +
        (*options.shading.shading == morphray::Shading::plain ? 0
                                                              : pixels * kShadedBytesPerSample) +
        images_behind(options, frames) * pixels * kTracedBytesPerPixel +
        (clip.textures() == nullptr ? 0
                                    : clip.topology().triangles.size() * kTextureBytesPerTriangle);
    // A background build holds one more tree.
    const std::uint64_t background_build = options.tree.update == "auto" ? 1 : 0;
    require_memory(
        {.triangles = clip.topology().triangles.size(),
         .vertices = clip.topology().vertex_count,
         .pixels = pixels,
         .backends = (options.tree.refit_on == RefitOn::kOwn ? 1u : 2u) + background_build,
         .kept_bytes = kept});
}

void require_distinct_names(const Options& options, const std::vector<double>& frames) {
    if (is_one_image(options) && frames.size() > 1) {
        throw Error(
            ErrorKind::kBadArgument,
            fmt::format("--out {}: one image, but {} frames; choose one of them by --frames, "
                        "or give a folder",
                        options.out, frames.size()));
    }
    std::set<std::string> names;
    for (const double frame : frames) {
        if (names.insert(image_name(options, frame)).second) continue;
        throw Error(ErrorKind::kBadArgument,
                    fmt::format("--frames: two frames would both become {}; "
                                "choose a larger step",
                                image_name(options, frame)));
    }
}

}  // namespace

ExitCode run_render(const Options& given, const Messages& messages) {
    const Options options = with_render_defaults(given);
    require_samples_fit(options);
    check_reports({options.json, options.hits});
    const OutputFolder folder(folder_of(options));
    const std::unique_ptr<Clip> clip = open_clip(options, messages);
    const std::vector<double> frames = select_frames(options, *clip, DefaultFrames::kAll);
    warn_of_damage(options, *clip, frames, messages);
    require_distinct_names(options, frames);
    require_memory_for(options, *clip, frames.size());
    Renderer renderer(options, *clip, frames, folder.path(), messages);

    ExitCode code = ExitCode::kOk;
    Progress progress("rendering", frames.size(), progress_mode(options));
    for (std::size_t i = 0; i < frames.size(); ++i) {
        throw_if_interrupted();
        try {
            renderer.render(frames[i],
                            i + 1 < frames.size() ? std::optional(frames[i + 1]) : std::nullopt);
        } catch (const Error& error) {
            progress.hide();
            // Frames before one that cannot be read are kept.
            if (error.kind() != ErrorKind::kBadInput || renderer.finished() == 0) throw;
            renderer.wait();
            messages.error(error);
            code = ExitCode::kPartial;
            break;
        }
        progress.update(renderer.finished());
    }
    if (code == ExitCode::kOk) progress.finish();
    renderer.finish(code == ExitCode::kOk);
    return code;
}

}  // namespace mray::app
