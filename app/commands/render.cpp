// morphray render: writes an image for each frame.
#include <numeric>

#include "app/animation/animation_scene.h"
#include "app/animation/devices.h"
#include "app/animation/frames.h"
#include "app/base/image_files.h"
#include "app/commands/commands.h"
#include "app/report/json_parts.h"
#include "common/base/output_file.h"
#include "report/shell.h"
#include "report/table.h"

namespace mray::app {
namespace {

struct FrameTask {
    double frame = 0;
    std::filesystem::path file;
};

/// Renders the image again, on any backend.
std::string render_command(const Options& options, double frame) {
    const morphray::View& view = options.view;
    std::vector<std::string> line = {"morphray", "render", options.source.scene, "--frames",
                                     fmt::format("{}", frame)};
    const bool is_plain = view.shading == morphray::Shading::plain;
    const bool is_lit = view.shading == morphray::Shading::lit;
    const morphray::Rays rays = is_plain ? view.rays : morphray::Rays::primary;
    std::ranges::copy(arguments_of(options, rays, is_lit), std::back_inserter(line));
    if (is_plain)
        line.insert(line.end(), {"--rays", name_of_rays(rays)});
    else
        line.insert(line.end(), {"--shading", name_in(kShadings, view.shading)});
    line.insert(line.end(), {"--samples", fmt::format("{}", view.samples)});
    if (view.flat) line.push_back("--flat");
    if (options.ground) line.insert(line.end(), {"--ground", name_in(kOnOff, *options.ground)});
    return shell_line(line);
}

/// The images of these frames: one file that --out names, or files in the folder that it names.
std::vector<FrameTask> frame_tasks(const Options& options, const std::vector<double>& frames,
                                   const Animation& animation) {
    const std::filesystem::path out = options.out;
    const bool is_one_image = lower_case(options.out).ends_with(".png");
    if (is_one_image && frames.size() > 1)
        throw Error(
            ErrorKind::kBadArgument,
            "--out {}: one image, but {} frames; choose one of them by --frames, or give a folder",
            options.out, frames.size());
    if (is_one_image) return {{frames.front(), out.has_parent_path() ? out : "." / out}};
    const std::vector<std::string> labels = frame_labels(frames, animation);
    std::vector<FrameTask> tasks;
    for (std::size_t i = 0; i < frames.size(); ++i)
        tasks.push_back({frames[i], out / fmt::format("frame_{}.png", labels[i])});
    return tasks;
}

Json json_of(const AnimationScene& scene, const FrameTask& task, const morphray::Image& image,
             bool with_tree) {
    morphray::TreeStatistics tree;
    if (with_tree) tree = call_library([&] { return scene.scene().tree_statistics(); });
    const auto hits = std::ranges::count_if(image.hits, [](const auto& hit) { return bool{hit}; });
    const morphray::Update& update = scene.update();
    const double update_ms = update.milliseconds() - update.read_ms;
    return {{"frame", task.frame},
            {"backend", scene.scene().device().name()},
            {"update", to_string(update.step)},
            {"refit_on", scene.refitted_on()},
            {"hits_hash", hash_text(image.hits_hash)},
            {"image_hash", hash_text(image.image_hash)},
            {"bvh_hash", hash_text(tree.hash)},
            {"deform_ms", scene.deform_ms()},
            {"upload_ms", update.upload_ms},
            {"refit_ms", update.refit_ms},
            {"decide_ms", update.decide_ms},
            {"restructure_ms", update.restructure_ms},
            {"rebuild_ms", update.rebuild_ms},
            {"trace_ms", image.trace_ms},
            {"total_ms", scene.deform_ms() + update_ms + image.trace_ms},
            {"rays", image.ray_count},
            {"hits", hits},
            {"misses", image.hits.size() - static_cast<std::size_t>(hits)},
            {"occluded",
             std::accumulate(image.occlusion.begin(), image.occlusion.end(), std::uint64_t{0})},
            {"sah_cost", tree.sah_cost},
            {"cost_ratio", update.cost_ratio},
            {"reason", update.reason},
            {"file", task.file.filename().string()}};
}

std::string rays_text(const Options& options) {
    using morphray::Shading;
    const Shading shading = options.view.shading;
    if (shading == Shading::plain) return name_of_rays(options.view.rays);
    if (shading != Shading::lit) return name_of_rays(morphray::Rays::primary);
    return options.view.ao_count == 0 ? "shadow" : "shadow, ao";
}

Options with_ground(Options options, const morphray::View& view, const Animation& animation) {
    options.ground = has_ground(options.ground, view, animation);
    return options;
}

std::uint64_t pixel_count(const Options& options) {
    const morphray::View& view = options.view;
    return std::uint64_t{view.width} * view.height * view.samples;
}

/// Traces images while earlier ones are written, and the positions of the next frame are read.
class Renderer {
public:
    /// Builds the tree. `view` is the world_view() of the options.
    Renderer(const Options& options, const morphray::View& view, const Animation& animation,
             const std::vector<FrameTask>& tasks, const Messages& messages)
        : options_(options),
          messages_(messages),
          tasks_(tasks),
          view_(view),
          scale_(scale_text(view, animation)),
          scene_(open_device(options.backend, messages), with_ground(options, view, animation),
                 animation, tasks.front().frame, messages),
          prints_rows_(!is_stdout(options.json)) {
        if (!scale_.empty()) messages.tell(scale_);
        view_.linear = options.exr.has_value();
        view_.cancel = &interrupt_flag();
        if (!options.hits.empty()) call_library([&] { hits_.emplace(view.width, view.height); });
        report_ = head_of("render", animation);
        report_["width"] = view.width;
        report_["height"] = view.height;
        report_["backend"] = scene_.scene().device().name();
        report_["device"] = scene_.scene().device().description();
        report_["error"] = "";
        report_["rays"] = rays_text(options);
        report_["shading"] = name_in(kShadings, view.shading);
        report_["samples"] = view.samples;
        report_["complete"] = false;
        report_["frames"] = Json::array();
        std::size_t frame_width = 0;
        for (const FrameTask& task : tasks)
            frame_width = std::max(frame_width, fmt::format("{}", task.frame).size());
        columns_ = {
            {"frame", frame_width}, {"tree", 7, false},
            {"update ms"},          {"trace ms", 9},
            {"Mray/s", 7},          {"hits", fmt::format("{}", pixel_count(options)).size()},
            {"file", 0, false}};
        header_ = header_text(columns_);
    }

