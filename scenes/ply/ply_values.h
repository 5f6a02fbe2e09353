// The values of a PLY file after its header.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/errors.h"
#include "common/text/number_text.h"
#include "common/text/text_parts.h"
#include "scenes/file_origin.h"
#include "scenes/mesh/mesh_rules.h"
#include "scenes/ply/ply_header.h"

namespace mray {

/// The values after the header, one after the other: rows of text, blank ones left out, or bytes in
/// either order.
class PlyValues {
public:
    PlyValues(std::string_view text, const PlyHeader& header, const std::string& name)
        : rest_(text.substr(header.size)),
          name_(name),
          is_text_(header.encoding == PlyEncoding::kText),
          is_swapped_(header.encoding == PlyEncoding::kBigEndian),
          file_size_(text.size()),
          next_line_(header.line_count + 1) {
        static_assert(std::endian::native == std::endian::little);
    }

    bool is_text() const { return is_text_; }
    /// The place of the current item.
    std::string place() const {
        return is_text_ ? fmt::format("{}:{}", name_, line_)
                        : fmt::format("{}: byte {}", name_, file_size_ - left_at_begin_);
    }
    [[noreturn]] void fail(const std::string& what) const {
        throw Error(ErrorKind::kBadInput, fmt::format("{}: {}", place(), what));
    }

    void begin(const PlyElement& element, std::uint64_t item) {
        element_ = &element;
        item_ = item;
        left_at_begin_ = rest_.size();
        if (!is_text_) return;
        skip_blank_lines();
        line_ = next_line_;
        if (rest_.empty()) fail_end();
        const auto* const end =
            std::find_if(rest_.begin(), rest_.end(), [](char c) { return c == '\n' || c == '\r'; });
        row_ = rest_.substr(0, static_cast<std::size_t>(end - rest_.begin()));
        rest_.remove_prefix(row_.size());
    }
    void end() const {
        if (std::all_of(row_.begin(), row_.end(), is_blank)) return;
        fail(fmt::format("more values than {} has; is the header right?", quote(element_->name)));
    }
    /// The bytes that have not been read.
    std::size_t left() const { return rest_.size(); }
    void skip_blank_lines() {
        std::size_t i = 0;
        for (; is_text_ && i < rest_.size(); ++i) {
            if (rest_[i] == '\n' || (rest_[i] == '\r' && !rest_.substr(i + 1).starts_with('\n')))
                ++next_line_;
            else if (rest_[i] != ' ' && rest_[i] != '\t' && rest_[i] != '\r')
                break;
        }
        rest_.remove_prefix(i);
    }

    double number(PlyScalar type) {
        if (!is_text_) return value_at(take(size_of(type)), type);
        const std::string_view word = next_word();
        const auto number = parse_coordinate(word);
        if (!number) fail(not_a_number(word));
        return *number;
    }
    std::int64_t integer(PlyScalar type) {
        if (!is_text_) return static_cast<std::int64_t>(value_at(take(size_of(type)), type));
        const std::string_view word = next_word();
        const auto number = parse_integer(word);
        if (!number) fail(fmt::format("{} is not a whole number; a list needs one", quote(word)));
        return *number;
    }
    void skip(PlyScalar type) {
        if (is_text_)
            next_word();
        else
            take(size_of(type));
    }

    static constexpr std::size_t kTriangleBytes = 1 + 3 * sizeof(std::uint32_t);
    /// Appends the corners of the next triangles, lists of one byte and three integers of 32 bits,
    /// up to a face that is none. Returns their number, at most `most`.
    std::size_t take_triangles(std::uint64_t most, std::size_t vertex_count,
                               std::vector<std::uint32_t>& corners) {
        const auto end =
            static_cast<std::size_t>(std::min<std::uint64_t>(most, left() / kTriangleBytes));
        const char* from = rest_.data();
        std::size_t count = 0;
        for (; count < end; ++count, from += kTriangleBytes) {
            const std::array<std::uint32_t, 3> triangle = {load<std::uint32_t>(from + 1),
                                                           load<std::uint32_t>(from + 5),
                                                           load<std::uint32_t>(from + 9)};
            // Negative ones are large, and no file has as many vertices.
            const std::uint32_t largest = std::max({triangle[0], triangle[1], triangle[2]});
            if (from[0] != 3 || largest >= vertex_count) break;
            corners.insert(corners.end(), triangle.begin(), triangle.end());
        }
        take(count * kTriangleBytes);
        return count;
    }

private:
    static bool is_blank(char c) { return c == ' ' || c == '\t'; }

    [[noreturn]] void fail_end() const {
        fail(fmt::format("ends within {} {} of {}; is the file complete?", quote(element_->name),
                         item_, element_->count));
    }

    std::string_view next_word() {
        const auto* const begin = std::find_if_not(row_.begin(), row_.end(), is_blank);
        const auto* const end = std::find_if(begin, row_.end(), is_blank);
        if (begin == end) {
            fail(fmt::format("fewer values than {} has; is the file complete?",
                             quote(element_->name)));
        }
        row_.remove_prefix(static_cast<std::size_t>(end - row_.begin()));
        return {begin, static_cast<std::size_t>(end - begin)};
    }

    const char* take(std::size_t size) {
        if (rest_.size() < size) fail_end();
        const char* const from = rest_.data();
        rest_.remove_prefix(size);
        return from;
    }

    template <class Bits>
    Bits load(const char* from) const {
        Bits bits;
        std::memcpy(&bits, from, sizeof bits);
        if (!is_swapped_) return bits;
        if constexpr (sizeof bits == 2) return __builtin_bswap16(bits);
        if constexpr (sizeof bits == 4) return __builtin_bswap32(bits);
        if constexpr (sizeof bits == 8) return __builtin_bswap64(bits);
        return bits;
    }

    /// All types are exact in a double.
    double value_at(const char* from, PlyScalar type) const {
        switch (type) {
            case PlyScalar::kInt8:
                return static_cast<std::int8_t>(*from);
            case PlyScalar::kUint8:
                return static_cast<std::uint8_t>(*from);
            case PlyScalar::kInt16:
                return static_cast<std::int16_t>(load<std::uint16_t>(from));
            case PlyScalar::kUint16:
                return load<std::uint16_t>(from);
            case PlyScalar::kInt32:
                return static_cast<std::int32_t>(load<std::uint32_t>(from));
            case PlyScalar::kUint32:
                return load<std::uint32_t>(from);
            case PlyScalar::kFloat:
                return double{std::bit_cast<float>(load<std::uint32_t>(from))};
            case PlyScalar::kDouble:
                break;
        }
        return std::bit_cast<double>(load<std::uint64_t>(from));
    }

    std::string_view rest_;
    const std::string& name_;
    const bool is_text_;
    const bool is_swapped_;
    const std::uint64_t file_size_;
    /// The current item.
    const PlyElement* element_ = nullptr;
    std::uint64_t item_ = 0;
    std::uint64_t left_at_begin_ = 0;
    std::uint64_t next_line_;
    std::uint64_t line_ = 0;
    /// What is left of the row of the current item.
    std::string_view row_;
};

}  // namespace mray
