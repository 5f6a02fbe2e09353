#include "app/cli/command_line.h"

#include <CLI/CLI.hpp>

#include "app/base/messages.h"
#include "common/version.h"

namespace mray::app {
namespace {

constexpr std::size_t kTextColumn = 30;
/// The heading of the options that --help has.
constexpr const char* kEveryday = "Options";

constexpr const char* kFooter =
    "`morphray help COMMAND` lists the everyday options of a command, `morphray COMMAND "
    "--help-all` all of them; `morphray info` lists the built-in scenes.\n\n"
    "Exit codes: 0 ok, 1 a check failed, 2 usage, 3 bad input, 4 backend or device unavailable, "
    "5 output cannot be written, 6 out of memory or over a limit, 7 device lost, 8 partial result "
    "kept, 70 internal error, 129 ended by SIGHUP, 130 ended by SIGINT (Ctrl-C), 143 ended by "
    "SIGTERM.";

/// CLI11's help in 80 columns.
class HelpFormatter : public CLI::Formatter {
public:
    HelpFormatter() {
        column_width(kTextColumn);
        label("Positionals", "Arguments");
        label("SUBCOMMAND", "COMMAND");
    }

    /// --help has the everyday options alone.
    std::string make_help(const CLI::App* app, std::string name,
                          CLI::AppFormatMode mode) const override {
        std::string groups;
        for (const std::string& group : app->get_groups()) {
            if (mode == CLI::AppFormatMode::Normal && group != kEveryday) continue;
            groups += make_group(group, false, app->get_options([&](const CLI::Option* option) {
                return option->nonpositional() && option->get_group() == group;
            }));
        }
        return make_description(app) + make_usage(app, name) + make_positionals(app) + groups +
               make_subcommands(app, mode) + '\n' + make_footer(app);
    }
    std::string make_option_opts(const CLI::Option* option) const override {
        const std::string text = option->get_option_text();
        return (text.empty() ? "" : ' ' + text) + (option->get_required() ? " REQUIRED" : "");
    }
    std::string make_option_desc(const CLI::Option* option) const override {
        return wrapped(option->get_description(), 0, kColumns - kTextColumn);
    }
    std::string make_subcommand(const CLI::App* sub) const override {
        std::ostringstream out;
        CLI::detail::format_help(out, sub->get_name(),
                                 wrapped(sub->get_description(), 0, kColumns - kTextColumn),
                                 kTextColumn);
        return out.str();
    }
};

// ---- Kinds of options. All targets must outlive the parse.

[[noreturn]] void refuse(const std::string& message) {
    throw Error(ErrorKind::kBadArgument, message);
}

/// The heading, in --help-all, of the options that are added from here on.
void heading(CLI::App& command, const char* text) { command.option_defaults()->group(text); }

/// A text that is not empty.
CLI::Option* add_text(CLI::App& command, const char* names, const std::string& value_name,
                      const std::string& help, std::string& target) {
    return command.add_option(names, target, help)
        ->option_text(value_name)
        ->check([](const std::string& text) {
            return std::string(text.empty() ? "the value is empty" : "");
        });
}

/// An option whose value is parse(text), which may throw Error.
template <class Target, class Parse>
CLI::Option* add_parsed(CLI::App& command, const char* names, const std::string& value_name,
                        const std::string& help, Target& target, Parse parse) {
    const auto set = [names, parse, &target](const std::string& text) {
        try {
            target = parse(text);
        } catch (const Error& error) {
            throw CLI::ValidationError(names, error.what());
        }
    };
    return command.add_option_function<std::string>(names, set, help)->option_text(value_name);
}

template <class T, std::size_t N, class Target>
CLI::Option* add_choice(CLI::App& command, const char* names, const std::string& help,
                        const Choice<T> (&choices)[N], Target& target) {
    return add_parsed(command, names, names_of(choices), help, target,
                      [&choices](const std::string& text) { return value_in(choices, text); });
}

template <class Target>
CLI::Option* add_count(CLI::App& command, const char* names, const std::string& help,
                       Target& target, std::int64_t lower, std::int64_t upper) {
    return command.add_option(names, target, help)
        ->option_text("N")
        ->check(CLI::Range(lower, upper));
}

/// Two whole numbers of at least `lower`, with a separator between.
CLI::Option* add_pair(CLI::App& command, const char* name, const char* value_name,
                      const std::string& help, char separator, std::int64_t lower,
                      std::uint32_t& first, std::uint32_t& second) {
    const auto set = [=, &first, &second](const std::string& text) {
        constexpr std::int64_t kMost = std::numeric_limits<std::uint32_t>::max();
        const std::size_t end = std::min(text.find(separator), text.size() - 1);
        const std::int64_t a = parse_integer(text.substr(0, end)).value_or(-1);
        const std::int64_t b = parse_integer(text.substr(end + 1)).value_or(-1);
        if (std::min(a, b) < lower || std::max(a, b) > kMost)
            throw CLI::ValidationError(name, fmt::format("{} is not {}, such as 640{}480",
                                                         quote(text), value_name, separator));
        first = static_cast<std::uint32_t>(a);
        second = static_cast<std::uint32_t>(b);
    };
    return command.add_option_function<std::string>(name, set, help)->option_text(value_name);
}

/// Any number, also one that is not finite; camera_setup decides whether it is usable.
double parse_number(std::string_view text) {
    const std::optional<double> value = parse_double(text);
    if (!value) refuse(quote(text) + " is not a number");
    return *value;
}

/// A finite number of at least `lower`.
double parse_finite(const std::string& text, double lower) {
    const double value = parse_number(text);
    if (!std::isfinite(value) || value < lower)
        refuse(fmt::format("{} is not a finite number of at least {}", quote(text), lower));
    return value;
}

double parse_frame(const std::string& text) {
    constexpr double kLeast = -1e9;
    return parse_finite(text, kLeast);
}

morphray::Point parse_point(const std::string& text) {
    const std::vector<std::string_view> parts = split(text, ',');
    if (parts.size() != 3) refuse(quote(text) + " is not a point x,y,z");
    return {parse_number(parts[0]), parse_number(parts[1]), parse_number(parts[2])};
}

/// "refit|rebuild|...": the forms of all policies.
std::string update_forms() { return fmt::format("{}", fmt::join(policy_forms(), "|")); }

// ---- The options by their heading in --help-all, each of the commands that have it.

bool is_one_of(const Options& options, std::string_view commands) {
    return std::ranges::count(split(commands, ' '), options.command) > 0;
}

constexpr const char* kWithImage = "render view crosscheck probe profile";
constexpr const char* kWithBackend = "render view crosscheck probe profile trace query";
constexpr const char* kWithSource = "render view crosscheck probe profile trace query info";

void add_scene_options(CLI::App& command, Options& options) {
    const auto is = [&](const char* commands) { return is_one_of(options, commands); };
    SourceOptions& source = options.source;
    CLI::Option* scene = nullptr;
    if (is("diff"))
        command.add_option("FILES", options.inputs, "the expected hits, and the other")
            ->required()
            ->expected(2);
    if (is("crosscheck"))
        command.add_option("SCENES", options.inputs, "what to trace, one after the other");
    if (is("chart"))
        command.add_option("SCENES", options.inputs, "what to trace, at the middle frame")
            ->required();
    if (is(kWithSource) && !is("crosscheck"))
        scene = add_text(command, "SCENE", "",
                         "builtin:NAME[:TRIANGLES], a mesh file (.obj, .ply), a folder of such "
                         "files, a pattern such as frame_%04d.obj, or a .gltf or .glb file",
                         source.scene)
                    ->required(!is("info"))
                    ->type_name("");
    heading(command, "Scene");
    if (is(kWithSource)) {
        command.add_flag("--skip-missing", source.skip_missing,
                         "interpolate missing frames of a sequence, which are an error otherwise");
        add_text(command, "--cache", "FILE",
                 "point cache (PC2) with the positions of a mesh file's vertices", source.cache);
        add_text(command, "--animation", "NAME|INDEX", "animation of a glTF file (the first)",
                 source.animation);
        constexpr double kLeastFps = 1e-3;
        add_parsed(command, "--fps", "N", "frames a second of a glTF file (24)", source.fps,
                   [](const std::string& text) { return parse_finite(text, kLeastFps); });
    }
    if (is(kWithSource) || is("chart"))
        command.add_flag(
            "--lenient", source.lenient,
            "accept vertices that are not finite, and leave out faces that are invalid");
    if (is("render crosscheck profile query"))
        add_text(command, "--frames,--frame", "F|A..B[:STEP],...|all",
                 fmt::format("frames, in increasing order; fractions lie between whole frames ({})",
                             is("render")  ? "all whole frames"
                             : is("query") ? "the first; several for crossings alone"
                                           : "the first, those at a quarter and a half, the last"),
                 options.frames);
    if (is("view probe trace info"))
        add_parsed(
            command, "--frame,--frames", "F",
            is("probe") ? "the frame" : "the frame; fractions lie between whole frames (the first)",
            options.frame, parse_frame)
            ->required(is("probe"));
    if (is("info")) command.get_option("--frame")->needs(scene);
    if (is("probe"))
        add_pair(command, "--pixel", "X,Y", "the pixel, from the upper left corner", ',', 0,
                 options.pixel.x, options.pixel.y)
            ->required();
}

/// With the defaults of this command.
void add_image_options(CLI::App& command, Options& options) {
    const bool can_be_lit = is_one_of(options, "render view");
    morphray::View& view = options.view;
    heading(command, "Image");
    add_pair(command, "--size", "WxH",
             fmt::format("size of the image in pixels ({}x{})", view.width, view.height), 'x', 1,
             view.width, view.height);
    add_parsed(command, "--eye", "X,Y,Z", "position of the camera", view.eye, parse_point);
    add_parsed(command, "--target", "X,Y,Z", "point that the camera looks at", view.target,
               parse_point);
    add_parsed(command, "--up", "X,Y,Z", "upwards in the image (0,1,0)", view.up, parse_point);
    add_parsed(command, "--fov", "DEGREES", "vertical field of view (45)", view.fov, parse_number);
    add_parsed(command, "--light", "X,Y,Z", "point light", view.light, parse_point);
    const int least_ao = can_be_lit ? 0 : 1;
    add_count(command, "--ao-samples",
              fmt::format("ambient-occlusion rays a camera ray, {} to 256 ({})", least_ao,
                          can_be_lit ? "8 with lit, else 16" : "16"),
              view.ao_count, least_ao, 256);
    add_parsed(command, "--ao-distance", "LENGTH",
               "length of ambient-occlusion rays (a quarter of the scene's diagonal)",
               view.ao_distance, [](const std::string& text) { return parse_finite(text, 0); });
    if (options.command == "crosscheck") {
        add_parsed(command, "--rays", names_of(kRays), "what each pixel traces (all three)",
                   options.rays,
                   [](const std::string& text) { return std::vector{value_in(kRays, text)}; });
        return;
    }
    CLI::Option* const rays =
        add_choice(command, "--rays",
                   fmt::format("what each pixel traces ({})",
                               can_be_lit ? "those of --shading lit" : "primary"),
                   kRays, view.rays);
    if (!can_be_lit) return;
    add_choice(command, "--shading",
               "what colours show (lit): light and sky, one colour, normals, "
               "depths, triangles (prim)",
               kShadings, view.shading)
        ->excludes(rays);
    add_choice(command, "--samples",
               options.command == "render"
                   ? "camera rays a pixel (4 with lit and without --hits, else 1)"
                   : "camera rays a pixel of a still image (16; 4 with lit and --screenshot)",
               kSampleCounts, view.samples);
    command.add_flag("--flat", view.flat, "without smooth normals");
    add_choice(command, "--ground",
               "a plane below the scene that shows shadows (on with lit for files, without "
               "--hits and --exr)",
               kOnOff, options.ground);
}

void add_backend_options(CLI::App& command, Options& options) {
    const auto is = [&](const char* commands) { return is_one_of(options, commands); };
    BackendOptions& backend = options.backend;
    heading(command, "Backend");
    if (is("crosscheck"))
        add_choice(command, "--backend", "what traces (all)", kCheckedBackends, backend.choice);
    else
        add_choice(command, "--backend",
                   is("trace query") ? "what traces (cpu)"
                   : is("profile")
                       ? "what traces (auto: the CPU, and Vulkan where there is a device)"
                       : "what traces (auto: Vulkan where there is a GPU, else the CPU)",
                   kBackends, backend.choice);
    add_text(command, "--device", "DEVICE",
             "Vulkan device: its index, a part of its name, or its UUID (see `devices`)",
             backend.device);
    add_count(command, "--threads", "CPU threads, 1 to 1024 (as many as the machine has)",
              backend.threads, 1, 1024);
    add_parsed(command, "--simd", "NAME",
               "CPU instruction set (the best one; see `info`), or off: the scalar reference",
               backend.simd, [](const std::string& text) {
                   check_simd(text);
                   return text;
               });
    command.add_flag("--validate", backend.validate, "run under the Vulkan validation layer");
    heading(command, "Tree");
    if (is("render view probe profile"))
        add_parsed(command, "--build-at", "FRAME",
                   "frame whose positions the tree is built at (the first frame)",
                   options.tree.build_at, parse_frame);
    if (is("probe"))
        add_parsed(command, "--update", "refit|rebuild",
                   "how the tree follows the vertices (refit)", options.tree.update, parse_policy);
    if (is("render view"))
        add_parsed(
            command, "--update", update_forms(),
            "how the tree follows the vertices (auto): boxes computed again, a new tree for each "
            "frame or every K, or what pays",
            options.tree.update, parse_policy);
}

void add_crosscheck_options(CLI::App& command, Options& options) {
    command.add_flag(
        "--digest", options.digest,
        "instead of scenes, compare one number for each device with that of all others");
    add_choice(command, "--reference",
               "what the others are compared with (auto: brute force where that "
               "takes seconds, else the CPU)",
               kReferences, options.brute_reference);
    add_count(command, "--queries",
              "also compare all hits, insides and closest triangles of N rays and points",
              options.query_count, 1, 1'000'000);
    add_text(command, "--junit", "FILE|-", "a JUnit report; - is stdout", options.junit);
    add_text(command, "--html", "FILE|-", "a page that needs no network; - is stdout",
             options.html);
}

void add_profile_options(CLI::App& command, Options& options) {
    add_count(command, "--repeat", "runs whose median is reported (10; of policies 5)",
              options.repeat, 1, 10000);
    add_parsed(command, "--policies", update_forms() + ",...",
               "update policies to compare, over all whole frames", options.policies,
               [](const std::string& text) {
                   std::vector<PolicySpec> parsed;
                   for (const std::string_view part : split(text, ','))
                       parsed.push_back(parse_policy(std::string(part)));
                   return parsed;
               });
    add_text(command, "--csv", "FILE|-", "the table as comma-separated values; - is stdout",
             options.csv);
}

void add_trace_options(CLI::App& command, Options& options) {
    add_text(command, "--rays", "FILE|-",
             "a line `ox oy oz dx dy dz [tnear tfar [prim_id]]` for each ray, or an array "
             "(.npy)",
             options.ray_file)
        ->required();
    add_text(command, "-o,--out", "FILE|-",
             "a line for each ray: `H t prim u v` (prim: the triangle's number) or `M`, a miss",
             options.out)
        ->required();
    command.add_flag("--binary", options.binary_rays,
                     "rays are 8 little-endian floats each: org, tnear, dir, tfar");
    CLI::Option* const all = command.add_flag(
        "--all", options.all_hits,
        "all hits of each ray, nearest first: a line `R hits left-out`, then those");
    add_count(command, "--max-hits", "the most hits of a ray that are written (all)",
              options.hit_lists.max_hits, 1, std::numeric_limits<std::uint32_t>::max())
        ->needs(all);
    add_choice(command, "--crossing",
               "which triangles a ray hits that goes through an edge or a vertex: the first of a "
               "mesh (once), each, or one of those that it passes through (owner)",
               kCrossings, options.hit_lists.crossing)
        ->needs(all);
}

void add_query_options(CLI::App& command, Options& options) {
    add_text(command, "--points", "FILE|-", "a line `x y z` for each point, or an array (.npy)",
             options.point_file);
    add_parsed(command, "--ask", names_of(kQuestions) + ",...", kQuestionsHelp, options.questions,
               [](const std::string& text) {
                   std::vector<Question> questions;
                   for (const std::string_view part : split(text, ',')) {
                       questions.push_back(value_in(kQuestions, part));
                       if (std::ranges::count(questions, questions.back()) > 1)
                           refuse(std::string(part) + " is given twice");
                   }
                   return questions;
               })
        ->required();
    command.add_flag("--count", options.counts_only,
                     "of crossings: only a line `frame pairs` for each frame");
    add_choice(command, "--rule",
               "which points are inside: those that meshes wind around, or those with an odd "
               "number of crossings (nonzero)",
               kFillRules, options.rule);
    add_parsed(command, "--max-distance", "LENGTH", "how far the surface may be (any distance)",
               options.max_distance, [](const std::string& text) {
                   constexpr double kMost = std::numeric_limits<float>::max();
                   return static_cast<float>(std::min(parse_finite(text, 0), kMost));
               });
    add_text(command, "-o,--out", "FILE|-", "the lines of answers (stdout)", options.out);
}

void add_output_options(CLI::App& command, Options& options) {
    const auto is = [&](const char* commands) { return is_one_of(options, commands); };
    heading(command, "Output");
    if (is("render")) {
        add_choice(command, "--exr", "also OpenEXR files, with linear colours and depths",
                   kExrColours, options.exr);
        add_text(command, "-o,--out", "DIR|FILE.png", "folder of the images, or one image (out)",
                 options.out);
        add_text(command, "--hits", "FILE", "file of the raw hits of all frames", options.hits);
    }
    if (is("view")) {
        command.add_flag("--play", options.plays, "begin to play at once");
        add_text(command, "--screenshot", "FILE.png",
                 "write the first image that is complete, and end", options.screenshot);
    }
    if (is("crosscheck")) add_crosscheck_options(command, options);
    if (is("profile")) add_profile_options(command, options);
    if (is("trace")) add_trace_options(command, options);
    if (is("query")) add_query_options(command, options);
    if (is("chart")) {
        add_text(command, "-o,--out", "DIR", "a folder that does not exist yet or is empty",
                 options.out)
            ->required();
        command.add_flag("--quick", options.quick, "fewer rays and runs");
    }
    if (is("info")) {
        command.add_flag("--bvh", options.tree_facts, "build the tree and describe it")
            ->needs(command.get_option("SCENE"));
        command.add_flag("--crossings", options.crossing_count, "count triangles that cross")
            ->needs(command.get_option("SCENE"));
    }
    if (is("devices"))
        command.add_flag("--check", options.checks,
                         "compare rays, shading and refit of each device with the CPU's");
    if (is("render crosscheck profile info devices"))
        add_text(command, "--json", "FILE|-", "a report for programs; - is stdout", options.json);
    if (is("info")) command.get_option("--json")->needs(command.get_option("SCENE"));
    if (is("render view crosscheck diff profile trace query chart"))
        command.add_flag("-q,--quiet", options.quiet, "neither table nor progress");
    if (is("render view probe"))
        command.add_flag("-v,--verbose", options.verbose, "say what is used and decided");
}

Options defaults_of(const std::string& command) {
    Options options{.command = command};
    if (is_one_of(options, "render view")) {
        options.view.shading = morphray::Shading::lit;
        options.tree.update = {PolicyKind::kAuto};
    }
    if (command == "view") {
        options.view.width = 1280;
        options.view.height = 720;
    }
    if (command == "crosscheck") options.view.width = options.view.height = 256;
    if (is_one_of(options, "trace query")) options.backend.choice = BackendChoice::kCpu;
    if (command == "render") options.out = "out";
    if (command == "query") options.out = "-";
    return options;
}

// ---- What completes the options after the parse.

/// Refuses names of files for an --out that names a folder; `advice` says what to give.
void refuse_file_name(const std::string& out, const char* advice) {
    for (const char* ending :
         {".png", ".jpg", ".jpeg", ".bmp", ".tga", ".tif", ".tiff", ".exr", ".svg", ".pdf", ".html",
          ".mp4", ".gif", ".webp", ".webm", ".mov", ".mkv", ".avi"})
        if (is_stdout(out) || lower_case(out).ends_with(ending))
            refuse(fmt::format("--out: {} is no name of a folder; {}", quote(out), advice));
}

/// Of render and view.
void complete_image(const CLI::App& command, Options& options) {
    using morphray::Shading;
    morphray::View& view = options.view;
    if (command.count("--rays") > 0) view.shading = Shading::plain;
    const bool is_lit = view.shading == Shading::lit;
    constexpr std::uint32_t kLitAoCount = 8;
    if (is_lit && command.count("--ao-samples") == 0) view.ao_count = kLitAoCount;
    if (!is_lit && view.ao_count == 0)
        refuse("--ao-samples 0: only --shading lit goes without ambient occlusion");
    if (command.count("--samples") == 0) view.samples = is_lit && options.hits.empty() ? 4 : 1;
    if (options.command == "view") {
        // A still image goes on to be refined; a screenshot is what render writes.
        if (options.screenshot.empty() && command.count("--samples") == 0) view.samples = 16;
        options.plays = options.plays && options.screenshot.empty();
        if (!options.screenshot.empty() && !lower_case(options.screenshot).ends_with(".png"))
            refuse("--screenshot: give a .png file");
        return;
    }
    if (!options.ground && (!options.hits.empty() || options.exr)) options.ground = false;
    if (!options.hits.empty() && (*options.ground || view.samples != 1))
        refuse(
            "--hits: a file of hits has one camera ray a pixel and one mesh; leave --samples and "
            "--ground out");
    if (options.exr && !is_lit) refuse("--exr: only --shading lit has linear colours");
    if (!lower_case(options.out).ends_with(".png"))
        refuse_file_name(options.out,
                         "give a .png file, or a folder, of which ffmpeg makes a video as "
                         "docs/guide/start.md shows");
}

void complete(const CLI::App& command, Options& options) {
    const BackendOptions& backend = options.backend;
    if (is_one_of(options, "render view")) complete_image(command, options);
    if (options.command == "chart") refuse_file_name(options.out, "give a folder");
    if (is_one_of(options, "trace query") && (!backend.device.empty() || backend.validate) &&
        (backend.choice == BackendChoice::kCpu || backend.choice == BackendChoice::kBrute))
        refuse("--device, --validate: nothing runs on a device; choose --backend vulkan");
    if (options.command == "query") {
        const bool asks_crossings =
            std::ranges::count(options.questions, Question::kCrossings) != 0;
        if (asks_crossings && options.questions.size() > 1)
            refuse("--ask: crossings are no question about points; ask for them alone");
        if (asks_crossings != options.point_file.empty())
            refuse(asks_crossings ? "--points: crossings need none" : "--points is required");
        if (options.counts_only && !asks_crossings) refuse("--count goes with --ask crossings");
    }
    if (options.command != "crosscheck") return;
    if (!options.digest && options.inputs.empty()) refuse("SCENES is required, or --digest");
    constexpr std::string_view kOfDigest[] = {"--digest", "--backend",  "--device", "--threads",
                                              "--simd",   "--validate", "--quiet"};
    for (const CLI::Option* const option : command.get_options())
        if (options.digest && option->count() > 0 &&
            std::ranges::find(kOfDigest, option->get_name()) == std::end(kOfDigest))
            refuse("--digest has a scene of its own; leave out " + option->get_name());
}

/// `everyday` names the options of --help; without any, --help has all.
struct CommandText {
    const char* name;
    const char* help;
    std::string_view everyday;
    const char* examples;
};

constexpr CommandText kCommandTexts[] = {
    {"render", "Writes an image of each frame",
     "--frames --out --size --eye --target --light --shading --samples --ground --backend",
     "  morphray render builtin:cloth --frames 0..24:8 --out cloth\n"
     "  morphray render builtin:twist --frame 12 --samples 1 --out twist.png"},
    {"view", "A window that shows the scene move, and how it is traced",
     "--frame --play --size --eye --target --light --shading --ground --backend --screenshot",
     "  morphray view builtin:cloth --play\n"
     "  morphray view builtin:cloth --frame 8 --screenshot cloth.png"},
    {"crosscheck", "Compares every backend and tree with a reference, bit by bit",
     "--digest --frames --size --eye --target --backend --queries --html --junit --json",
     "  morphray crosscheck builtin:cloth:500 --html crosscheck.html\n"
     "  morphray crosscheck builtin:spikes --backend cpu --queries 100"},
    {"diff", "Compares two files of hits bit by bit", "",
     "  morphray render builtin:cloth --frame 8 --hits a.hits\n"
     "  morphray render builtin:cloth --frame 8 --backend cpu --simd off --hits b.hits\n"
     "  morphray diff a.hits b.hits"},
    {"probe", "Describes one pixel: its ray, its hit, the triangles that it could hit",
     "--frame --pixel --size --eye --target --rays --backend --update --build-at",
     "  morphray probe builtin:cloth --frame 8 --pixel 512,600"},
    {"profile", "Measures deforming, refitting, building and tracing",
     "--frames --size --rays --backend --repeat --policies --csv --json",
     "  morphray profile builtin:cloth --backend cpu --frames 0..24:12\n"
     "  morphray profile builtin:twist --policies refit,auto --csv policies.csv"},
    {"trace", "Traces the rays of a file, and writes their hits to a file",
     "--frame --backend --rays --out --binary --all --max-hits --crossing",
     "  echo 0 9 0 0 -1 0 | morphray trace builtin:cloth --rays - --out -\n"
     "  echo 0 9 0 0 -1 0 | morphray trace builtin:cloth --rays - --out - --all"},
    {"query", "Says where the points of a file are, or which triangles cross",
     "--frames --backend --points --ask --count --rule --max-distance --out",
     "  echo 0 1 0 | morphray query builtin:spikes --points - --ask inside,distance\n"
     "  echo 0 1 0 | morphray query builtin:cloth --frame 8 --points - --ask closest\n"
     "  morphray query builtin:herd --frames all --ask crossings --count"},
    {"chart", "Draws charts of speed against accuracy, as images and data", "",
     "  morphray chart builtin:cloth --out charts --quick"},
    {"info", "Describes a scene; without a scene, this program", "",
     "  morphray info builtin:cloth --bvh"},
    {"devices", "Lists the Vulkan devices, and tests them", "", "  morphray devices --check"}};

void add_command(CLI::App& app, ParsedCommandLine& parsed, const CommandText& text) {
    CLI::App& command = *app.add_subcommand(text.name, text.help)->group("Commands");
    command.footer(std::string("Examples:\n") + text.examples);
    if (!text.everyday.empty()) command.set_help_all_flag("--help-all", "print all options");
    const auto options = std::make_shared<Options>(defaults_of(text.name));
    add_scene_options(command, *options);
    if (is_one_of(*options, kWithImage)) add_image_options(command, *options);
    if (is_one_of(*options, kWithBackend)) add_backend_options(command, *options);
    add_output_options(command, *options);
    if (text.everyday.empty())
        for (CLI::Option* const option : command.get_options()) option->group(kEveryday);
    else
        for (const std::string_view one : split(text.everyday, ' '))
            command.get_option(std::string(one))->group(kEveryday);
    command.callback([&command, &parsed, options] {
        complete(command, *options);
        parsed.options = *options;
    });
}

}  // namespace

ParsedCommandLine parse_command_line(std::span<const std::string> arguments) {
    std::vector<std::string> line(arguments.begin(), arguments.end());
    // `help COMMAND` is `COMMAND --help`.
    if (!line.empty() && line.front() == "help") {
        line.erase(line.begin());
        line.emplace_back("--help");
    }
    ParsedCommandLine parsed;
    CLI::App app("Ray tracer for triangle scenes that deform.", "morphray");
    app.require_subcommand(1);
    app.formatter(std::make_shared<HelpFormatter>());
    app.set_help_flag("-h,--help", "print this help");
    app.footer(wrapped(kFooter));
    app.set_version_flag("-v,--version", fmt::format("morphray {}", kVersionDetail),
                         "print the version");
    for (const CommandText& text : kCommandTexts) add_command(app, parsed, text);
    std::reverse(line.begin(), line.end());
    try {
        app.parse(line);
    } catch (const CLI::Success& success) {
        std::ostringstream out;
        app.exit(success, out, out);
        return {std::nullopt, out.str()};
    } catch (const CLI::ParseError& error) {
        const std::vector<CLI::App*> chosen = app.get_subcommands();
        // CLI11 misses a command before it says which word is none.
        const std::vector<std::string> extras = app.remaining(true);
        const std::string command = chosen.empty() ? "" : chosen.front()->get_name() + ' ';
        if (!extras.empty() && !extras[0].starts_with('-') && !chosen.empty() &&
            chosen.front()->get_option_no_throw("SCENE") != nullptr)
            refuse(
                fmt::format("{} is one argument too many: {}takes one SCENE; put a pattern of "
                            "files in quotes, which keep it from the shell",
                            quote(extras[0]), command));
        refuse(fmt::format("{}; see `morphray {}--help`",
                           extras.empty() ? error.what() : "unknown argument " + quote(extras[0]),
                           command));
    }
    if (parsed.options) parsed.options->arguments.assign(arguments.begin(), arguments.end());
    return parsed;
}

}  // namespace mray::app
