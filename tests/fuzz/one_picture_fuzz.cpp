// one_picture_fuzz: looks for cases in which instruction sets, trees, numbers of threads or devices
// give different images or answers. `tests/fuzz/fuzz` builds and runs it.
#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <csignal>
#include <cstdio>
#include <exception>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "app/base/messages.h"
#include "common/base/errors.h"
#include "common/frame_times.h"
#include "cpu/cpu_backend.h"
#include "tests/fuzz/generate.h"
#include "tests/fuzz/judge/judge.h"

namespace mray::fuzz {
namespace {

struct FuzzOptions {
    bool asks_questions = false;
    std::string backend = "cpu";
    std::uint64_t seed = 1;
    std::uint64_t cases = 2000;
    /// 0: a number of cases.
    double hours = 0;
    std::uint64_t most_failures = 10;
    std::optional<std::uint64_t> only_case;
    std::string out = "out/fuzz";
    /// Those of replay.
    std::vector<std::string> files;
};

/// What is tried, for the handler of signals.
std::array<char, 256> current_case = {};

void note_case(const std::string& name) {
    const std::string text = fmt::format("CRASH in {}\n", name);
    current_case.fill('\0');
    text.copy(current_case.data(), current_case.size() - 1);
}

void tell_case(int signal) {
    std::size_t size = 0;
    while (current_case[size] != '\0') ++size;
    [[maybe_unused]] const ssize_t written = write(STDERR_FILENO, current_case.data(), size);
    std::signal(signal, SIG_DFL);
    raise(signal);
}

void handle_crashes() {
    // Sanitizers report crashes themselves.
#ifndef MORPHRAY_SANITIZED
    for (const int signal : {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT})
        std::signal(signal, tell_case);
#endif
}

/// Tries cases on the variants of a backend.
class Campaign {
public:
    Campaign(const FuzzOptions& options, bool is_on_vulkan)
        : options_(options),
          backend_(is_on_vulkan ? "vulkan" : "cpu"),
          brute_(cpu::make_brute_backend({.threads = 1})),
          variants_(is_on_vulkan ? vulkan_variants() : cpu_variants()),
          referee_(*brute_) {}

    bool run() {
        if (!options_.files.empty()) {
            replay();
        } else if (options_.only_case) {
            for (const auto& group : variants_.groups) try_seed(*options_.only_case, group);
        } else {
            try_seeds();
        }
        fmt::print("{}\n", summary());
        return tally_.failed_cases == 0;
    }

private:
    bool is_over() const {
        return tally_.failed_cases >= options_.most_failures || app::interrupted();
    }

    /// Cases alternate between the groups of variants.
    void try_seeds() {
        constexpr double kMsPerHour = 3.6e6;
        constexpr double kMsPerMessage = 5000;
        const double ms = options_.hours * kMsPerHour / (options_.backend == "all" ? 2 : 1);
        double next_message = kMsPerMessage;
        for (std::uint64_t index = 0; !is_over(); ++index) {
            if (ms > 0 ? watch_.ms() >= ms : index >= options_.cases) break;
            try_seed(case_seed(options_.seed, index),
                     variants_.groups[index % variants_.groups.size()]);
            if (watch_.ms() < next_message) continue;
            next_message = watch_.ms() + kMsPerMessage;
            fmt::print(stderr, "fuzz: {}\n", summary());
        }
    }

    void try_seed(std::uint64_t seed, std::span<const Variant> group) {
        const std::string name =
            fmt::format("{}{}-{}", options_.asks_questions ? "questions-" : "", backend_, seed);
        note_case(name);
        FuzzCase fuzz_case = options_.asks_questions ? make_questions(seed) : make_case(seed);
        fuzz_case.rays = with_ends_at_hits(*brute_, fuzz_case);
        const std::vector<Finding> findings = check_case(referee_, fuzz_case, group, tally_);
        if (!findings.empty())
            report_failure({options_.out, name, backend_}, fuzz_case, findings.front(), referee_);
    }

