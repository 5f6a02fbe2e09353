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
#include <filesystem>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "app/base/messages.h"
#include "common/base/errors.h"
#include "common/base/output_file.h"
#include "common/frame_times.h"
#include "common/simd/simd_target.h"
#include "cpu/cpu_backend.h"
#include "tests/fuzz/judge.h"
#ifdef MORPHRAY_HAS_VULKAN
#include "gpu/shared_device.h"
#endif

namespace mray::fuzz {
namespace {

/// The variants of a process. They are made once, because each backend owns threads or a device.
struct Variants {
    std::vector<std::unique_ptr<Backend>> backends;
    /// Cases alternate between the groups.
    std::vector<std::vector<Variant>> groups;
};

/// Every instruction set of this machine and the scalar tracer (`off`), on 1 and on 2 threads, over
/// each kind of tree.
Variants cpu_variants() {
    Variants variants;
    variants.groups.resize(2);
    const auto add = [&](const std::string& simd, int threads, TreeKind tree, std::size_t group) {
        variants.backends.push_back(cpu::make_cpu_backend({.threads = threads, .simd = simd}));
        variants.groups[group].push_back(
            {variants.backends.back().get(),
             fmt::format("cpu {}, {}", simd, threads == 1 ? "1 thread" : "2 threads"), tree});
    };
    std::vector<std::string> names = {std::string(kSimdOff)};
    for (const SimdTarget& target : supported_simd_targets()) names.emplace_back(target.name);
    int turn = 0;
    for (const std::string& simd : names) {
        for (const std::size_t group : {0, 1}) {
            const int threads = group == 0 ? 1 : 2;
            add(simd, threads, TreeKind::kRefitted, group);
            add(simd, 3 - threads, TreeKind::kRebuilt, group);
        }
        // These cost more than the others, so each group has half of them.
        add(simd, 1, TreeKind::kAuto, static_cast<std::size_t>(turn++ % 2));
    }
    return variants;
}

#ifdef MORPHRAY_HAS_VULKAN
/// The device with the default tuning, and with one that suspends rays often. The environment sets
/// the width of its vectors.
Variants vulkan_variants() {
    // Suspends and resumes rays a few times; doing so at every step would take long.
    constexpr std::uint32_t kShortBudget = 24;
    Variants variants;
    // Making a backend takes seconds, because kernels are compiled.
    const auto add_device = [&](const gpu::Tuning& tuning) {
        variants.backends.push_back(
            cpu::with_host_answers(gpu::make_vulkan_backend({}, tuning), best_simd_target()));
    };
    add_device({});
    gpu::Tuning tuning;
    tuning.step_budget = kShortBudget;
    add_device(tuning);
    Backend* const device = variants.backends[0].get();
    Backend* const tuned = variants.backends[1].get();
    const Variant refitted{device, "vulkan", TreeKind::kRefitted};
    const Variant rebuilt{device, "vulkan", TreeKind::kRebuilt};
    const Variant kept{device, "vulkan", TreeKind::kAuto};
    const Variant suspended{tuned, "vulkan with a short budget", TreeKind::kRefitted};
    variants.groups = {{refitted, rebuilt, suspended}, {refitted, kept, suspended}};
    return variants;
}
#else
Variants vulkan_variants() {
    throw Error(ErrorKind::kUnavailable,
                "Vulkan: not built in; use --backend cpu, or build with -DMORPHRAY_VULKAN=ON");
}
#endif

/// The rays of a case, and each of those that hit again with tnear and with tfar at its hit, or if
/// it asks questions one of its hits, and at the floats next to it.
std::vector<WorldRay> with_ends_at_hits(Backend& brute, const FuzzCase& fuzz_case) {
    constexpr std::uint32_t kMostHits = 16;
    const FuzzScene scene(fuzz_case);
    brute.set_scene(scene.topology, scene.pose, scene.rebuilt);
    std::vector<WorldRay> all = fuzz_case.rays;
    for (const WorldRay& world : fuzz_case.rays) {
        const SceneRay ray = to_scene(scene.space, world);
        if (!ray.valid) continue;
        HitLists lists;
        brute.query(ListQuery{{&ray.ray, 1}, Crossing::kEach, kMostHits, lists});
        if (lists.hits.empty()) continue;
        // Questions are asked about all hits.
        const Hit hit = lists.hits[fuzz_case.asks_questions ? all.size() % lists.hits.size() : 0];
        const float t[] = {hit.t, std::nextafter(hit.t, 0.0f), std::nextafter(hit.t, kInfiniteT)};
        for (const float end : t) {
            const double world_t = std::ldexp(static_cast<double>(end), ray.t_exponent);
            WorldRay bounded = world;
            bounded.tnear = world_t;
            bounded.tfar = std::max(world.tfar, world_t);
            all.push_back(bounded);
            bounded.tnear = std::min(world.tnear, world_t);
            bounded.tfar = world_t;
            all.push_back(bounded);
        }
    }
    return all;
}

/// Takes the image, triangles, rays and points from a case that it can lose and still fail.
class Shrinker {
public:
    Shrinker(const FuzzCase& failing, const Finding& finding, Referee& referee)
        : best_(failing), finding_(finding), referee_(referee), what_(describe(finding)) {}

    void shrink() {
        FuzzCase smaller = best_;
        smaller.view.width = smaller.view.height = 0;
        if (best_.has_image()) take(std::move(smaller));
        lose(&FuzzCase::triangles);
        lose(&FuzzCase::rays);
        lose(&FuzzCase::points);
    }
    const FuzzCase& best() const { return best_; }
    /// How the smallest case fails.
    const std::string& what() const { return what_; }

private:
    /// Takes the case if it fails in the way of the finding.
    bool take(FuzzCase smaller) {
        if (trials_ == 0) return false;
        --trials_;
        Tally ignored;
        for (const Finding& found :
             check_case(referee_, smaller, std::span(finding_.variant, 1), ignored)) {
            if (found.answer.asked != finding_.answer.asked) continue;
            what_ = describe(found);
            best_ = std::move(smaller);
            return true;
        }
        return false;
    }

    /// Loses all things of a kind, then halves, then ever smaller parts.
    template <class Thing>
    void lose(std::vector<Thing> FuzzCase::*things) {
        for (std::size_t part = (best_.*things).size(); part > 0; part /= 2) {
            for (std::size_t first = 0; first < (best_.*things).size();) {
                FuzzCase smaller = best_;
                const std::size_t n = std::min(part, (best_.*things).size() - first);
                const auto from = (smaller.*things).begin() + static_cast<std::ptrdiff_t>(first);
                (smaller.*things).erase(from, from + static_cast<std::ptrdiff_t>(n));
                if (!take(std::move(smaller))) first += n;
            }
        }
    }

    FuzzCase best_;
    const Finding& finding_;
    Referee& referee_;
    std::string what_;
    std::size_t trials_ = 3000;
};

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
        if (!findings.empty()) report_failure(name, fuzz_case, findings.front());
    }

    void report_failure(const std::string& name, const FuzzCase& fuzz_case,
                        const Finding& finding) {
        Shrinker shrinker(fuzz_case, finding, referee_);
        shrinker.shrink();
        const std::filesystem::path path = std::filesystem::path(options_.out) / name / "case.txt";
        make_output_folder(path.parent_path());
        write_file(path, to_text(shrinker.best(), "failed: " + shrinker.what()));
        fmt::print("FAILED {}\n{}\n./fuzz replay {} --backend {}\n\n", name, shrinker.what(),
                   path.string(), backend_);
        std::fflush(stdout);
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
