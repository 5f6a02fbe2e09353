#include "app/commands/render/existing_image.h"

#include <fmt/format.h>

#include "app/clip/render_command.h"
#include "app/files/image_reader.h"
#include "common/base/errors.h"
#include "common/image/frame.h"
#include "common/text/number_text.h"

namespace mray::app {
namespace {

/// Why a file does not count.
struct Unusable {
    std::string reason;
};

bool is_there(const std::filesystem::path& file) {
    std::error_code error;
    return std::filesystem::exists(file, error);
}

/// Throws Unusable unless the file has the text that this run would write.
void require_text(const char* what, const std::string& text, const std::string& expected) {
    if (text != expected) throw Unusable{fmt::format("{} is '{}', not '{}'", what, text, expected)};
}

Image read_whole(const Options& options, const std::filesystem::path& folder, const FrameTask& task,
                 std::uint64_t scene_hash) {
    PngFile png = read_png_file(folder / task.file);
    require_text("version", png.text("Software"), software_text());
    require_text("command", png.text("Source"), render_command(options, task.frame));
    require_text("scene", png.text("Scene hash"), hash_text(scene_hash));
    require_text("hash of pixels", hash_text(image_hash(png.image.pixels)), png.text("Image hash"));
    if (png.image.width != options.view.width || png.image.height != options.view.height)
        throw Unusable{"the image has another size"};
    for (const std::filesystem::path& file :
         {exr_file_of(options, folder, task), hits_file_of(options, task)})
        if (!file.empty() && !is_there(file))
            throw Unusable{fmt::format("{} is missing", file.filename().string())};
    return std::move(png.image);
}

}  // namespace

std::optional<Image> read_existing(const Options& options, const std::filesystem::path& folder,
                                   const FrameTask& task, std::uint64_t scene_hash,
                                   std::string& reason) {
    reason.clear();
    if (!is_there(folder / task.file)) return std::nullopt;
    try {
        return read_whole(options, folder, task, scene_hash);
    } catch (const Unusable& unusable) {
        reason = unusable.reason;
    } catch (const Error& error) {
        if (error.kind() != ErrorKind::kBadInput && error.kind() != ErrorKind::kLimit) throw;
        reason = error.what();
    }
    return std::nullopt;
}

}  // namespace mray::app
