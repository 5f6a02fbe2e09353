// reader_fuzz TARGET [--seed N] [--cases N] [--hours N] [--out DIR] FILE...: gives a target
// (tests/fuzz/targets/targets.h) the files, and bytes made of them by N changes or for N hours.
// Prints the seed of a case that fails and writes its bytes to DIR, also after a crash. Exit codes:
// 0 all good, 1 a failure, 2 usage.
#include <fcntl.h>
#include <fmt/format.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/stopwatch.h"
#include "common/text/number_text.h"
#include "tests/fuzz/drivers/mutations.h"
#include "tests/fuzz/targets/targets.h"
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
    const Target* target = nullptr;
    std::uint64_t seed = 1;
    std::uint64_t cases = 0;
    double hours = 0;
    std::string out = "out/fuzz";
    std::vector<std::string> files;
};

std::optional<Options> parse(int count, char** arguments) {
    Options options;
    if (count < 2) return std::nullopt;
    const auto target = std::ranges::find(targets(), std::string_view(arguments[1]), &Target::name);
    if (target == targets().end()) return std::nullopt;
    options.target = &*target;
    for (int i = 2; i < count; ++i) {
        const std::string_view argument = arguments[i];
        if (!argument.starts_with("--")) {
            options.files.emplace_back(argument);
            continue;
        }
        if (++i == count) return std::nullopt;
        const auto number = parse_unsigned(arguments[i]);
        const auto hours = parse_double(arguments[i]);
        if (argument == "--out")
            options.out = arguments[i];
        else if (argument == "--seed" && number)
            options.seed = *number;
        else if (argument == "--cases" && number)
            options.cases = *number;
        else if (argument == "--hours" && hours)
            options.hours = *hours;
        else
            return std::nullopt;
    }
    if (options.files.empty()) return std::nullopt;
    return options;
}

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
    const std::string path = fmt::format("{}/{}-crash", options.out, options.target->name);
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
    const std::string failure = options.target->failure_of(bytes);
    if (failure.empty()) return true;
    const std::string path = fmt::format("{}/{}-{:x}", options.out, options.target->name,
                                         std::hash<std::string>()(bytes));
    std::ofstream(path, std::ios::binary) << bytes;
    fmt::print(stderr, "{} of {}: {}; written to {}\n", which, options.target->name, failure, path);
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
    fmt::print("{}: {} files, {} cases: all good\n", options.target->name, corpus.size(), tried);
    return 0;
}

}  // namespace
}  // namespace mray::fuzz

int main(int count, char** arguments) {
    using namespace mray::fuzz;
    const auto options = parse(count, arguments);
    if (!options) {
        fmt::print(stderr,
                   "usage: reader_fuzz TARGET [--seed N] [--cases N] [--hours N] [--out DIR] "
                   "FILE...\ntargets:");
        for (const Target& target : targets()) fmt::print(stderr, " {}", target.name);
        fmt::print(stderr, "\n");
        return 2;
    }
    std::filesystem::create_directories(options->out);
    handle_crashes(*options);
    return run(*options);
}
