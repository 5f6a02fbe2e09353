#include "app/files/ray_reader.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cerrno>
#include <cstring>
#include <limits>
#include <optional>
#include <system_error>

#include "common/base/errors.h"
#include "common/base/input_file.h"
#include "common/text/number_text.h"
#include "common/text/text_parts.h"

namespace mray::app {
namespace {

constexpr std::string_view kBlank = " \t\r";
constexpr std::size_t kMostNumbers = 8;

WorldRay to_ray(const std::array<double, kMostNumbers>& n) {
    return {{n[0], n[1], n[2]}, {n[3], n[4], n[5]}, n[6], n[7]};
}

}  // namespace

void NumberLines::fail(const std::string& what) const {
    throw Error(ErrorKind::kBadInput,
                fmt::format("{}:{}: {}; write `{}`", name_, line_, what, form_));
}

std::size_t NumberLines::next(std::span<double> numbers) {
    while (!rest_.empty()) {
        ++line_;
        const std::size_t end = std::min(rest_.find('\n'), rest_.size());
        std::string_view line = rest_.substr(0, end);
        rest_.remove_prefix(std::min(end + 1, rest_.size()));
        line = line.substr(0, line.find('#'));
        std::size_t count = 0;
        for (;;) {
            line.remove_prefix(std::min(line.find_first_not_of(kBlank), line.size()));
            if (line.empty()) break;
            const std::string_view word = line.substr(0, line.find_first_of(kBlank));
            line.remove_prefix(word.size());
            const std::optional<float> number = parse_float(word);
            if (!number) fail(quote(word) + " is not a number");
            if (count == numbers.size()) fail(fmt::format("more than {} numbers", numbers.size()));
            numbers[count++] = *number;
        }
        if (count > 0) return count;
    }
    return 0;
}

std::uint64_t count_lines(std::string_view text) {
    const auto ends = static_cast<std::uint64_t>(std::ranges::count(text, '\n'));
    return ends + (text.empty() || text.ends_with('\n') ? 0 : 1);
}

std::string read_input(const std::string& file, const char* content) {
    if (file != "-") return read_input_file(file);
    std::string text;
    std::array<char, 1 << 16> buffer;
    for (;;) {
        const ssize_t got = ::read(STDIN_FILENO, buffer.data(), buffer.size());
        if (got < 0 && errno == EINTR) continue;
        if (got < 0) {
            throw Error(ErrorKind::kBadInput,
                        fmt::format("<stdin>: cannot be read ({}); give a file of {}",
                                    std::generic_category().message(errno), content));
        }
        if (got == 0) return text;
        text.append(buffer.data(), static_cast<std::size_t>(got));
        if (text.size() > kMaxInputBytes) {
            throw Error(ErrorKind::kLimit,
                        fmt::format("<stdin>: more than 4 GiB of {}; give them in parts", content));
        }
    }
}

std::string input_name(const std::string& file) { return file == "-" ? "<stdin>" : file; }

bool RayTextReader::next(WorldRay& ray) {
    std::array<double, kMostNumbers> numbers = {0, 0, 0, 0,
                                                0, 0, 0, std::numeric_limits<double>::infinity()};
    const std::size_t count = lines_.next(numbers);
    if (count == 0) return false;
    if (count != 6 && count != kMostNumbers) lines_.fail(fmt::format("{} numbers", count));
    ray = to_ray(numbers);
    return true;
}

RayBinaryReader::RayBinaryReader(std::string_view name, std::string_view bytes) : rest_(bytes) {
    constexpr std::size_t kRayBytes = kMostNumbers * sizeof(float);
    if (bytes.size() % kRayBytes == 0) return;
    throw Error(
        ErrorKind::kBadInput,
        fmt::format("{}: {} bytes are not a whole number of rays of {} bytes; write 8 floats "
                    "a ray",
                    name, bytes.size(), kRayBytes));
}

bool RayBinaryReader::next(WorldRay& ray) {
    static_assert(std::endian::native == std::endian::little, "read as memory is");
    if (rest_.empty()) return false;
    std::array<float, kMostNumbers> floats;
    std::memcpy(floats.data(), rest_.data(), sizeof(floats));
    rest_.remove_prefix(sizeof(floats));
    std::array<double, kMostNumbers> numbers;
    std::copy(floats.begin(), floats.end(), numbers.begin());
    ray = to_ray(numbers);
    ++count_;
    return true;
}

bool PointReader::next(morphray::Vec3& point) {
    std::array<double, 3> numbers;
    const std::size_t count = lines_.next(numbers);
    if (count == 0) return false;
    if (count != 3) lines_.fail(fmt::format("{} number{}", count, count == 1 ? "" : "s"));
    point = {static_cast<float>(numbers[0]), static_cast<float>(numbers[1]),
             static_cast<float>(numbers[2])};
    return true;
}

}  // namespace mray::app