    /// `next` is the frame of the next call, if there is one.
    void render(std::size_t i, std::optional<double> next, Progress& progress) {
        const double frame = tasks_[i].frame;
        progress.begin(fmt::format("tree of frame {}", frame));
        scene_.advance(frame);
        progress.begin(fmt::format("frame {}", frame));
        messages_.note(fmt::format("frame {}: {}, {}", frame, to_string(scene_.update().step),
                                   scene_.update().reason));
        if (next) scene_.prepare(*next);
        // The image before it is written meanwhile, from the other place.
        morphray::Image& traced = traced_[finished() % traced_.size()];
        view_.progress = &progress.share;
        scene_.render(view_, traced);
        const Json report = json_of(scene_, tasks_[i], traced, !options_.json.empty());
        wait();
        const std::string row = row_of(report, tasks_[i]);
        writing_ = std::async(std::launch::async, [this, i, &traced, report, row] {
            write(i, traced);
            if (prints_rows_) messages_.print(std::exchange(header_, {}) + row);
            return report;
        });
        // Memory should not hold several images that are large.
        constexpr std::uint64_t kLargePixels = 9 << 20;
        if (pixel_count(options_) > kLargePixels) wait();
    }

    /// Waits until all images are written. Throws the error of the last one.
    void wait() {
        if (writing_.valid()) report_["frames"].push_back(writing_.get());
    }

    /// Images that are there, or will be after wait().
    std::size_t finished() const { return report_["frames"].size() + writing_.valid(); }

