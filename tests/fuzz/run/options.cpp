#include "tests/fuzz/run/options.h"

#include <CLI/CLI.hpp>
#include <limits>

#include "app/terminal/failure.h"

namespace mray::fuzz {
namespace {

constexpr std::uint64_t kMostCount = std::numeric_limits<std::uint64_t>::max();
constexpr const char* kFooter =
    "Failures go to stdout, each with a command line that shows it; progress goes to stderr.\n"
    "Exit codes: 0 no difference, 1 a difference or a crash, 2 usage, 3 bad input, 4 no Vulkan\n"
    "device, 5 output cannot be written, 70 internal error, 130 and 143 interrupted.";

void add_mode(CLI::App& app, Mode mode, const char* name, const char* what, std::string& backend,
              FuzzOptions& options) {
    CLI::App* const command = app.add_subcommand(name, what);
    command->add_option("--backend", backend, "backends to compare with the reference (cpu)")
        ->check(CLI::IsMember({"cpu", "vulkan", "all"}));
    command->callback([mode, &options] { options.mode = mode; });
    if (mode == Mode::kReplay) {
        command->add_option("FILE", options.files, "text files of cases")->required();
        return;
    }
    command->add_option("--out", options.out, "where failures are written (out/fuzz)");
    command->add_option("--seed", options.seed, "seed of the cases (1)");
    command->add_option("--cases", options.cases, "cases to try (2000)")
        ->check(CLI::Range(std::uint64_t{1}, kMostCount));
    command->add_option("--failures", options.most_failures, "end after this many failures (10)")
        ->check(CLI::Range(std::uint64_t{1}, kMostCount));
    command->add_option("--hours", options.hours, "try cases for this many hours")
        ->check(CLI::PositiveNumber);
    command->add_option("--case", options.only_case, "only the case of this seed");
}

}  // namespace

ParsedFuzzOptions parse_fuzz_options(int count, char** arguments) {
    ParsedFuzzOptions parsed;
    FuzzOptions& options = parsed.options;
    std::string backend = "cpu";
    CLI::App app(
        "Compares answers bit by bit: instruction sets of the CPU, widths of lavapipe's vectors,\n"
        "trees and numbers of threads with brute force.",
        "fuzz");
    app.footer(kFooter);
    app.set_help_flag();
    app.set_help_all_flag("-h,--help", "print this");
    app.require_subcommand(1);
    add_mode(app, Mode::kOnePicture, "one-picture", "random images", backend, options);
    add_mode(app, Mode::kQuestions, "questions", "all hits, windings, closest points", backend,
             options);
    add_mode(app, Mode::kReplay, "replay", "cases from text files", backend, options);
    try {
        app.parse(count, arguments);
    } catch (const CLI::ParseError& error) {
        const bool is_help = app.exit(error) == 0;
        parsed.exit_code = is_help ? 0 : static_cast<int>(app::ExitCode::kUsage);
    }
    options.cpu = backend != "vulkan";
    options.vulkan = backend != "cpu";
    if (options.hours == 0 && options.cases == 0) options.cases = 2000;
    return parsed;
}

}  // namespace mray::fuzz
