#include "app/base/ray_reader.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <bit>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstring>
#include <initializer_list>
#include <optional>
#include <span>
#include <string_view>
#include <system_error>

#include "common/base/errors.h"
#include "common/base/input_file.h"
#include "common/text/text.h"

namespace mray::app {
namespace {

constexpr std::string_view kBlank = " \t\r";
constexpr std::size_t kMostNumbers = 8;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// The lines of a text that have numbers.
class NumberLines {
public:
    /// `form` is what a line should be. The views must outlive the object.
    NumberLines(std::string name, std::string_view text, std::string_view form)
        : name_(std::move(name)), rest_(text), form_(form) {}

    /// Reads a line into `numbers`, and a last number into `prim_id`. Returns how many; 0 at the
    /// end.
    std::size_t next(std::span<double> numbers, std::uint32_t* prim_id = nullptr) {
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
                if (count == numbers.size() && prim_id != nullptr) {
                    const char* const end_of_word = word.data() + word.size();
                    const auto [end_of_id, error] =
                        std::from_chars(word.data(), end_of_word, *prim_id);
                    if (error != std::errc() || end_of_id != end_of_word)
                        fail(quote(word) + " is not a prim_id");
                    prim_id = nullptr;
                    ++count;
                    continue;
                }
                // The first three are coordinates.
                const std::optional<double> number =
                    count < 3 ? parse_coordinate(word) : std::optional<double>(parse_float(word));
                if (!number) fail(quote(word) + " is not a number");
                if (count >= numbers.size()) fail(fmt::format("more than {} numbers", count));
                numbers[count++] = *number;
            }
            if (count > 0) return count;
        }
        return 0;
    }
    [[noreturn]] void fail(const std::string& what) const {
        throw Error(ErrorKind::kBadInput, "{}:{}: {}; write `{}`", name_, line_, what, form_);
    }

private:
    std::string name_;
    std::string_view rest_;
    std::string_view form_;
    std::uint64_t line_ = 0;
};

/// The content of a file, or of stdin; `content` is "rays" or "points".
std::string read_input(const std::string& file, const char* content) {
    if (file != "-") return read_input_file(file);
    std::string text;
    std::array<char, 1 << 16> buffer;
    for (;;) {
        const ssize_t got = ::read(STDIN_FILENO, buffer.data(), buffer.size());
        if (got < 0 && errno == EINTR) continue;
        if (got < 0) {
            throw Error(ErrorKind::kBadInput, "<stdin>: cannot be read ({}); give a file of {}",
                        std::generic_category().message(errno), content);
        }
        if (got == 0) return text;
        text.append(buffer.data(), static_cast<std::size_t>(got));
        if (text.size() > kMaxInputBytes) {
            throw Error(ErrorKind::kLimit, "<stdin>: more than 4 GiB of {}; give them in parts",
                        content);
        }
    }
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
constexpr std::string_view kZipMagic = "PK\x03\x04";

/// An array that numpy.save() has written (NumPy Enhancement Proposal 1).
class NpyArray {
public:
    /// `wanted` ends the messages. The views must outlive the object. Throws Error(kBadInput).
    NpyArray(std::string name, std::string_view bytes, std::string_view wanted)
        : name_(std::move(name)), wanted_(wanted) {
        constexpr std::size_t kVersionAt = 6;
        constexpr std::size_t kLengthAt = 8;
        constexpr std::size_t kShortHead = 10;
        constexpr std::size_t kLongHead = 12;
        if (bytes.size() < kLongHead) fail("the .npy file is cut");
        const std::size_t head = bytes[kVersionAt] == 1 ? kShortHead : kLongHead;
        std::uint32_t length = 0;
        std::memcpy(&length, bytes.data() + kLengthAt, head - kLengthAt);
        if (length > bytes.size() - head) fail("the .npy file is cut");
        std::string form(bytes.substr(head, length));
        std::erase(form, ' ');
        bytes_ = bytes.substr(head + length);
        const auto after = [&form](std::string_view key) {
            const std::size_t at = form.find(key);
            return at == std::string::npos ? std::string_view()
                                           : std::string_view(form).substr(at + key.size());
        };
        const std::string_view dtype = after("'descr':");
        dtype_ = dtype.substr(0, dtype.find(",'fortran_order'"));
        is_fortran_ = after("'fortran_order':").starts_with("True");
        const std::string_view shape = after("'shape':(");
        shape_text_ = shape.substr(0, shape.find(')'));
        const char* const end = shape_text_.data() + shape_text_.size();
        for (const char* at = shape_text_.data(); at < end; ++at) {
            at = std::from_chars(at, end, shape_.emplace_back()).ptr;
            if (at != end && *at != ',') fail("the head of the .npy file is damaged");
        }
    }

    const std::string& dtype() const { return dtype_; }
    const std::vector<std::uint64_t>& shape() const { return shape_; }
    [[noreturn]] void fail(std::string_view what) const {
        throw Error(ErrorKind::kBadInput, "{}: {}; save {}", name_, what, wanted_);
    }
    [[noreturn]] void refuse() const {
        fail(
            fmt::format("the .npy file has {} of shape ({})", escape(dtype_), escape(shape_text_)));
    }

    /// Calls visit(bytes) for each item of `size` bytes, with the last axis varying first.
    template <class Visit>
    void for_each(std::size_t size, Visit visit) const {
        std::uint64_t count = 1;
        for (const std::uint64_t side : shape_) {
            if (side != 0 && count > bytes_.size() / side) fail_size();
            count *= side;
        }
        if (count * size != bytes_.size()) fail_size();
        for (std::uint64_t i = 0; i < count; ++i) {
            std::uint64_t at = i;
            if (is_fortran_) {
                std::uint64_t rest = i;
                std::uint64_t step = count;
                at = 0;
                for (auto side = shape_.rbegin(); side != shape_.rend(); ++side) {
                    step /= *side;
                    at += rest % *side * step;
                    rest /= *side;
                }
            }
            visit(bytes_.data() + at * size);
        }
    }

    /// The numbers of an array of float32 or float64 whose last axis has one of these sizes.
    std::vector<double> numbers(std::initializer_list<std::uint64_t> columns) const {
        const bool is_double = dtype_ == "'<f8'";
        const bool is_wanted = (is_double || dtype_ == "'<f4'") && !shape_.empty() &&
                               std::ranges::find(columns, shape_.back()) != columns.end();
        if (!is_wanted) refuse();
        std::vector<double> numbers;
        for_each(is_double ? sizeof(double) : sizeof(float), [&](const char* bytes) {
            numbers.push_back(is_double ? number_at<double>(bytes) : number_at<float>(bytes));
        });
        return numbers;
    }

private:
    [[noreturn]] void fail_size() const {
        fail(fmt::format("the .npy file has not the bytes of its shape ({})", escape(shape_text_)));
    }

    std::string name_;
    std::string_view wanted_;
    std::string_view bytes_;
    std::string dtype_;
    std::string shape_text_;
    bool is_fortran_ = false;
    std::vector<std::uint64_t> shape_;
};

std::vector<WorldRay> npy_rays(const std::string& name, std::string_view bytes) {
    const NpyArray array(name, bytes,
                         "an array of morphray.ray_dtype, or one of float32 or float64 of shape "
                         "(..., 6) or (..., 8)");
    if (array.dtype() == "[('org','<f4',(3,)),('tnear','<f4'),('dir','<f4',(3,)),('tfar','<f4')]") {
        std::string rows;
        constexpr std::size_t kRowBytes = kMostNumbers * sizeof(float);
        array.for_each(kRowBytes, [&](const char* row) { rows.append(row, kRowBytes); });
        return rays_of_bytes(name, rows);
    }
    std::vector<double> numbers = array.numbers({6, kMostNumbers});
    return rays_of_rows(numbers, array.shape().back());
}

/// Text, or a .npy file.
std::string read_text(const std::string& file, const char* content) {
    std::string text = read_input(file, content);
    if (text.starts_with(kZipMagic))
        throw Error(ErrorKind::kBadInput,
                    "{}: a ZIP archive, such as a .npz file; save one array of {} as .npy",
                    input_name(file), content);
    return text;
}

}  // namespace

