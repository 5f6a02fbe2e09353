#include "app/commands/render/outputs.h"

#include <fmt/format.h>

#include <set>

#include "app/animation/frames.h"
#include "app/base/choices.h"
#include "app/files/image_files.h"
#include "app/terminal/messages.h"
#include "common/base/errors.h"
#include "common/base/hash.h"
#include "common/image/frame.h"
#include "common/report/shell.h"
#include "common/text/text.h"
#include "common/version.h"

namespace mray::app {
namespace {

std::string image_name(const RenderOptions& options, double frame, const FrameDigits& digits) {
    if (renders_one_image(options)) return std::filesystem::path(options.out).filename();
    return fmt::format("frame_{}.png", frame_label(frame, digits));
}

/// Renders the image again on any backend, unless it shows a restructured tree by colours.
std::string render_command(const ImageOptions& options, double frame) {
    const morphray::View& view = options.view;
    std::vector<std::string> line = {"morphray", "render", options.source.scene, "--frames",
                                     fmt::format("{}", frame)};
    const auto add = [&line](const char* name, const std::string& value) {
        line.insert(line.end(), {name, value});
    };
    const bool is_plain = view.shading == morphray::Shading::plain;
    const bool is_lit = view.shading == morphray::Shading::lit;
    const morphray::Rays rays = is_plain ? view.rays : morphray::Rays::primary;
    for (const auto& part : {arguments_of(view, rays, is_lit), arguments_of(options.source)})
        line.insert(line.end(), part.begin(), part.end());
    if (is_plain)
        add("--rays", name_of_rays(rays));
    else
        add("--shading", name_in<morphray::Shading>(kShadings, view.shading));
    if (shows_tree(view.shading)) {
        const TreeOptions& tree = options.tree;
        // A tree that is built at each frame is the same wherever the first one was built.
        if (tree.build_at && tree.update.kind != PolicyKind::kRebuild)
            add("--build-at", fmt::format("{}", *tree.build_at));
        add("--update", text_of(tree.update));
    }
    add("--samples", fmt::format("{}", view.samples));
    if (view.flat) line.push_back("--flat");
    if (options.ground) add("--ground", name_in<bool>(kOnOff, *options.ground));
    return shell_line(line);
}

/// Also the length of an array, so that moving elements to the next one changes the hash.
void add_number(Hasher& hasher, std::uint64_t number) {
    hasher.add(std::span<const std::uint64_t>(&number, 1));
}

template <class T>
void add_array(Hasher& hasher, std::span<const T> values) {
    add_number(hasher, values.size());
    hasher.add(values);
}

std::string bytes_of(const TextureFile& file, bool lenient) {
    try {
        return texture_bytes(file);
    } catch (const Error& error) {
        if (!lenient || error.kind() != ErrorKind::kBadInput) throw;
        return {};
    }
}

void hash_textures(Hasher& hasher, const SceneTextures& textures, bool lenient) {
    add_array(hasher, std::span<const Texcoords>(textures.texcoords));
    add_array(hasher, std::span<const std::uint32_t>(textures.texture_ids));
    for (const TextureFile& file : textures.files) {
        add_number(hasher, file.clamp ? 1 : 0);
        hasher.add(std::span(&file.alpha_cutoff, 1));
        const std::string bytes = bytes_of(file, lenient);
        add_array(hasher, std::span<const char>(bytes));
    }
}

}  // namespace

std::filesystem::path output_folder_of(const RenderOptions& options) {
    if (!renders_one_image(options)) return options.out;
    const std::filesystem::path folder = std::filesystem::path(options.out).parent_path();
    return folder.empty() ? "." : folder;
}

std::vector<FrameTask> frame_tasks(const RenderOptions& options, const std::vector<double>& frames,
                                   const Animation& animation) {
    if (renders_one_image(options) && frames.size() > 1) {
        throw Error(
            ErrorKind::kBadArgument,
            "--out {}: one image, but {} frames; choose one of them by --frames, or give a folder",
            options.out, frames.size());
    }
    const FrameDigits digits = digits_of(frames, animation);
    std::set<std::string> names;
    std::vector<FrameTask> tasks;
    for (const double frame : frames) {
        const std::string name = image_name(options, frame, digits);
        if (!names.insert(name).second) {
            throw Error(ErrorKind::kBadArgument,
                        "--frames: two frames would both become {}; choose a larger step", name);
        }
        tasks.push_back({frame, name});
    }
    return tasks;
}

std::filesystem::path exr_file_of(const RenderOptions& options, const std::filesystem::path& folder,
                                  const FrameTask& task) {
    if (options.image.exr.empty()) return {};
    return (folder / task.file).replace_extension(".exr");
}

std::vector<PngText> image_texts(const ImageOptions& options, double frame,
                                 std::uint64_t scene_hash, const std::string& scale,
                                 const morphray::Image& image) {
    std::vector<PngText> texts = {{"Software", fmt::format("morphray {}", kVersionDetail)},
                                  {"Source", render_command(options, frame)},
                                  {"Scene hash", hash_text(scene_hash)},
                                  {"Hits hash", hash_text(image.hits_hash)},
                                  {"Image hash", hash_text(image.image_hash)}};
    if (!scale.empty()) texts.push_back({"Scale", scale});
    return texts;
}

std::uint64_t animation_hash(const Animation& animation, bool with_textures, bool lenient) {
    Hasher hasher;
    const Topology& topology = animation.topology();
    add_number(hasher, topology.vertex_count);
    add_array(hasher, std::span<const uvec3>(topology.triangles));
    add_array(hasher, std::span<const Albedo>(topology.albedo));
    add_array(hasher, animation.smooth_corners());
    const WorldBounds bounds = animation.bounds();
    hasher.add(std::span(&bounds.lower, 1)).add(std::span(&bounds.upper, 1));
    if (with_textures && animation.textures() != nullptr)
        hash_textures(hasher, *animation.textures(), lenient);
    return hasher.digest();
}

std::uint64_t frame_hash(std::uint64_t animation_hash, std::span<const vec3> positions) {
    Hasher hasher;
    add_number(hasher, animation_hash);
    return hasher.add(positions).digest();
}

}  // namespace mray::app
