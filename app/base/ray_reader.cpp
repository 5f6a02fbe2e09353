#include "app/base/ray_reader.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <bit>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <optional>
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

/// Rays of rows of 8 floats, as in struct Ray: org, tnear, dir, tfar; or of 6: org, dir.
std::vector<WorldRay> rays_of_rows(const std::string& name, std::string_view bytes,
                                   std::size_t row_length) {
    static_assert(std::endian::native == std::endian::little, "read as memory is");
    const std::size_t row_bytes = row_length * sizeof(float);
    if (bytes.size() % row_bytes != 0)
        throw Error(
            ErrorKind::kBadInput,
            "{}: {} bytes are not a whole number of rays of {} bytes; write {} floats a ray", name,
            bytes.size(), row_bytes, row_length);
    std::vector<WorldRay> rays;
    rays.reserve(bytes.size() / row_bytes);
    for (std::size_t at = 0; at < bytes.size(); at += row_bytes) {
        std::array<float, kMostNumbers> n;
        std::memcpy(n.data(), bytes.data() + at, row_bytes);
        if (row_length == kMostNumbers)
            rays.push_back({{n[0], n[1], n[2]}, {n[4], n[5], n[6]}, n[3], n[7]});
        else
            rays.push_back({{n[0], n[1], n[2]}, {n[3], n[4], n[5]}, 0, kInfinity});
    }
    return rays;
}

constexpr std::string_view kNpyMagic = "\x93NUMPY";

/// Rays of a file that numpy.save() has written (NumPy Enhancement Proposal 1).
std::vector<WorldRay> npy_rays(const std::string& name, std::string_view bytes) {
    const auto fail = [&name](std::string_view what) {
        throw Error(ErrorKind::kBadInput,
                    "{}: {}; save an array of morphray.ray_dtype, or one of float32 of shape (N, "
                    "6) or (N, 8)",
                    name, what);
    };
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
    bytes.remove_prefix(head + length);
    const auto has = [&form](std::string_view part) {
        return form.find(part) != std::string::npos;
    };
    constexpr std::string_view kShape = "'shape':(";
    const bool is_structure =
        has("'descr':[('org','<f4',(3,)),('tnear','<f4'),('dir','<f4',(3,)),('tfar','<f4')]");
    const bool is_rows = has("'descr':'<f4'") && (has(",6)") || has(",8)"));
    if (!has("'fortran_order':False") || !has(kShape) || (!is_structure && !is_rows))
        fail("the .npy file has no rays");
    std::uint64_t count = 0;
    const char* const shape = form.data() + form.find(kShape) + kShape.size();
    std::from_chars(shape, form.data() + form.size(), count);
    const std::size_t row_length = has(",6)") ? 6 : kMostNumbers;
    if (bytes.size() % (row_length * sizeof(float)) != 0 ||
        bytes.size() / (row_length * sizeof(float)) != count)
        fail(fmt::format("the .npy file has not the bytes of its {} rays", count));
    return rays_of_rows(name, bytes, row_length);
}

}  // namespace

RayFile read_rays(const std::string& file, bool is_binary) {
    const std::string text = read_input(file, "rays");
    if (text.starts_with(kNpyMagic)) return {npy_rays(input_name(file), text)};
    if (is_binary) return {rays_of_rows(input_name(file), text, kMostNumbers)};
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
    const std::string text = read_input(file, "points");
    NumberLines lines(input_name(file), text, "x y z");
    std::vector<glm::dvec3> points;
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
