#include "app/files/video/video.h"

#include <fmt/format.h>
#include <unistd.h>

#include <span>

#include "common/base/errors.h"
#include "common/base/input_file.h"
#include "common/base/output_file.h"
#include "common/base/watch.h"
#include "common/text/message_text.h"
#include "tools/process/fed_command.h"

namespace mray::app {
namespace {

namespace fs = std::filesystem;

constexpr const char* kProgram = "ffmpeg";

/// A file beside the video, with its end, by which ffmpeg chooses the kind. Removed unless renamed.
class VideoFile {
public:
    explicit VideoFile(const fs::path& target) : target_(fs::absolute(target)) {
        path_ = target_.parent_path() /
                fmt::format(".morphray-{}{}", ::getpid(), target_.extension().native());
    }
    ~VideoFile() {
        std::error_code ignored;
        fs::remove(path_, ignored);
    }
    VideoFile(const VideoFile&) = delete;
    VideoFile& operator=(const VideoFile&) = delete;

    const fs::path& path() const { return path_; }
    bool rename() const {
        std::error_code error;
        fs::rename(path_, target_, error);
        return !error;
    }

private:
    fs::path target_;
    fs::path path_;
};

}  // namespace

void check_video(const std::string& file) {
    if (fs::path(file).extension().empty()) {
        throw Error(ErrorKind::kBadArgument,
                    fmt::format("--video: {} needs an end such as .mp4 or .webm", in_quotes(file)));
    }
    check_writable(file);
    if (can_write_videos()) return;
    throw Error(ErrorKind::kUnavailable,
                "--video needs ffmpeg, which is not on the PATH; install it, or leave --video out");
}

bool can_write_videos() { return is_on_path(kProgram); }

void write_video(const std::string& file, std::uint32_t rate, const std::vector<fs::path>& images,
                 const std::atomic<bool>& cancel) {
    const VideoFile video(file);
    // Most codecs take even sizes alone. "file:" keeps a colon in a name from being a protocol.
    const std::vector<std::string> arguments = {
        kProgram,     "-nostdin",   "-y",
        "-loglevel",  "error",      "-f",
        "image2pipe", "-framerate", fmt::format("{}", rate),
        "-c:v",       "png",        "-i",
        "pipe:0",     "-vf",        "pad=ceil(iw/2)*2:ceil(ih/2)*2",
        "-pix_fmt",   "yuv420p",    "file:" + video.path().native()};
    const auto write = [&](const Feed& feed) {
        for (const fs::path& image : images) {
            throw_if_interrupted();
            Watch(&cancel).throw_if_cancelled();
            const std::string bytes = read_input_file(image);
            if (!feed(std::as_bytes(std::span(bytes)))) return;
        }
    };
    const std::optional<int> status = run_fed(arguments, write);
    if (status == 0 && video.rename()) return;
    throw Error(
        ErrorKind::kOutput,
        fmt::format("{}: ffmpeg could not write it ({}); choose another end of the name",
                    shown(file), status ? fmt::format("exit status {}", *status) : "not started"));
}

}  // namespace mray::app
