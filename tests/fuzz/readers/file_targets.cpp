// How a reader may end; material libraries; images: PNG files of `diff`, textures.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "app/base/image_files.h"
#include "scenes/obj/obj_reader.h"
#include "tests/fuzz/readers/targets.h"

namespace mray::fuzz {
namespace {

// A path of 4096 bytes, all of them escaped, and some text.
constexpr std::size_t kLongestMessage = 20000;

bool is_control(char c) { return (c >= 0 && c < ' ') || c == '\x7f'; }

/// The limits of textures, and small, since compressed files of few bytes may have many pixels.
constexpr app::ImageLimits kLimits = {.side = 4096, .pixels = 1 << 16};

template <class Decode>
std::string image_failure_of(const std::string& name, Decode decode) {
    const auto work = [&](bool) {
        const Image image = decode(name);
        const bool is_right = image.pixels.size() == std::size_t{image.width} * image.height;
        return is_right && !image.pixels.empty() ? ""
                                                 : "an image of another size than it has pixels";
    };
    return failure_of(name, work, {false});
}

constexpr const char* kName = "case.mtl";

std::string broken_material(const Material& material) {
    constexpr Albedo kLargest = 0x00FFFFFF;
    if (material.albedo > kLargest) return "an albedo of more than 24 bits";
    for (std::size_t axis = 0; axis < 2; ++axis)
        if (!std::isfinite(material.scale[axis]) || !std::isfinite(material.offset[axis]))
            return "texture coordinates that are not finite";
    return {};
}

}  // namespace

std::string message_failure(std::string_view message, std::string_view name) {
    if (message.size() > kLongestMessage)
        return fmt::format("a message of {} bytes", message.size());
    if (std::any_of(message.begin(), message.end(), is_control))
        return fmt::format("a message of several lines or with control characters: {}", message);
    if (message.find(name) == std::string_view::npos)
        return fmt::format("an error that does not name the file: {}", message);
    return {};
}

std::string error_failure(const Error& error, std::string_view name) {
    if (error.kind() != ErrorKind::kBadInput && error.kind() != ErrorKind::kLimit)
        return fmt::format("error of another kind: {}", error.what());
    return message_failure(error.what(), name);
}

std::string png_failure(std::string_view bytes) {
    const std::string copy(bytes);
    return image_failure_of(
        "case.png", [&](const std::string& name) { return app::decode_png(copy, name, kLimits); });
}

std::string jpeg_failure(std::string_view bytes) {
    const std::string copy(bytes);
    return image_failure_of(
        "case.jpg", [&](const std::string& name) { return app::decode_jpeg(copy, name, kLimits); });
}

std::string mtl_failure(std::string_view bytes) {
    return failure_of(kName, [&](bool) {
        WarningCount unread;
        const MaterialMap materials = read_mtl_text(bytes, kName, unread);
        for (const auto& [name, material] : materials) {
            std::string failure = broken_material(material);
            if (!failure.empty()) return failure;
        }
        return std::string();
    });
}

}  // namespace mray::fuzz
