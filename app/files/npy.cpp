#include "app/files/npy.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <optional>

#include "common/base/errors.h"
#include "common/text/message_text.h"
#include "common/text/number_text.h"

namespace mray::app {
namespace {

constexpr std::string_view kMagic = "\x93NUMPY";
// Magic, two bytes of the version, two of the header's length.
constexpr std::size_t kPreambleBytes = 10;
// Where data begins is a multiple of this.
constexpr std::size_t kAlignment = 64;
constexpr std::string_view kBlank = " \t\n";

[[noreturn]] void refuse(std::string_view name, const std::string& what) {
    throw Error(ErrorKind::kBadInput,
                fmt::format("{}: {}; write N x 3 float32 or float64 by numpy.save", name, what));
}

/// Fit for a message.
std::string beginning(std::string_view text) {
    constexpr std::size_t kMost = 60;
    return shown(std::string(text.substr(0, kMost)));
}

/// The text after `'key':` in a header; empty if it is not there.
std::string_view value_of(std::string_view header, std::string_view key) {
    const std::string quoted = fmt::format("'{}':", key);
    const std::size_t at = header.find(quoted);
    if (at == std::string_view::npos) return {};
    header.remove_prefix(at + quoted.size());
    header.remove_prefix(std::min(header.find_first_not_of(kBlank), header.size()));
    return header;
}

/// N of the shape "(N, 3)".
std::optional<std::uint64_t> row_count_of(std::string_view shape) {
    if (!shape.starts_with('(')) return {};
    const std::size_t comma = shape.find(',');
    const std::size_t end = shape.find(')');
    if (comma == std::string_view::npos || end == std::string_view::npos || comma > end) return {};
    if (shape.substr(comma, end - comma) != ", 3") return {};
    return parse_unsigned(shape.substr(1, comma - 1));
}

}  // namespace

bool is_npy(std::string_view bytes) { return bytes.starts_with(kMagic); }

std::string npy_file(std::string_view fields, std::size_t count, std::string_view bytes) {
    std::string header =
        fmt::format("{{'descr': [{}], 'fortran_order': False, 'shape': ({},), }}", fields, count);
    const std::size_t used = (kPreambleBytes + header.size() + 1) % kAlignment;
    header.append(used == 0 ? 0 : kAlignment - used, ' ');
    header += '\n';
    std::string file(kMagic);
    file += '\x01';
    file += '\0';
    file += static_cast<char>(header.size() & 0xFF);
    file += static_cast<char>(header.size() >> 8);
    return file.append(header).append(bytes);
}

NpyPoints read_npy_points(std::string_view name, std::string_view bytes) {
    const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(bytes[i]); };
    if (!is_npy(bytes) || bytes.size() < kPreambleBytes) refuse(name, "no whole array of numpy");
    // Version 1 has a length of two bytes, later ones of four.
    const bool is_long = byte(kMagic.size()) > 1;
    const std::size_t begin = is_long ? kPreambleBytes + 2 : kPreambleBytes;
    if (bytes.size() < begin) refuse(name, "no whole array of numpy");
    std::size_t length = byte(8) | std::size_t{byte(9)} << 8;
    if (is_long) length |= std::size_t{byte(10)} << 16 | std::size_t{byte(11)} << 24;
    if (bytes.size() - begin < length) refuse(name, "its header is cut off");
    const std::string_view header = bytes.substr(begin, length);

    NpyPoints points;
    const std::string_view type = value_of(header, "descr");
    if (type.starts_with("'<f4'")) points.number_bytes = sizeof(float);
    if (type.starts_with("'<f8'")) points.number_bytes = sizeof(double);
    if (points.number_bytes == 0) {
        const std::string_view word = type.substr(0, type.find_first_of(",}"));
        refuse(name, fmt::format("an array of the type {}", beginning(word)));
    }
    if (!value_of(header, "fortran_order").starts_with("False"))
        refuse(name, "an array in the order of Fortran");
    const std::string_view shape = value_of(header, "shape");
    const std::optional<std::uint64_t> count = row_count_of(shape);
    if (!count) {
        const std::string_view text = shape.substr(0, shape.find(')') + 1);
        refuse(name, fmt::format("an array of the shape {}", beginning(text)));
    }
    points.numbers = bytes.substr(begin + length);
    points.count = *count;
    const std::size_t point_bytes = 3 * points.number_bytes;
    if (points.numbers.size() % point_bytes != 0 || points.numbers.size() / point_bytes != *count)
        refuse(name, fmt::format("{} bytes are not {} points of {} bytes", points.numbers.size(),
                                 *count, point_bytes));
    return points;
}

}  // namespace mray::app
