#include "app/base/ray_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstdio>
#include <cstring>
#include <initializer_list>

#include "common/base/errors.h"
#include "common/base/input_file.h"
#include "common/text/text.h"

namespace mray::app {
namespace {

constexpr std::string_view kBlank = " \t\r";
constexpr std::size_t kMostNumbers = 8;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// The lines of a text that have words.
class Lines {
public:
    /// `form` is what a line should be. The views must outlive the object.
    Lines(std::string name, std::string_view text, std::string_view form)
        : name_(std::move(name)), rest_(text), form_(form) {}

    /// Goes to the next line, if there is one.
    bool next() {
        words_.clear();
        while (words_.empty() && !rest_.empty()) {
            ++line_;
            const std::size_t end = std::min(rest_.find('\n'), rest_.size());
            std::string_view line = rest_.substr(0, end);
            rest_.remove_prefix(std::min(end + 1, rest_.size()));
            line = line.substr(0, line.find('#'));
            for (std::size_t at; (at = line.find_first_not_of(kBlank)) != line.npos;) {
                line.remove_prefix(at);
                words_.push_back(line.substr(0, line.find_first_of(kBlank)));
                line.remove_prefix(words_.back().size());
            }
        }
        return !words_.empty();
    }

    std::size_t count() const { return words_.size(); }
    std::string_view word(std::size_t i) const { return words_[i]; }
    double number(std::size_t i) const {
        // The first three are coordinates.
        const std::optional<double> number =
            i < 3 ? parse_coordinate(words_[i]) : std::optional<double>(parse_float(words_[i]));
        if (!number) fail(quote(words_[i]) + " is not a number");
        return *number;
    }

