// The commands that trace images: render, view, crosscheck, probe and profile.
#include <fmt/format.h>

#include <CLI/CLI.hpp>

#include "app/cli/option_groups.h"
#include "common/text/text.h"

namespace mray::app {
namespace {

constexpr const char* kFewFrames = "the first, those at a quarter and a half, the last";
constexpr const char* kVulkanOrCpu = "auto: Vulkan where there is a GPU, else the CPU";

/// "refit|rebuild|...": the forms of all policies.
std::string update_forms() { return fmt::format("{}", fmt::join(policy_forms(), "|")); }

/// Adds the options that render and view share. Returns a function that fills in defaults.
auto add_image_options(CLI::App& command, ImageOptions& image, const char* size,
                       const char* samples_help) {
    add_scene(command, image.source)->required();
    add_view_options(command, image.view, size, 0, "8 with lit, else 16");
    CLI::Option* const rays = add_rays(command, image.view, "those of --shading lit");
    add_choice<morphray::Shading>(command, "--shading",
                                  "what colours show (lit): light and sky, one colour, normals, "
                                  "depths, triangles (prim), nodes and leaves that a ray enters "
                                  "(steps), cost of the tree's leaves (sah)",
                                  kShadings, image.view.shading)
        ->excludes(rays);
    CLI::Option* const samples = add_choice<std::uint32_t>(command, "--samples", samples_help,
                                                           kSampleCounts, image.view.samples);
    command.add_flag("--flat", image.view.flat, "without smooth normals");
    add_choice<bool>(command, "--ground",
                     "a plane below the scene that shows shadows (on with lit for files, without "
                     "--hits and --exr)",
                     kOnOff, image.ground);
    add_backend_options(command, image.backend, kBackends, kVulkanOrCpu);
    add_build_at(command, image.tree.build_at);
    add_parsed(
        command, "--update", update_forms(),
        "how the tree follows the vertices (auto): boxes computed again, a new tree for each "
        "frame or every K, or what pays",
        image.tree.update, parse_policy);
    heading(command, "Output");
    const CLI::Option* const ao_samples = command.get_option("--ao-samples");
    return [=, &image](std::uint32_t lit_samples) {
        using morphray::Shading;
        if (rays->count() > 0) image.view.shading = Shading::plain;
        const bool is_lit = image.view.shading == Shading::lit;
        constexpr std::uint32_t kLitAoCount = 8;
        if (is_lit && ao_samples->count() == 0) image.view.ao_count = kLitAoCount;
        if (!is_lit && image.view.ao_count == 0)
            refuse("--ao-samples 0: only --shading lit goes without ambient occlusion");
        if (samples->count() == 0) image.view.samples = is_lit ? lit_samples : 1;
    };
}

}  // namespace

void add_render(CommandAdder& adder) {
    adder.add<RenderOptions>(
        "render", "Writes an image of each frame",
        "--frames --out --size --eye --target --light --shading --samples --ground --backend",
        "  morphray render builtin:cloth --frames 0..24:8 --out cloth\n"
        "  morphray render builtin:twist --frame 12 --samples 1 --out twist.png",
        [&adder](CLI::App& command, RenderOptions& options) {
            const auto complete =
                add_image_options(command, options.image, "1024x1024",
                                  "camera rays a pixel (4 with lit and without --hits, else 1)");
            add_frames(command, options.frames, "all whole frames");
            add_choice<const char*>(command, "--exr",
                                    "also OpenEXR files, with linear colours and layers",
                                    kExrColours, options.image.exr);
            add_text(command, "-o,--out", "DIR|FILE.png",
                     "folder of the images, or one image (out)", options.out);
            add_text(command, "--hits", "FILE", "file of the raw hits of all frames", options.hits);
            add_json(command, options.json);
            adder.add_quiet(command);
            adder.add_verbose(command);
            return [complete, &options] {
                complete(options.hits.empty() ? 4 : 1);
                ImageOptions& image = options.image;
                const bool has_data = !options.hits.empty() || !image.exr.empty();
                if (!image.ground && has_data) image.ground = false;
                if (!options.hits.empty() && (*image.ground || image.view.samples != 1))
                    refuse(
                        "--hits: a file of hits has one camera ray a pixel and one mesh; leave "
                        "--samples and --ground out");
                if (!image.exr.empty() && image.view.shading != morphray::Shading::lit)
                    refuse("--exr: only --shading lit has linear colours");
                if (!lower_case(options.out).ends_with(".png"))
                    refuse_file_name(options.out,
                                     "give a .png file, or a folder, of which ffmpeg makes a video "
                                     "as docs/guide/start.md shows");
            };
        });
}

void add_view(CommandAdder& adder) {
    adder.add<ViewOptions>(
        "view", "A window that shows the scene move, and how it is traced",
        "--frame --play --size --eye --target --light --shading --ground --backend --screenshot",
        "  morphray view builtin:cloth --play\n"
        "  morphray view builtin:cloth --frame 8 --screenshot cloth.png",
        [&adder](CLI::App& command, ViewOptions& options) {
            const auto complete = add_image_options(
                command, options.image, "1280x720",
                "camera rays a pixel of a still image (16; 4 with lit and --screenshot)");
            add_frame(command, options.frame);
            command.add_flag("--play", options.plays, "begin to play at once");
            add_text(command, "--screenshot", "FILE.png",
                     "write the first image that is complete, and end", options.screenshot);
            adder.add_quiet(command);
            adder.add_verbose(command);
            const CLI::Option* const samples = command.get_option("--samples");
            return [=, &options] {
                // A still image goes on to be refined; a screenshot is what render writes.
                complete(4);
                if (options.screenshot.empty() && samples->count() == 0)
                    options.image.view.samples = 16;
                if (options.screenshot.empty()) return;
                options.plays = false;
                if (!lower_case(options.screenshot).ends_with(".png"))
                    refuse("--screenshot: give a .png file");
            };
        });
}

void add_crosscheck(CommandAdder& adder, std::span<const std::string> arguments) {
    adder.add<CrosscheckOptions>(
        "crosscheck", "Compares every backend and tree with a reference, bit by bit",
        "--frames --size --eye --target --rays --backend --queries --html --junit --json",
        "  morphray crosscheck builtin:cloth:500 --html crosscheck.html\n"
        "  morphray crosscheck builtin:spikes --backend cpu --queries 100",
        [&](CLI::App& command, CrosscheckOptions& options) {
            options.arguments.assign(arguments.begin(), arguments.end());
            command.add_option("SCENES", options.scenes, "what to trace, one after the other")
                ->required();
            add_source_options(command, options.source);
            add_frames(command, options.frames, kFewFrames);
            add_view_options(command, options.view, "256x256", 1, "16");
            add_choice<morphray::Rays>(command, "--rays", "what each pixel traces (all three)",
                                       kRays, options.rays);
            add_backend_options(command, options.backend, kCheckedBackends, "all");
            heading(command, "Output");
            add_choice<Reference>(command, "--reference",
                                  "what the others are compared with (auto: brute force where that "
                                  "takes seconds, else the CPU)",
                                  kReferences, options.reference);
            add_count(command, "--queries",
                      "also compare hits, windings and closest triangles of N rays and points",
                      options.query_count, 1, 1'000'000);
            add_text(command, "--junit", "FILE|-", "a JUnit report; - is stdout", options.junit);
            add_text(command, "--html", "FILE|-", "a page that needs no network; - is stdout",
                     options.html);
            add_json(command, options.json);
            adder.add_quiet(command);
            return kNothing;
        });
}

void add_probe(CommandAdder& adder) {
    adder.add<ProbeOptions>(
        "probe", "Describes one pixel: its ray, its hit, the triangles that it could hit",
        "--frame --pixel --size --eye --target --rays --backend --update --build-at",
        "  morphray probe builtin:cloth --frame 8 --pixel 512,600",
        [&adder](CLI::App& command, ProbeOptions& options) {
            add_scene(command, options.source)->required();
            add_parsed(command, "--frame,--frames", "F", "the frame", options.frame, parse_frame)
                ->required();
            add_pair(command, "--pixel", "X,Y", "the pixel, from the upper left corner", ',', 0,
                     options.pixel.x, options.pixel.y)
                ->required();
            add_view_options(command, options.view, "1024x1024", 1, "16");
            add_rays(command, options.view, "primary");
            add_backend_options(command, options.backend, kBackends, kVulkanOrCpu);
            add_build_at(command, options.tree.build_at);
            add_parsed(command, "--update", "refit|rebuild",
                       "how the tree follows the vertices (refit)", options.tree.update,
                       parse_policy);
            heading(command, "Output");
            adder.add_verbose(command);
            return kNothing;
        });
}

void add_profile(CommandAdder& adder) {
    adder.add<ProfileOptions>(
        "profile", "Measures deforming, refitting, building and tracing",
        "--frames --size --rays --backend --repeat --policies --plot --csv --json",
        "  morphray profile builtin:cloth --backend cpu --frames 0..24:12\n"
        "  morphray profile builtin:twist --policies refit,auto --csv policies.csv",
        [&adder](CLI::App& command, ProfileOptions& options) {
            add_scene(command, options.source)->required();
            add_frames(command, options.frames, kFewFrames);
            add_view_options(command, options.view, "1024x1024", 1, "16");
            add_rays(command, options.view, "primary");
            add_backend_options(command, options.backend, kBackends,
                                "auto: the CPU, and Vulkan where there is a device");
            add_build_at(command, options.tree.build_at);
            heading(command, "Output");
            add_count(command, "--repeat", "runs whose median is reported (10; of policies 5)",
                      options.repeat, 1, 10000);
            CLI::Option* const policies =
                add_parsed(command, "--policies", update_forms() + ",...",
                           "update policies to compare, over all whole frames", options.policies,
                           [](const std::string& text) {
                               std::vector<PolicySpec> parsed;
                               for (const std::string_view part : split(text, ','))
                                   parsed.push_back(parse_policy(std::string(part)));
                               return parsed;
                           });
            add_text(command, "--plot", "FILE.svg|.png", "charts of policies (needs gnuplot)",
                     options.plot)
                ->needs(policies);
            add_text(command, "--csv", "FILE|-", "the table as comma-separated values; - is stdout",
                     options.csv);
            add_json(command, options.json);
            adder.add_quiet(command);
            return kNothing;
        });
}

}  // namespace mray::app
