#include "app/cli/conflicts.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <string_view>
#include <system_error>

#include "app/terminal/messages.h"
#include "common/base/errors.h"
#include "common/text/message_text.h"
#include "common/text/utf8.h"

namespace mray::app {

namespace {

void refuse(const std::string& message) { throw Error(ErrorKind::kBadArgument, message); }

/// Refuses the names of files that render does not write, which would become folders.
void check_image_name(const std::string& out) {
    constexpr std::string_view kEndings[] = {
        ".png", ".exr", ".jpg", ".jpeg", ".jpe", ".tif", ".tiff", ".bmp", ".gif",  ".webp",
        ".tga", ".hdr", ".ppm", ".pgm",  ".pnm", ".pfm", ".jp2",  ".jxl", ".avif", ".heic",
        ".svg", ".pdf", ".mp4", ".m4v",  ".mov", ".mkv", ".avi",  ".webm"};
    std::string ending = std::filesystem::path(out).extension();
    if (ending == ".png") return;
    std::ranges::transform(ending, ending.begin(),
                           [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    std::error_code error;
    if (std::ranges::count(kEndings, ending) == 0 || std::filesystem::is_directory(out, error))
        return;
    if (ending == ".exr")
        refuse("--out: a folder, or a .png file beside which --exr writes an .exr file");
    refuse(
        fmt::format("--out: {}: files of this kind cannot be written; give a .png file (--exr "
                    "writes OpenEXR beside it) or a folder",
                    in_quotes(out)));
}

void check_shading(const Options& options) {
    using morphray::Shading;
    const ShadingOptions& given = options.shading;
    const bool is_lit = given.shading ? *given.shading == Shading::lit : !options.rays_given;
    if (options.rays_given && given.shading && *given.shading != Shading::plain)
        refuse("--rays, --shading: --rays is for --shading plain; leave one of them out");
    check_image_name(options.out);
    if (options.ao_samples_given && options.view.ao_count == 0 && !is_lit)
        refuse("--ao-samples 0: only --shading lit goes without ambient occlusion");
    if (!options.hits.empty() && given.ground)
        refuse("--hits, --ground: a file of hits has room for one mesh; leave one of them out");
    if (!options.hits.empty() && given.samples.value_or(1) != 1)
        refuse(
            "--hits, --samples: a file of hits has one camera ray a pixel; leave one of them out");
}

/// Runs that go on render the same images as one run: with a tree that depends on the frames
/// before, colours by the tree would differ.
void check_skipping(const Options& options) {
    using morphray::Shading;
    if (!options.skip_existing) return;
    if (!options.hits.empty() && !options.hits.ends_with('/'))
        refuse(
            "--skip-existing, --hits: one file has the hits of all frames; give a folder, such as "
            "hits/, for a file each frame");
    const Shading shading = options.shading.shading.value_or(Shading::plain);
    if (shows_tree(shading) && !options.tree.has_policy(PolicyKind::kRefit) &&
        !options.tree.has_policy(PolicyKind::kRebuild))
        refuse(
            fmt::format("--skip-existing, --shading {}: these colours depend on the frames before; "
                        "choose --update refit or rebuild",
                        name_of(shading)));
}

void check_view(const Options& options) {
    check_shading(options);
    if (!options.screenshot.empty() && !options.screenshot.ends_with(".png"))
        refuse("--screenshot: a .png file");
}

/// probe needs frame and pixel.
void check_probe(const Options& options) {
    for (const auto& [name, given] :
         {std::pair("--frame", options.frame_given || !options.time.empty()),
          std::pair("--pixel", options.pixel_given)}) {
        if (given) continue;
        throw Error(ErrorKind::kBadArgument,
                    fmt::format("{} is required; see `morphray probe --help`", name));
    }
}

}  // namespace

void check_conflicts(const Options& options) {
    if (!options.time.empty() && !options.frames.empty())
        refuse("--time, --frames: both choose frames; leave one of them out");
    if (options.command == Command::kRender) {
        check_shading(options);
        check_skipping(options);
    }
    if (options.command == Command::kView) check_view(options);
    if (options.command == Command::kProbe) check_probe(options);
    if (options.tree.has_policy(PolicyKind::kRebuild) && options.tree.refit_on != RefitOn::kOwn) {
        throw Error(ErrorKind::kBadArgument,
                    "--update rebuild, --refit-on: a tree that is rebuilt is not refitted; leave "
                    "one of them out");
    }
    if (!options.policies.empty() && options.tree.update)
        refuse("--policies, --update: --policies lists all policies; leave --update out");
    if (options.tolerance_given && options.baseline.empty())
        refuse("--tolerance: by how much a stage may be slower than in --baseline; give that too");
    if (!options.baseline.empty() && (!options.policies.empty() || options.tree.update))
        refuse("--baseline: compares the times of stages, not policies; leave --policies out");
    if (options.backend.all_devices &&
        (!options.backend.device.empty() || options.backend.choice == BackendChoice::kCpu)) {
        throw Error(ErrorKind::kBadArgument,
                    fmt::format("--devices all, {}: the one compares what the other leaves out; "
                                "leave one of them out",
                                options.backend.device.empty() ? "--backend cpu" : "--device"));
    }
    const char* taken_by = nullptr;
    for (const auto& [name, file] :
         {std::pair("--json", &options.json), std::pair("--junit", &options.junit),
          std::pair("--html", &options.html), std::pair("--csv", &options.csv)}) {
        if (!is_stdout(*file)) continue;
        if (taken_by != nullptr) {
            throw Error(ErrorKind::kBadArgument,
                        fmt::format("{}, {}: both go to stdout, which takes one report; give one "
                                    "of them a file",
                                    taken_by, name));
        }
        taken_by = name;
    }
}

}  // namespace mray::app