    void replay() {
        for (const std::string& file : options_.files) {
            note_case(file);
            const FuzzCase fuzz_case = read_case_file(file);
            for (const auto& group : variants_.groups) {
                for (const Finding& finding : check_case(referee_, fuzz_case, group, tally_))
                    fmt::print("{} on {}: {}\n", file, backend_, describe(finding));
            }
        }
    }

    std::string summary() const {
        return fmt::format(
            "{}: {} cases ({} whose view is refused), {} rays, {:.1f} s, {} cases differ", backend_,
            tally_.cases, tally_.refused, tally_.rays, watch_.ms() / 1000, tally_.failed_cases);
    }

    const FuzzOptions& options_;
    std::string backend_;
    std::unique_ptr<Backend> brute_;
    Variants variants_;
    Referee referee_;
    Tally tally_;
    Stopwatch watch_;
};

void add_options(CLI::App& app, FuzzOptions& options) {
    constexpr std::uint64_t kMost = std::numeric_limits<std::uint64_t>::max();
    app.footer(
        "Failures go to stdout, each with a command line that shows it; progress goes to stderr.\n"
        "Exit codes: 0 no difference, 1 a difference, 2 usage, 3 bad input, 4 no Vulkan device,\n"
        "5 output cannot be written, 70 internal error, 130 and 143 interrupted.");
    app.require_subcommand(1);
    for (const char* const name : {"one-picture", "questions", "replay"}) {
        CLI::App* const command = app.add_subcommand(name);
        command->add_option("--backend", options.backend, "what is compared with brute force")
            ->check(CLI::IsMember({"cpu", "vulkan", "all"}))
            ->capture_default_str();
        if (name == std::string("replay")) {
            command->add_option("FILE", options.files, "text files of cases")->required();
            continue;
        }
        command->add_option("--out", options.out, "where failures go")->capture_default_str();
        command->add_option("--seed", options.seed, "seed of the cases")->capture_default_str();
        command->add_option("--cases", options.cases, "cases to try")->capture_default_str();
        command->add_option("--failures", options.most_failures, "end after so many failures")
            ->check(CLI::Range(std::uint64_t{1}, kMost))
            ->capture_default_str();
        command->add_option("--hours", options.hours, "try cases for this many hours")
            ->check(CLI::PositiveNumber);
        command->add_option("--case", options.only_case, "only the case of this seed");
    }
}

int run(const FuzzOptions& options) {
    app::handle_signals();
    handle_crashes();
    bool is_good = true;
    if (options.backend != "vulkan") is_good = Campaign(options, false).run();
    if (options.backend != "cpu" && !app::interrupted())
        is_good = Campaign(options, true).run() && is_good;
    app::throw_if_interrupted();
    return static_cast<int>(is_good ? app::ExitCode::kOk : app::ExitCode::kCheckFailed);
}

}  // namespace
}  // namespace mray::fuzz

int main(int argc, char** argv) {
    mray::fuzz::FuzzOptions options;
    CLI::App app("Compares answers of tracers, trees and numbers of threads with brute force.",
                 "fuzz");
    mray::fuzz::add_options(app, options);
    try {
        app.parse(argc, argv);
    } catch (const CLI::ParseError& error) {
        return app.exit(error) == 0 ? 0 : static_cast<int>(mray::app::ExitCode::kUsage);
    }
    options.asks_questions = app.got_subcommand("questions");
    try {
        return mray::fuzz::run(options);
    } catch (const mray::Error& error) {
        fmt::print(stderr, "fuzz: {}\n", error.what());
        return static_cast<int>(mray::app::exit_code_of(error.kind()));
    } catch (const std::exception& error) {
        fmt::print(stderr, "fuzz: internal error: {}\n", error.what());
        return static_cast<int>(mray::app::ExitCode::kInternal);
    }
}
