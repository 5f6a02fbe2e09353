#include "app/farm/part_log.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>

#include "app/clip/render_command.h"
#include "app/terminal/failure.h"
#include "app/terminal/interrupt.h"
#include "common/base/errors.h"
#include "common/base/output_file.h"

namespace mray::app {
namespace {

/// The command without what differs between shards and machines.
std::string source_of(const Options& options) {
    std::vector<std::string> frames = {"--frames", options.frames};
    if (options.frames.empty()) frames.back() = "all";
    if (!options.time.empty()) {
        frames = {"--time", options.time};
        if (options.fps && !has_seconds(options))
            frames.insert(frames.end(), {"--fps", fmt::format("{}", *options.fps)});
    }
    std::string source = render_command(options, frames);
    if (!options.shading.exr.empty()) source += " --exr " + options.shading.exr;
    if (!options.hits.empty()) source += " --hits hits/";
    return source;
}

std::optional<Part> earlier_part(const std::filesystem::path& file) {
    std::error_code error;
    if (!std::filesystem::exists(file, error)) return std::nullopt;
    try {
        return read_part(file);
    } catch (const Error&) {
        return std::nullopt;
    }
}

const PartImage* find(const std::vector<PartImage>& images, double frame) {
    const auto found = std::ranges::find(images, frame, &PartImage::frame);
    return found == images.end() ? nullptr : &*found;
}

}  // namespace

std::string host_name() {
    if (const char* const node = std::getenv("SLURMD_NODENAME"); node != nullptr) return node;
    char name[256] = {};
    if (::gethostname(name, sizeof(name) - 1) != 0) return "";
    return name;
}

PartLog::PartLog(const Options& options, const std::filesystem::path& folder)
    : is_on_(options.farm.shard.has_value()), folder_(folder) {
    if (!is_on_) return;
    part_.shard = *options.farm.shard;
    part_.host = host_name();
    part_.render.software = software_text();
    part_.render.source = source_of(options);
    part_.render.scene = options.scene;
    part_.render.width = options.view.width;
    part_.render.height = options.view.height;
    part_.render.verify_every = options.farm.verify_every;
    if (options.farm.skip_existing) earlier_ = earlier_part(folder_ / part_name(part_.shard));
}

void PartLog::set_scene(const Clip& clip, std::uint64_t clip_hash,
                        const std::vector<double>& frames, const std::vector<FrameTask>& tasks) {
    part_.render.scene = clip.name();
    part_.render.triangles = clip.topology().triangles.size();
    part_.render.vertices = clip.topology().vertex_count;
    part_.render.scene_hash = clip_hash;
    part_.render.frames = frames;
    for (const FrameTask& task : tasks)
        (task.is_check ? part_.checks_left : part_.frames_left).push_back(task.frame);
}

void PartLog::begin() {
    if (is_on_) write();
}

void PartLog::set_device(const std::string& backend, const std::string& device) {
    part_.backend = backend;
    part_.device = device;
}

void PartLog::add(const FrameTask& task, PartImage image) {
    image.host = part_.host;
    image.backend = part_.backend;
    image.device = part_.device;
    put(task, std::move(image));
}

void PartLog::keep(const FrameTask& task, PartImage image) {
    image.is_kept = true;
    if (const PartImage* const before = earlier(task)) {
        image.host = before->host;
        image.backend = before->backend;
        image.device = before->device;
    } else if (earlier_ && earlier_->state == PartState::kRunning) {
        // It was killed after this frame, and had no time to say so.
        image.host = earlier_->host;
    }
    put(task, std::move(image));
}

void PartLog::put(const FrameTask& task, PartImage image) {
    if (!is_on_) return;
    image.frame = task.frame;
    image.file = task.file;
    std::erase(task.is_check ? part_.checks_left : part_.frames_left, task.frame);
    (task.is_check ? part_.checks : part_.images).push_back(std::move(image));
}

const PartImage* PartLog::earlier(const FrameTask& task) const {
    if (!earlier_) return nullptr;
    return find(task.is_check ? earlier_->checks : earlier_->images, task.frame);
}

void PartLog::end(ExitCode code) {
    if (!is_on_) return;
    part_.state = code == ExitCode::kOk ? PartState::kDone : PartState::kPartial;
    part_.exit_code = static_cast<int>(code);
    write();
}

void PartLog::end_with(const std::exception_ptr& failure) {
    if (!is_on_) return;
    const Failure described = describe_failure(failure);
    part_.state = interrupted() ? PartState::kInterrupted : PartState::kFailed;
    part_.exit_code = static_cast<int>(described.code);
    part_.reason = described.message;
    try {
        write();
    } catch (...) {
        // The failure itself matters more, and is reported.
    }
}

void PartLog::write() const { write_file(folder_ / part_name(part_.shard), to_json(part_)); }

}  // namespace mray::app
