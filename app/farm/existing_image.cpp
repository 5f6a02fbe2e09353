#include "app/farm/existing_image.h"

#include <fmt/format.h>

#include <algorithm>
#include <vector>

#include "app/clip/render_command.h"
#include "app/files/exr_reader.h"
#include "app/files/png_reader.h"
#include "common/base/errors.h"
#include "common/base/hash.h"
#include "common/base/input_file.h"
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
void require_text(const std::string& what, const std::string& text, const std::string& expected) {
    if (text != expected) throw Unusable{fmt::format("{} is '{}', not '{}'", what, text, expected)};
}

/// Reads all pixels of an OpenEXR file.
void read_exr(const std::filesystem::path& file, const Options& options, const PngFile& png) {
    ExrReader reader(file);
    for (const PngText& text : png.texts) {
        std::string name = text.keyword;
        std::ranges::replace(name, ' ', '_');
        require_text("of the OpenEXR file " + name, reader.attribute(name), text.text);
    }
    if (reader.width() != options.view.width || reader.height() != options.view.height)
        throw Unusable{"the OpenEXR file has another size"};
    const auto colour = std::ranges::find(reader.channels(), std::string("R"), &ExrChannel::name);
    if (colour == reader.channels().end() || name_of(colour->type) != options.shading.exr)
        throw Unusable{"the OpenEXR file has colours of another type"};
    constexpr std::uint32_t kRows = 64;
    for (std::uint32_t row = 0; row < reader.height(); row += kRows)
        reader.read_rows(row, std::min(kRows, reader.height() - row));
}

/// Adds a further file of the frame.
void add_output(const std::filesystem::path& folder, const std::filesystem::path& file,
                const PartImage* earlier, PartImage& part) {
    part.outputs.push_back(output_of(folder, file));
    if (earlier == nullptr) return;
    const PartOutput& output = part.outputs.back();
    const auto before = std::ranges::find(earlier->outputs, output.file, &PartOutput::file);
    if (before != earlier->outputs.end() && before->hash != output.hash)
        throw Unusable{fmt::format("{} has changed since it was written", output.file)};
}

ExistingImage read_whole(const Options& options, const std::filesystem::path& folder,
                         const FrameTask& task, std::uint64_t scene_hash,
                         const PartImage* earlier) {
    PngFile png = read_png_file(folder / task.file);
    require_text("version", png.text("Software"), software_text());
    require_text("command", png.text("Source"), render_command(options, task.frame));
    require_text("scene", png.text("Scene hash"), hash_text(scene_hash));
    const std::uint64_t pixels_hash = image_hash(png.image.pixels);
    require_text("hash of pixels", hash_text(pixels_hash), png.text("Image hash"));
    if (png.image.width != options.view.width || png.image.height != options.view.height)
        throw Unusable{"the image has another size"};
    ExistingImage existing;
    existing.part.scene_hash = scene_hash;
    existing.part.image_hash = pixels_hash;
    const std::string hits = png.text("Hits hash");
    existing.part.hits_hash = std::strtoull(hits.c_str(), nullptr, 16);
    require_text("hash of hits", hits, hash_text(existing.part.hits_hash));
    if (const std::filesystem::path file = exr_file_of(options, folder, task); !file.empty()) {
        read_exr(file, options, png);
        add_output(folder, file, earlier, existing.part);
    }
    if (const std::filesystem::path file = hits_file_of(options, task); !file.empty()) {
        add_output(folder, file, earlier, existing.part);
        require_text("hash of the file of hits", hash_text(existing.part.outputs.back().hash),
                     png.text(kHitsFileHash));
    }
    existing.image = std::move(png.image);
    return existing;
}

}  // namespace

std::uint64_t file_hash(const std::filesystem::path& path) {
    const InputFile file(path);
    constexpr std::uint64_t kAtOnce = 1 << 20;
    std::vector<std::byte> bytes(std::min(kAtOnce, file.size()));
    Hasher hasher;
    for (std::uint64_t at = 0; at < file.size(); at += bytes.size()) {
        const std::uint64_t count = std::min<std::uint64_t>(bytes.size(), file.size() - at);
        const std::span<std::byte> part(bytes.data(), count);
        file.read(at, part);
        hasher.add(part);
    }
    return hasher.digest();
}

PartOutput output_of(const std::filesystem::path& folder, const std::filesystem::path& file) {
    return {std::filesystem::proximate(file, folder).native(), file_hash(file)};
}

std::optional<ExistingImage> read_existing(const Options& options,
                                           const std::filesystem::path& folder,
                                           const FrameTask& task, std::uint64_t scene_hash,
                                           const PartImage* earlier, std::string& reason) {
    reason.clear();
    if (!is_there(folder / task.file)) return std::nullopt;
    try {
        return read_whole(options, folder, task, scene_hash, earlier);
    } catch (const Unusable& unusable) {
        reason = unusable.reason;
    } catch (const Error& error) {
        if (error.kind() != ErrorKind::kBadInput && error.kind() != ErrorKind::kLimit) throw;
        reason = error.what();
    }
    return std::nullopt;
}

}  // namespace mray::app
