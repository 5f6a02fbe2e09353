// The command line of one_picture_fuzz.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace mray::fuzz {

enum class Mode { kOnePicture, kQuestions, kCalls, kSweep, kReplay };

struct FuzzOptions {
    Mode mode = Mode::kOnePicture;
    bool cpu = true;
    bool vulkan = false;
    std::uint64_t seed = 1;
    /// 0: not given.
    std::uint64_t cases = 0;
    double hours = 0;
    std::uint64_t most_failures = 10;
    std::uint32_t jobs = 2;
    std::optional<std::uint64_t> only_case;
    bool only_list = false;
    std::string out = "out/fuzz";

    // sweep
    std::string scene;
    std::uint32_t every = 1;
    double frame = 0;
    std::uint32_t width = 16;
    std::uint32_t height = 16;

    // replay
    std::vector<std::string> files;
};

/// Returns nothing for --help. Throws Error(kBadArgument) with the problem and the remedy.
std::optional<FuzzOptions> parse_fuzz_options(std::span<const std::string> arguments);

/// The text of --help.
const char* fuzz_help();

}  // namespace mray::fuzz
