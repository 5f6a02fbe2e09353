#include "tests/fuzz/run/options.h"

#include <fmt/format.h>

#include <limits>

#include "app/base/numbers.h"
#include "common/base/errors.h"

namespace mray::fuzz {
namespace {

[[noreturn]] void usage(const std::string& what) {
    throw Error(ErrorKind::kBadArgument, what + "; see --help");
}

constexpr std::uint64_t kMostCount = std::numeric_limits<std::uint64_t>::max() - 1;

void choose_backends(const std::string& option, const std::string& value, FuzzOptions& options) {
    if (value != "cpu" && value != "vulkan" && value != "all")
        usage(fmt::format("{}: '{}' is not one of cpu, vulkan, all", option, value));
    options.cpu = value != "vulkan";
    options.vulkan = value != "cpu";
}

/// Reads `option`'s value into `options`. Returns false for an option that the mode does not have.
bool read_option(const std::string& option, const std::string& value, FuzzOptions& options) {
    const auto count = [&](std::uint64_t lower, std::uint64_t upper) {
        return app::parse_count(option, value, lower, upper);
    };
    const bool traces = options.mode != Mode::kReplay;
    const bool sweeps = options.mode == Mode::kSweep;
    const bool makes = traces && !sweeps;
    if (option == "--backend") {
        choose_backends(option, value, options);
    } else if (option == "--out" && traces) {
        options.out = value;
    } else if (option == "--seed" && traces) {
        options.seed = count(0, kMostCount);
    } else if (option == "--cases" && traces) {
        options.cases = count(1, kMostCount);
    } else if (option == "--failures" && traces) {
        options.most_failures = count(1, kMostCount);
    } else if (option == "--jobs" && traces) {
        options.jobs = static_cast<std::uint32_t>(count(1, 64));
    } else if (option == "--hours" && makes) {
        options.hours = app::parse_finite(option, value, 0);
        if (options.hours == 0) usage("--hours: give more than 0");
    } else if (option == "--case" && makes) {
        options.only_case = count(0, kMostCount + 1);
    } else if (option == "--every" && sweeps) {
        options.every = static_cast<std::uint32_t>(count(1, 1u << 30));
    } else if (option == "--frame" && sweeps) {
        options.frame = app::parse_finite(option, value, 0);
    } else if (option == "--size" && sweeps) {
        const app::Size size = app::parse_size(option, value);
        options.width = size.width;
        options.height = size.height;
    } else {
        return false;
    }
    return true;
}

void take_argument(const std::string& argument, FuzzOptions& options) {
    if (options.mode == Mode::kReplay) {
        options.files.push_back(argument);
    } else if (options.mode == Mode::kSweep && options.scene.empty()) {
        options.scene = argument;
    } else {
        usage(fmt::format("unexpected argument '{}'", argument));
    }
}

Mode parse_mode(const std::string& word) {
    if (word == "one-picture") return Mode::kOnePicture;
    if (word == "questions") return Mode::kQuestions;
    if (word == "calls") return Mode::kCalls;
    if (word == "sweep") return Mode::kSweep;
    if (word == "replay") return Mode::kReplay;
    usage(fmt::format("'{}' is not one of one-picture, questions, calls, sweep, replay", word));
}

}  // namespace

std::optional<FuzzOptions> parse_fuzz_options(std::span<const std::string> arguments) {
    for (const std::string& argument : arguments)
        if (argument == "--help" || argument == "-h") return std::nullopt;
    if (arguments.empty())
        usage("the mode is missing: one-picture, questions, calls, sweep SCENE or replay FILE");
    FuzzOptions options;
    options.mode = parse_mode(arguments.front());
    for (std::size_t i = 1; i < arguments.size(); ++i) {
        const std::string& argument = arguments[i];
        if (!argument.starts_with("-")) {
            take_argument(argument, options);
        } else if (argument == "--list" && options.mode != Mode::kReplay) {
            options.only_list = true;
        } else if (i + 1 == arguments.size()) {
            usage(fmt::format("'{}' is unknown, or its value is missing", argument));
        } else if (!read_option(argument, arguments[++i], options)) {
            usage(fmt::format("'{}' is no option of {}", argument, arguments.front()));
        }
    }
    if (options.mode == Mode::kSweep && options.scene.empty())
        usage("sweep: the scene is missing: builtin:NAME[:TRIANGLES], an .obj file or a folder");
    if (options.mode == Mode::kReplay && options.files.empty())
        usage("replay: give the text files of cases");
    const bool makes = options.mode != Mode::kSweep && options.mode != Mode::kReplay;
    if (makes && options.hours == 0 && options.cases == 0) options.cases = 2000;
    return options;
}

const char* fuzz_help() {
    return R"(usage: fuzz one-picture [OPTIONS]    random cases compared with brute force
       fuzz questions [OPTIONS]      all hits, windings, closest points of random cases
       fuzz calls [OPTIONS]          random calls of the library compared with a model
       fuzz sweep SCENE [OPTIONS]    eyes in the planes of a scene's triangles
       fuzz replay FILE... [--backend B]    cases from text files, such as the corpus

Compares hits, occlusion and pixels bit by bit: each instruction set of the CPU, on 1 and 2 threads,
over refitted, rebuilt and updated trees; on Vulkan each width of lavapipe's vectors. `questions`
compares answers about single rays and points, also those of the library. `calls` plays sequences of
calls of the library: scenes that are built, changed, updated, copied and asked.

  --backend cpu|vulkan|all   backends to compare with the reference (cpu)
  --seed S        seed of the cases (1)
  --cases N       cases to try (2000, unless --hours is given), or eyes of a sweep (all)
  --failures N    end after this many failures (10)
  --jobs N        processes that share the CPU's cases, 1 to 64 (2); Vulkan has one for each width
  --list          print a line for each failure; neither shrink nor write it
  --out DIR       where failures are written (out/fuzz)
  one-picture, questions and calls:
  --hours N       try cases for this many hours
  --case SEED     only the case of this seed, as a failure's name has it
  sweep:
  --every N       every N-th triangle (1)
  --frame F       the frame of the scene (0)
  --size WxH      size of the images (16x16)

Failures go to stdout, each with a command line that shows it; progress goes to stderr.
Exit codes: 0 no difference, 1 a difference or a crash, 2 usage, 3 bad input, 4 no Vulkan device,
5 output cannot be written, 70 internal error, 130 and 143 interrupted.
)";
}

}  // namespace mray::fuzz
