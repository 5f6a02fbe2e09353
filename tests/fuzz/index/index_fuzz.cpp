// index_fuzz [--seed N] [--cases N] FILE...: reads index files, and N files that random changes
// make of each. Every file must be refused as bad input, or be written again with the same bytes.
// Checksums of changed files are made right, so that what stands behind them is tried. Exit code 1
// and the seed of a case if one is not.
#include <fmt/format.h>

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <random>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/errors.h"
#include "common/base/input_file.h"
#include "common/scene/formats/index/clip_index.h"
#include "tests/support/index_bytes.h"

namespace mray::test {
namespace {

using Bytes = std::vector<std::byte>;

bool is_right(const Bytes& bytes) {
    try {
        return encode_index(decode_index(bytes)) == bytes;
    } catch (const Error& error) {
        return error.kind() == ErrorKind::kBadInput;
    }
}

/// One to four changes: a byte, a number of 8 bytes with a value at a limit, a cut, bytes twice.
Bytes changed(Bytes bytes, std::uint64_t seed) {
    std::mt19937_64 random(seed);
    const auto below = [&](std::size_t n) { return static_cast<std::size_t>(random() % n); };
    for (std::size_t change = 1 + below(4); change > 0 && bytes.size() > 16; --change) {
        const std::size_t at = below(bytes.size() - 8);
        const auto from = bytes.begin() + static_cast<std::ptrdiff_t>(at);
        switch (below(4)) {
            case 0:
                bytes[at] = static_cast<std::byte>(random());
                break;
            case 1: {
                constexpr std::uint64_t kValues[] = {0,          1,          2,          0x7FC00000,
                                                     0x7F800000, 1ull << 32, 1ull << 63, ~0ull};
                std::memcpy(&bytes[at], &kValues[below(std::size(kValues))], 8);
                break;
            }
            case 2:
                bytes.erase(from, from + static_cast<std::ptrdiff_t>(1 + below(8)));
                break;
            default: {
                const Bytes twice(from, from + 8);
                bytes.insert(from, twice.begin(), twice.end());
            }
        }
    }
    if (bytes.size() >= 8 && below(8) != 0) set_checksum(bytes);
    return bytes;
}

int run(const std::vector<std::string>& arguments) {
    std::uint64_t seed = 1;
    std::uint64_t cases = 0;
    std::vector<std::string> files;
    for (std::size_t i = 0; i < arguments.size(); ++i) {
        const bool has_value = i + 1 < arguments.size();
        if (arguments[i] == "--seed" && has_value) {
            seed = std::stoull(arguments[++i]);
        } else if (arguments[i] == "--cases" && has_value) {
            cases = std::stoull(arguments[++i]);
        } else {
            files.push_back(arguments[i]);
        }
    }
    if (files.empty()) {
        fmt::print(stderr, "usage: index_fuzz [--seed N] [--cases N] FILE...\n");
        return 2;
    }
    for (const std::string& file : files) {
        const std::string text = read_input_file(file);
        const auto* const first = reinterpret_cast<const std::byte*>(text.data());
        const Bytes bytes(first, first + text.size());
        for (std::uint64_t i = 0; i <= cases; ++i) {
            if (is_right(i == 0 ? bytes : changed(bytes, seed + i))) continue;
            fmt::print(
                "{}: wrong{}\n", file,
                i == 0 ? "" : fmt::format(" when changed by --seed {} --cases 1", seed + i - 1));
            return 1;
        }
    }
    fmt::print("{} files, {} cases of each: all refused or written again\n", files.size(), cases);
    return 0;
}

}  // namespace
}  // namespace mray::test

int main(int count, char** arguments) {
    return mray::test::run({arguments + 1, arguments + count});
}
