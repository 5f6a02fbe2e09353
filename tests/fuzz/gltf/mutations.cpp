#include "tests/fuzz/gltf/mutations.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <string_view>

namespace mray::fuzz {
namespace {

constexpr std::size_t kGlbHead = 20;

std::size_t below(std::size_t limit, std::mt19937_64& random) {
    return limit == 0 ? 0 : random() % limit;
}

bool is_glb(std::string_view bytes) { return bytes.starts_with("glTF"); }

std::uint32_t word_at(std::string_view bytes, std::size_t at) {
    std::uint32_t word = 0;
    std::memcpy(&word, bytes.data() + at, sizeof word);
    return word;
}

/// Where the JSON ends.
std::size_t text_end(std::string_view bytes) {
    if (!is_glb(bytes) || bytes.size() < kGlbHead) return bytes.size();
    return std::min<std::size_t>(bytes.size(), kGlbHead + word_at(bytes, 12));
}

/// Gives a binary file the lengths that it has after its text has grown by `growth`.
void mend_lengths(std::string& bytes, std::ptrdiff_t growth) {
    if (!is_glb(bytes) || bytes.size() < kGlbHead) return;
    const auto size = static_cast<std::uint32_t>(bytes.size());
    const auto text =
        static_cast<std::uint32_t>(static_cast<std::ptrdiff_t>(word_at(bytes, 12)) + growth);
    std::memcpy(&bytes[8], &size, sizeof size);
    std::memcpy(&bytes[12], &text, sizeof text);
}

/// Replaces a number of the text.
void change_number(std::string& bytes, std::mt19937_64& random) {
    constexpr std::array<std::string_view, 22> kNumbers = {"0",          "1",
                                                           "2",          "3",
                                                           "-1",         "4",
                                                           "5",          "255",
                                                           "256",        "5121",
                                                           "5123",       "5125",
                                                           "5126",       "65535",
                                                           "65536",      "2147483647",
                                                           "4294967295", "1099511627776",
                                                           "1e300",      "0.5",
                                                           "1e-40",      "18446744073709551616"};
    const std::size_t begin = is_glb(bytes) ? kGlbHead : 0;
    const std::size_t end = text_end(bytes);
    if (end <= begin) return;
    const auto is_digit = [](char c) { return c >= '0' && c <= '9'; };
    std::size_t at = begin + below(end - begin, random);
    while (at < end && !is_digit(bytes[at])) ++at;
    std::size_t last = at;
    while (last < end && is_digit(bytes[last])) ++last;
    if (last == at) return;
    const std::string_view number = kNumbers[below(kNumbers.size(), random)];
    const auto growth =
        static_cast<std::ptrdiff_t>(number.size()) - static_cast<std::ptrdiff_t>(last - at);
    bytes.replace(at, last - at, number);
    mend_lengths(bytes, growth);
}

void change_bytes(std::string& bytes, std::mt19937_64& random) {
    if (bytes.empty()) return;
    const std::size_t at = below(bytes.size(), random);
    const std::size_t count = std::min<std::size_t>(1 + below(4, random), bytes.size() - at);
    for (std::size_t i = 0; i < count; ++i) {
        bytes[at + i] = random() % 3 == 0 ? static_cast<char>(random() % 2 == 0 ? 0xFF : 0x7F)
                                          : static_cast<char>(random());
    }
}

/// Swaps two short pieces, such as names of members.
void swap_pieces(std::string& bytes, std::mt19937_64& random) {
    const std::size_t length = 1 + below(16, random);
    if (bytes.size() < 2 * length) return;
    const std::size_t a = below(bytes.size() - length + 1, random);
    const std::size_t b = below(bytes.size() - length + 1, random);
    if (a < b + length && b < a + length) return;
    std::swap_ranges(bytes.begin() + static_cast<std::ptrdiff_t>(a),
                     bytes.begin() + static_cast<std::ptrdiff_t>(a + length),
                     bytes.begin() + static_cast<std::ptrdiff_t>(b));
}

}  // namespace

std::string mutated(std::string bytes, std::mt19937_64& random) {
    const std::size_t changes = 1 + below(4, random);
    for (std::size_t i = 0; i < changes; ++i) {
        switch (below(10, random)) {
            case 0:
            case 1:
                change_bytes(bytes, random);
                break;
            case 2:
                swap_pieces(bytes, random);
                break;
            case 3:
                bytes.resize(below(bytes.size() + 1, random));
                if (random() % 2 == 0) mend_lengths(bytes, 0);
                break;
            default:
                change_number(bytes, random);
        }
    }
    return bytes;
}

}  // namespace mray::fuzz