    [[noreturn]] void fail(const std::string& what) const {
        throw Error(ErrorKind::kBadInput, "{}:{}: {}; write `{}`", name_, line_, what, form_);
    }

private:
    std::string name_;
    std::string_view rest_;
    std::string_view form_;
    std::uint64_t line_ = 0;
    std::vector<std::string_view> words_;
};

/// The content of a file, or of stdin; `content` is "rays" or "points".
std::string read_input(const std::string& file, const char* content) {
    if (file != "-") return read_input_file(file);
    std::string text;
    std::array<char, 1 << 16> buffer;
    while (const std::size_t got = std::fread(buffer.data(), 1, buffer.size(), stdin)) {
        text.append(buffer.data(), got);
        if (text.size() > kMaxInputBytes)
            throw Error(ErrorKind::kLimit, "<stdin>: more than 4 GiB of {}; give them in parts",
                        content);
    }
    if (std::ferror(stdin) != 0)
        throw Error(ErrorKind::kBadInput, "<stdin>: cannot be read ({}); give a file of {}",
                    std::generic_category().message(errno), content);
    return text;
}

/// Rays of rows of 8 numbers, as in struct Ray: org, tnear, dir, tfar; or of 6: org, dir. All but
/// org is rounded to float.
std::vector<WorldRay> rays_of_rows(std::span<double> numbers, std::size_t row_length) {
    const auto round = [](double& number) {
        const bool is_beyond = std::abs(number) > std::numeric_limits<float>::max();
        number = is_beyond ? std::copysign(kInfinity, number) : static_cast<float>(number);
    };
    std::vector<WorldRay> rays;
    rays.reserve(numbers.size() / row_length);
    for (std::size_t i = 0; i < numbers.size(); i += row_length) {
        const auto n = numbers.subspan(i, row_length);
        std::ranges::for_each(n.subspan(3), round);
        if (row_length == kMostNumbers)
            rays.push_back({{n[0], n[1], n[2]}, {n[4], n[5], n[6]}, n[3], n[7]});
        else
            rays.push_back({{n[0], n[1], n[2]}, {n[3], n[4], n[5]}, 0, kInfinity});
    }
    return rays;
}

template <class Number>
double number_at(const char* bytes) {
    static_assert(std::endian::native == std::endian::little, "read as memory is");
    Number number;
    std::memcpy(&number, bytes, sizeof(number));
    return number;
}

/// Rays of the bytes of struct Ray each.
std::vector<WorldRay> rays_of_bytes(const std::string& name, std::string_view bytes) {
    constexpr std::size_t kRowBytes = kMostNumbers * sizeof(float);
    if (bytes.size() % kRowBytes != 0)
        throw Error(
            ErrorKind::kBadInput,
            "{}: {} bytes are not a whole number of rays of {} bytes; write {} floats a ray", name,
            bytes.size(), kRowBytes, kMostNumbers);
    std::vector<double> numbers;
    for (std::size_t at = 0; at < bytes.size(); at += sizeof(float))
        numbers.push_back(number_at<float>(bytes.data() + at));
    return rays_of_rows(numbers, kMostNumbers);
}

constexpr std::string_view kNpyMagic = "\x93NUMPY";

/// The numbers of an array that numpy.save() has written (NumPy Enhancement Proposal 1), row by
/// row.
struct NpyRows {
    std::vector<double> numbers;
    std::size_t length;
};

/// Rows of float32 or float64 of one of these lengths; ray_dtype is a row of 8. `wanted` ends
/// messages.
NpyRows read_npy(const std::string& name, std::string_view bytes,
                 std::initializer_list<std::uint64_t> lengths, const char* wanted) {
    const auto fail = [&](const std::string& what) {
        throw Error(ErrorKind::kBadInput, "{}: the .npy file {}; save {}", name, what, wanted);
    };
    constexpr std::size_t kVersionAt = 6;
    constexpr std::size_t kLengthAt = 8;
    constexpr std::size_t kShortHead = 10;
    constexpr std::size_t kLongHead = 12;
    if (bytes.size() < kLongHead) fail("is cut");
    const std::size_t head = bytes[kVersionAt] == 1 ? kShortHead : kLongHead;
    std::uint32_t head_length = 0;
    std::memcpy(&head_length, bytes.data() + kLengthAt, head - kLengthAt);
    if (head_length > bytes.size() - head) fail("is cut");
    std::string form(bytes.substr(head, head_length));
    std::erase(form, ' ');
    bytes.remove_prefix(head + head_length);
    const auto between = [&form](std::string_view begin, std::string_view end) {
        const std::size_t at =
            std::min(form.find(begin), form.size() - begin.size()) + begin.size();
        return form.substr(at, form.find(end, at) - at);
    };
    const std::string dtype = between("'descr':", ",'fortran_order'");
    std::string shape = between("'shape':(", ")");
    const std::string text = fmt::format("has {} of shape ({})", escape(dtype), escape(shape));
    const bool is_structure =
        dtype == "[('org','<f4',(3,)),('tnear','<f4'),('dir','<f4',(3,)),('tfar','<f4')]";
    if (is_structure) shape += shape.ends_with(',') ? "8" : ",8";
    const bool is_double = dtype == "'<f8'";
    std::vector<std::uint64_t> sides;
    const char* const end = shape.data() + shape.size();
    for (const char* at = shape.data(); at < end; ++at)
        at = std::from_chars(at, end, sides.emplace_back()).ptr;
    const bool has_length = !sides.empty() && std::ranges::count(lengths, sides.back()) > 0;
    if (form.find("'fortran_order':False") == std::string::npos) fail(text + ", not in C order");
    if (!has_length || (!is_structure && !is_double && dtype != "'<f4'")) fail(text);
    const std::size_t size = is_double ? sizeof(double) : sizeof(float);
    std::uint64_t count = 1;
    for (const std::uint64_t side : sides)
        count = side != 0 && count > bytes.size() / side ? bytes.size() + 1 : count * side;
    if (count * size != bytes.size()) fail(text + ", and other bytes");
    NpyRows rows{{}, sides.back()};
    for (std::uint64_t i = 0; i < count; ++i) {
        const char* const from = bytes.data() + i * size;
        rows.numbers.push_back(is_double ? number_at<double>(from) : number_at<float>(from));
    }
    return rows;
}

}  // namespace

RayFile read_rays(const std::string& file, bool is_binary) {
    const std::string text = read_input(file, "rays");
    if (text.starts_with(kNpyMagic)) {
        NpyRows rows = read_npy(input_name(file), text, {6, kMostNumbers},
                                "an array of morphray.ray_dtype, or one of float32 or float64 of "
                                "shape (..., 6) or (..., 8)");
        return {rays_of_rows(rows.numbers, rows.length)};
    }
    if (is_binary) return {rays_of_bytes(input_name(file), text)};
    Lines lines(input_name(file), text, "ox oy oz dx dy dz [tnear tfar [prim_id]]");
    RayFile read;
    while (lines.next()) {
        const std::size_t count = lines.count();
        if (count != 6 && count != kMostNumbers && count != kMostNumbers + 1)
            lines.fail(fmt::format("{} numbers", count));
        std::array<double, kMostNumbers> n = {0, 0, 0, 0, 0, 0, 0, kInfinity};
        for (std::size_t i = 0; i < std::min(count, n.size()); ++i) n[i] = lines.number(i);
        read.rays.push_back({{n[0], n[1], n[2]}, {n[3], n[4], n[5]}, n[6], n[7]});
        if (count <= kMostNumbers && read.excluded.empty()) continue;
        read.excluded.resize(read.rays.size());
        if (count <= kMostNumbers) continue;
        const std::string_view word = lines.word(kMostNumbers);
        const std::optional<std::uint64_t> id = parse_unsigned(word);
        if (!id || *id > morphray::kNoPrim) lines.fail(quote(word) + " is not a prim_id");
        if (*id != morphray::kNoPrim)
            read.excluded.back() = {.prim_id = static_cast<std::uint32_t>(*id), .geom_id = 0};
    }
    return read;
}

std::vector<glm::dvec3> read_points(const std::string& file) {
    const std::string text = read_input(file, "points");
    std::vector<glm::dvec3> points;
    if (text.starts_with(kNpyMagic)) {
        const std::vector<double> numbers =
            read_npy(input_name(file), text, {3},
                     "an array of float32 or float64 of shape (..., 3)")
                .numbers;
        for (std::size_t i = 0; i < numbers.size(); i += 3)
            points.emplace_back(numbers[i], numbers[i + 1], numbers[i + 2]);
        return points;
    }
    Lines lines(input_name(file), text, "x y z");
    while (lines.next()) {
        const std::size_t count = lines.count();
        if (count != 3) lines.fail(fmt::format("{} number{}", count, count == 1 ? "" : "s"));
        points.emplace_back(lines.number(0), lines.number(1), lines.number(2));
    }
    return points;
}

std::string input_name(const std::string& file) { return file == "-" ? "<stdin>" : file; }

}  // namespace mray::app
