#include "tests/fuzz/formats/mutations.h"

#include <algorithm>
#include <array>
#include <cstring>

namespace mray::fuzz {
namespace {

std::size_t place_in(const std::string& bytes, Dice& dice) {
    return dice.below(static_cast<std::uint32_t>(bytes.size() + 1));
}

void change_byte(std::string& bytes, Dice& dice) {
    if (bytes.empty()) return;
    char& byte = bytes[dice.below(static_cast<std::uint32_t>(bytes.size()))];
    if (dice.one_in(2))
        byte = static_cast<char>(byte ^ (1 << dice.below(8)));
    else
        byte = static_cast<char>(dice.below(256));
}

void set_integer(std::string& bytes, Dice& dice) {
    constexpr std::array<std::uint64_t, 12> kValues = {
        0, 1, 3, 0x7F, 0xFF, 0x7FFF, 0xFFFF, 0x7FFFFFFF, 0x80000000, 0xFFFFFFFF, ~0ull >> 1, ~0ull};
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
    constexpr std::array kNumbers = {"0",
                                     "1",
                                     "-1",
                                     "255",
                                     "65536",
                                     "2147483647",
                                     "2147483648",
                                     "4294967295",
                                     "9223372036854775807",
                                     "18446744073709551616",
                                     "1e39",
                                     "-nan",
                                     "inf",
                                     "1e-46",
                                     "0.5"};
    const std::size_t first = bytes.find_first_of("0123456789", place_in(bytes, dice));
    if (first == std::string::npos) return;
    const std::size_t end = std::min(bytes.find_first_not_of("0123456789.", first), bytes.size());
    bytes.replace(first, end - first, kNumbers[dice.below(kNumbers.size())]);
}

void move_part(std::string& bytes, Dice& dice) {
    const std::size_t from = place_in(bytes, dice);
    const std::size_t length = dice.below(64);
    const std::string part = bytes.substr(from, length);
    if (dice.one_in(2)) bytes.erase(from, part.size());
    if (dice.one_in(2)) bytes.insert(place_in(bytes, dice), part);
}

}  // namespace

std::string mutated(std::string bytes, Dice& dice) {
    const int changes = dice.from(1, 4);
    for (int i = 0; i < changes; ++i) {
        switch (dice.below(8)) {
            case 0:
                bytes.resize(place_in(bytes, dice));
                break;
            case 1:
                move_part(bytes, dice);
                break;
            case 2:
            case 3:
                set_integer(bytes, dice);
                break;
            case 4:
            case 5:
                set_decimal(bytes, dice);
                break;
            case 6:
                if (dice.one_in(50)) bytes.insert(place_in(bytes, dice), 100'000, ' ');
                [[fallthrough]];
            default:
                change_byte(bytes, dice);
        }
    }
    return bytes;
}

}  // namespace mray::fuzz