    /// `failure` is what ended the rendering. Returns the code of the command.
    ExitCode finish(Failure failure) {
        // Frames before one that cannot be read are kept.
        if (failure.code == ExitCode::kBadInput && finished() > 0)
            failure.code = ExitCode::kPartial;
        attempt(failure, messages_, [&] { wait(); });
        if (hits_ && (failure.code == ExitCode::kOk || failure.code == ExitCode::kPartial))
            attempt(failure, messages_,
                    [&] { call_library([&] { hits_->write(options_.hits); }); });
        report_["complete"] = failure.code == ExitCode::kOk;
        report_["error"] = failure.message;
        return write_reports(failure.code, messages_,
                             {{options_.json, [&] { return json_text(report_); }}},
                             [] { return ""; });
    }

private:
    /// Writes the outputs of a task. Runs in a thread of its own.
    void write(std::size_t i, morphray::Image& traced) {
        const FrameTask& task = tasks_[i];
        if (hits_) call_library([&] { hits_->add(traced); });
        // Nothing in them differs between backends.
        std::vector<PngText> texts = {{"Software", fmt::format("morphray {}", kVersionDetail)},
                                      {"Source", render_command(options_, task.frame)},
                                      {"Hits hash", hash_text(traced.hits_hash)},
                                      {"Image hash", hash_text(traced.image_hash)}};
        if (!scale_.empty()) texts.push_back({"Scale", scale_});
        if (options_.exr)
            write_file(std::filesystem::path(task.file).replace_extension(".exr"),
                       encode_exr(traced, *options_.exr, texts));
        Image image{traced.width, traced.height, std::move(traced.pixels)};
        write_file(task.file, encode_png(image, texts));
        traced.pixels = std::move(image.pixels);
    }

    std::string row_of(const Json& frame, const FrameTask& task) const {
        const double trace_ms = frame["trace_ms"];
        const double rate = frame["rays"].get<double>() / (trace_ms * 1e3 + 1e-9);
        return row_text(columns_,
                        std::vector<std::string>{
                            fmt::format("{}", task.frame), frame["update"],
                            fmt::format("{:.2f}", frame["total_ms"].get<double>() - trace_ms),
                            fmt::format("{:.2f}", trace_ms), fmt::format("{:.2f}", rate),
                            frame["hits"].dump(), task.file});
    }

    const Options& options_;
    const Messages& messages_;
    const std::vector<FrameTask>& tasks_;
    morphray::View view_;
    std::string scale_;
    AnimationScene scene_;
    Json report_;
    // While an image is written, its thread alone uses these.
    std::optional<morphray::HitsWriter> hits_;
    std::vector<Column> columns_;
    bool prints_rows_;
    /// Empty once it is printed.
    std::string header_;
    /// The image that is traced, and the one that is written.
    std::array<morphray::Image, 2> traced_;
    /// Ends before what it uses.
    std::future<Json> writing_;
};

}  // namespace

ExitCode run_render(const Options& given, const Messages& messages) {
    Options options = given;
    const std::unique_ptr<Animation> animation = open_animation(options.source, messages);
    const std::vector<double> frames = select_frames(options, *animation, DefaultFrames::kAll);
    // One tree for all runs.
    if (!options.tree.build_at) options.tree.build_at = frames.front();
    const std::vector<FrameTask> tasks = frame_tasks(options, frames, *animation);
    std::vector<std::string> outputs = {options.json, options.hits};
    for (const FrameTask& task : tasks) outputs.push_back(task.file);
    require_distinct(outputs);
    const morphray::View view = world_view(options.view, *animation);
    Failure failure;
    Progress progress("rendering", tasks.size(), messages);
    progress.begin("tree");
    Renderer renderer(options, view, *animation, tasks, messages);
    // Before the reports, which may be in it.
    make_output_folder(tasks.front().file.parent_path());
    check_reports({options.json, options.hits});
    attempt(failure, messages, [&] {
        for (std::size_t done = 0; done < tasks.size(); ++done) {
            throw_if_interrupted();
            const bool is_last = done + 1 == tasks.size();
            renderer.render(done, is_last ? std::nullopt : std::optional(frames[done + 1]),
                            progress);
            progress.update(done + 1);
        }
    });
    return renderer.finish(failure);
}

}  // namespace mray::app
