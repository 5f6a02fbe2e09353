#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <string_view>

#include "tests/fuzz/readers/targets.h"

namespace mray::fuzz {
namespace {

constexpr std::size_t kGlbHead = 20;
constexpr std::string_view kDigits = "0123456789";

bool is_glb(std::string_view bytes) {
    return bytes.starts_with("glTF") && bytes.size() >= kGlbHead;
}

std::uint32_t word_at(std::string_view bytes, std::size_t at) {
    std::uint32_t word = 0;
    std::memcpy(&word, bytes.data() + at, sizeof word);
    return word;
}

/// Gives a GLB file the lengths that it has after its text has grown by `growth`.
void mend_lengths(std::string& bytes, std::ptrdiff_t growth) {
    if (!is_glb(bytes)) return;
    const auto size = static_cast<std::uint32_t>(bytes.size());
    const auto text =
        static_cast<std::uint32_t>(static_cast<std::ptrdiff_t>(word_at(bytes, 12)) + growth);
    std::memcpy(&bytes[8], &size, sizeof size);
    std::memcpy(&bytes[12], &text, sizeof text);
}

std::size_t place_in(const std::string& bytes, Dice& dice) {
    return dice.below(static_cast<std::uint32_t>(bytes.size() + 1));
}

void cut(std::string& bytes, Dice& dice) {
    bytes.resize(place_in(bytes, dice));
    if (dice.one_in(2)) mend_lengths(bytes, 0);
}

void change_bytes(std::string& bytes, Dice& dice) {
    if (bytes.empty()) return;
    const std::size_t at = dice.below(static_cast<std::uint32_t>(bytes.size()));
    const std::size_t count = std::min<std::size_t>(1 + dice.below(4), bytes.size() - at);
    if (dice.one_in(2)) {
        bytes[at] = static_cast<char>(bytes[at] ^ (1 << dice.below(8)));
        return;
    }
    for (std::size_t i = 0; i < count; ++i) {
        const bool is_limit = dice.one_in(3);
        bytes[at + i] = static_cast<char>(is_limit ? (dice.one_in(2) ? 0xFF : 0x7F)
                                                   : static_cast<int>(dice.below(256)));
    }
}

void set_integer(std::string& bytes, Dice& dice) {
    // Limits, and floats that are not finite.
    constexpr std::array<std::uint64_t, 14> kValues = {
        0,          1,          3,          0x7F,       0xFF,       0x7FFF,     0xFFFF,
        0x7FFFFFFF, 0x80000000, 0xFFFFFFFF, 0x7FC00000, 0x7F800000, ~0ull >> 1, ~0ull};
    std::uint64_t value = kValues[dice.below(kValues.size())];
    if (dice.one_in(3)) value -= 1;
    const std::size_t size = std::size_t{1} << dice.below(4);
    std::array<char, 8> raw = {};
    std::memcpy(raw.data(), &value, sizeof value);
    if (dice.one_in(2)) std::reverse(raw.begin(), raw.begin() + static_cast<std::ptrdiff_t>(size));
    const std::size_t at = place_in(bytes, dice);
    bytes.replace(at, std::min(size, bytes.size() - at), raw.data(), size);
}

void set_decimal(std::string& bytes, Dice& dice) {
    // Limits, counts that are off by one, and the types of components in glTF.
    constexpr std::array<std::string_view, 28> kNumbers = {
        "0",          "1",          "2",     "3",     "4",     "5",     "-1",
        "255",        "256",        "5121",  "5123",  "5125",  "5126",  "65535",
        "65536",      "2147483647", "1e39",  "-nan",  "inf",   "1e-46", "0.5",
        "2147483648", "4294967295", "1e300", "1e-40", "1e999", "-0",    "1099511627776"};
    constexpr std::array<std::string_view, 2> kHuge = {"9223372036854775807",
                                                       "18446744073709551616"};
    // The text of a GLB file comes first; a number in its other chunk is no number.
    const std::size_t end = is_glb(bytes)
                                ? std::min<std::size_t>(bytes.size(), kGlbHead + word_at(bytes, 12))
                                : bytes.size();
    const std::size_t from = is_glb(bytes) && end > kGlbHead
                                 ? kGlbHead + dice.below(static_cast<std::uint32_t>(end - kGlbHead))
                                 : place_in(bytes, dice);
    const std::size_t first = bytes.find_first_of(kDigits, from);
    if (first >= end) return;
    const std::size_t last = std::min(bytes.find_first_not_of("0123456789.", first), end);
    const std::string_view number =
        dice.one_in(12) ? kHuge[dice.below(kHuge.size())] : kNumbers[dice.below(kNumbers.size())];
    bytes.replace(first, last - first, number);
    mend_lengths(bytes, static_cast<std::ptrdiff_t>(number.size()) -
                            static_cast<std::ptrdiff_t>(last - first));
}

void move_part(std::string& bytes, Dice& dice) {
    const std::size_t from = place_in(bytes, dice);
    const std::size_t length = dice.below(64);
    const std::string part = bytes.substr(from, length);
    if (dice.one_in(2)) bytes.erase(from, part.size());
    if (dice.one_in(2)) bytes.insert(place_in(bytes, dice), part);
}

/// Swaps two short parts, such as names of members, so that all lengths stay.
void swap_parts(std::string& bytes, Dice& dice) {
    const std::size_t length = 1 + dice.below(16);
    if (bytes.size() < 2 * length) return;
    const auto places = static_cast<std::uint32_t>(bytes.size() - length + 1);
    const std::size_t a = dice.below(places);
    const std::size_t b = dice.below(places);
    if (a < b + length && b < a + length) return;
    std::swap_ranges(bytes.begin() + static_cast<std::ptrdiff_t>(a),
                     bytes.begin() + static_cast<std::ptrdiff_t>(a + length),
                     bytes.begin() + static_cast<std::ptrdiff_t>(b));
}

}  // namespace

std::string mutated(std::string bytes, Dice& dice) {
    const int changes = dice.from(1, 4);
    for (int i = 0; i < changes; ++i) {
        switch (dice.below(12)) {
            case 0:
                cut(bytes, dice);
                break;
            case 1:
                move_part(bytes, dice);
                break;
            case 2:
                swap_parts(bytes, dice);
                break;
            case 3:
            case 4:
                set_integer(bytes, dice);
                break;
            case 5:
                if (dice.one_in(50)) bytes.insert(place_in(bytes, dice), 100'000, ' ');
                [[fallthrough]];
            case 6:
            case 7:
                change_bytes(bytes, dice);
                break;
            default:
                set_decimal(bytes, dice);
        }
    }
    return bytes;
}

}  // namespace mray::fuzz
