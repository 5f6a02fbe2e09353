#include "app/cli/options/answer_commands.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "app/base/numbers.h"
#include "app/cli/options/option_groups.h"
#include "common/base/errors.h"
#include "common/text/text_parts.h"

namespace mray::app {
namespace {

constexpr const char* kCpuUnlessAsked = "cpu; with --device or --validate vulkan";

// All lines work as they are (test Help.ExamplesWork).
constexpr Example kTraceExamples[] = {
    {"One ray straight down", "echo 0 9 0 0 -1 0 | morphray trace builtin:cloth --rays - --out -"},
    {"All triangles that it passes through",
     "echo 0 9 0 0 -1 0 | morphray trace builtin:cloth --rays - --out - --all"},
};
constexpr Example kQueryExamples[] = {
    {"Whether a point is inside, and how far it is from the surface",
     "echo 0 1 0 | morphray query builtin:spikes --points - --ask inside,distance"},
    {"The closest points at a frame, for programs",
     "echo 0 1 0 | morphray query builtin:cloth --frame 8 --points - --ask closest"},
};

std::vector<Question> parse_questions(const std::string& option, const std::string& text) {
    std::vector<Question> questions;
    for (const std::string_view part : split(text, ',')) {
        questions.push_back(parse_choice<Question>(option, std::string(part), kQuestions));
        if (std::ranges::count(questions, questions.back()) > 1) {
            throw Error(ErrorKind::kBadArgument,
                        fmt::format("{}: {} is given twice", option, part));
        }
    }
    return questions;
}

}  // namespace

CommandSpec define_trace(Options& options) {
    CommandSpec command{"trace", "Traces the rays of a file, and writes their hits to a file",
                        Command::kTrace, kTraceExamples};
    const OptionAdder adder(command, options);
    add_scene(adder, true);
    adder.added("--allow-empty").help = "no effect: trace accepts a scene without triangles";
    adder.added("--lenient").help = "no effect: trace always is lenient";
    add_frame(adder, kFirstFrame);
    adder
        .add_text("--rays", "FILE|-", "a line `ox oy oz dx dy dz [tnear tfar]` for each ray",
                  options.ray_file)
        .required = true;
    adder.add_text("-o,--out", "FILE|-", "a line `H t prim u v` or `M` for each ray", options.out)
        .required = true;
    add_answer_form(adder);
    adder.add_flag("--binary", "rays are 8 little-endian floats each", options.binary_rays);
    adder.add_flag("--all",
                   "all hits of each ray, nearest first: a line `R hits left-out`, then those",
                   options.all_hits);
    adder.add("--max-hits", "N", "with --all, the most hits of a ray that are written (all)",
              [&options](const std::string& option, const std::string& value) {
                  options.hit_lists.max_hits = static_cast<std::uint32_t>(
                      parse_count(option, value, 1, std::numeric_limits<std::uint32_t>::max()));
              });
    adder.add_choice("--crossing",
                     "with --all, which triangles a ray hits that goes through an edge or a "
                     "vertex: each, or one of those that it passes through (owner)",
                     kCrossings, options.hit_lists.crossing);
    add_backend_options(adder, kBackends, kCpuUnlessAsked);
    add_progress(adder);
    adder.add_flag("-q,--quiet", "no progress", options.quiet);
    return command;
}

CommandSpec define_query(Options& options) {
    CommandSpec command{"query", "Says where the points of a file are: inside, how far, closest to",
                        Command::kQuery, kQueryExamples};
    const OptionAdder adder(command, options);
    add_scene(adder, true, "what to ask");
    add_frame(adder, kFirstFrame);
    adder.add_text("--points", "FILE|-", "a line `x y z` for each point", options.point_file)
        .required = true;
    adder
        .add("--ask", names_of<Question>(kQuestions) + ",...",
             "what is answered, in this order: 0 or 1; a whole number; a distance, negative "
             "inside; `x y z distance prim u v feature`",
             [&options](const std::string& option, const std::string& value) {
                 options.questions = parse_questions(option, value);
             })
        .required = true;
    adder.add_choice("--rule",
                     "which points are inside: those that meshes wind around, or those with an "
                     "odd number of crossings (nonzero)",
                     kFillRules, options.rule);
    adder.add("--max-distance", "LENGTH", "how far the surface may be (any distance)",
              [&options](const std::string& option, const std::string& value) {
                  const double length = parse_finite(option, value, 0);
                  constexpr float kMost = std::numeric_limits<float>::max();
                  options.max_distance = static_cast<float>(std::min<double>(length, kMost));
              });
    adder.add_text("-o,--out", "FILE|-", "a line of answers for each point (stdout)", options.out);
    add_answer_form(adder);
    add_backend_options(adder, kBackends, kCpuUnlessAsked);
    command.set_defaults = [&options] { options.out = std::string("-"); };
    add_progress(adder);
    adder.add_flag("-q,--quiet", "no progress", options.quiet);
    return command;
}

}  // namespace mray::app
