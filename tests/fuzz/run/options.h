// The command line of one_picture_fuzz.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace mray::fuzz {

enum class Mode { kOnePicture, kQuestions, kReplay };

struct FuzzOptions {
    Mode mode = Mode::kOnePicture;
    bool cpu = true;
    bool vulkan = false;
    std::uint64_t seed = 1;
    /// 0: not given.
    std::uint64_t cases = 0;
    double hours = 0;
    std::uint64_t most_failures = 10;
    std::optional<std::uint64_t> only_case;
    std::string out = "out/fuzz";

    // replay
    std::vector<std::string> files;
};

struct ParsedFuzzOptions {
    FuzzOptions options;
    /// Nothing if the options are to be run; else the exit code of --help or of an error, which has
    /// been printed.
    std::optional<int> exit_code;
};
ParsedFuzzOptions parse_fuzz_options(int count, char** arguments);

}  // namespace mray::fuzz
