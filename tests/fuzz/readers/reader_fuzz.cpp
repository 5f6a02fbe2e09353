// reader_fuzz TARGET [--seed N] [--cases N] [--hours N] [--out DIR] FILE...: gives a target the
// files, and bytes made of them by changes, in N cases or for N hours. Prints the seed of a case
// that fails and writes its bytes to DIR, also after a crash. Exit codes: 0 all good, 1 a failure,
// 2 usage.
#include <fcntl.h>
#include <fmt/format.h>
#include <sys/resource.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>
#include <vector>

#include "common/frame_times.h"
#include "tests/fuzz/readers/targets.h"
#include "tests/support/temporary_folder.h"

namespace mray::fuzz {
namespace {

// Sanitizers report crashes and limit memory themselves.
#ifdef MORPHRAY_SANITIZED
constexpr bool kIsSanitized = true;
#else
constexpr bool kIsSanitized = false;
#endif

/// A file may claim 4 GiB, and must not get them.
constexpr rlim_t kMostMemory = rlim_t{3} << 30;

struct Options {
    std::string target;
    std::uint64_t seed = 1;
    std::uint64_t cases = 0;
    double hours = 0;
    std::string out = "out/fuzz";
    std::vector<std::string> files;
};

/// The case that runs, for the handler of signals.
struct {
    std::array<char, 4096> path = {};
    const char* bytes = nullptr;
    std::size_t size = 0;
} current_case;

/// Keeps the bytes that end the process.
void keep_case(int signal) {
    const int fd = open(current_case.path.data(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
    constexpr std::string_view kMessage = "a crash; its bytes are in the folder of --out\n";
    [[maybe_unused]] ssize_t written = write(STDERR_FILENO, kMessage.data(), kMessage.size());
    written = write(fd, current_case.bytes, current_case.size);
    std::signal(signal, SIG_DFL);
    raise(signal);
}

void handle_crashes(const Options& options) {
    const std::string path = fmt::format("{}/{}-crash", options.out, options.target);
    path.copy(current_case.path.data(), current_case.path.size() - 1);
    if (kIsSanitized) return;
    for (const int signal : {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT})
        std::signal(signal, keep_case);
    const rlimit memory = {kMostMemory, kMostMemory};
    setrlimit(RLIMIT_AS, &memory);
}

/// Tries one case. False, with a message, if it fails.
bool is_good(const Options& options, const std::string& bytes, const std::string& which) {
    current_case.bytes = bytes.data();
    current_case.size = bytes.size();
    const Target& target = *std::ranges::find(kTargets, options.target, &Target::name);
    const std::string failure = target.failure_of(bytes);
    if (failure.empty()) return true;
    const std::string path =
        fmt::format("{}/{}-{:x}", options.out, options.target, std::hash<std::string>()(bytes));
    std::ofstream(path, std::ios::binary) << bytes;
    fmt::print(stderr, "{} of {}: {}; written to {}\n", which, options.target, failure, path);
    return false;
}

int run(const Options& options) {
    std::vector<std::string> corpus;
    for (const std::string& file : options.files) {
        corpus.push_back(test::read_file(file));
        if (!is_good(options, corpus.back(), file)) return 1;
    }
    constexpr double kMsPerHour = 3.6e6;
    const Stopwatch clock;
    std::uint64_t tried = 0;
    while (tried < options.cases || clock.ms() < options.hours * kMsPerHour) {
        const std::uint64_t seed = options.seed + tried++;
        Dice dice(seed);
        const std::string& file = corpus[dice.below(static_cast<std::uint32_t>(corpus.size()))];
        if (!is_good(options, mutated(file, dice), fmt::format("seed {}", seed))) return 1;
    }
    fmt::print("{}: {} files, {} cases: all good\n", options.target, corpus.size(), tried);
    return 0;
}

}  // namespace
}  // namespace mray::fuzz

int main(int count, char** arguments) {
    using namespace mray::fuzz;
    Options options;
    std::vector<std::string> names;
    for (const Target& target : kTargets) names.emplace_back(target.name);
    CLI::App app("Gives a reader files, and bytes made of them by changes.", "reader_fuzz");
    app.add_option("TARGET", options.target)->required()->check(CLI::IsMember(names));
    app.add_option("FILE", options.files)->required();
    app.add_option("--seed", options.seed);
    app.add_option("--cases", options.cases);
    app.add_option("--hours", options.hours);
    app.add_option("--out", options.out);
    try {
        app.parse(count, arguments);
    } catch (const CLI::ParseError& error) {
        return app.exit(error) == 0 ? 0 : 2;
    }
    std::filesystem::create_directories(options.out);
    handle_crashes(options);
    return run(options);
}