RayFile read_rays(const std::string& file, bool is_binary) {
    const std::string text = is_binary ? read_input(file, "rays") : read_text(file, "rays");
    if (text.starts_with(kNpyMagic)) return {npy_rays(input_name(file), text)};
    if (is_binary) return {rays_of_bytes(input_name(file), text)};
    NumberLines lines(input_name(file), text, "ox oy oz dx dy dz [tnear tfar [prim_id]]");
    RayFile read;
    for (;;) {
        std::array<double, kMostNumbers> n = {0, 0, 0, 0, 0, 0, 0, kInfinity};
        morphray::Primitive excluded;
        const std::size_t count = lines.next(n, &excluded.prim_id);
        if (count == 0) return read;
        if (count != 6 && count < kMostNumbers) lines.fail(fmt::format("{} numbers", count));
        read.rays.push_back({{n[0], n[1], n[2]}, {n[3], n[4], n[5]}, n[6], n[7]});
        if (count > kMostNumbers) {
            if (excluded.prim_id != morphray::kNoPrim) excluded.geom_id = 0;
            read.excluded.resize(read.rays.size() - 1);
        }
        if (count > kMostNumbers || !read.excluded.empty()) read.excluded.push_back(excluded);
    }
}

std::vector<glm::dvec3> read_points(const std::string& file) {
    const std::string text = read_text(file, "points");
    std::vector<glm::dvec3> points;
    if (text.starts_with(kNpyMagic)) {
        const NpyArray array(input_name(file), text,
                             "an array of float32 or float64 of shape (..., 3)");
        const std::vector<double> numbers = array.numbers({3});
        for (std::size_t i = 0; i < numbers.size(); i += 3)
            points.emplace_back(numbers[i], numbers[i + 1], numbers[i + 2]);
        return points;
    }
    NumberLines lines(input_name(file), text, "x y z");
    for (;;) {
        std::array<double, 3> numbers;
        const std::size_t count = lines.next(numbers);
        if (count == 0) return points;
        if (count != 3) lines.fail(fmt::format("{} number{}", count, count == 1 ? "" : "s"));
        points.emplace_back(numbers[0], numbers[1], numbers[2]);
    }
}

std::string input_name(const std::string& file) { return file == "-" ? "<stdin>" : file; }

}  // namespace mray::app
