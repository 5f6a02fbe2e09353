// The values of a PLY file after its header, in text and in binary.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <limits>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "common/base/errors.h"
#include "common/text/number_text.h"
#include "common/text/text_parts.h"
#include "scenes/mesh/mesh_rules.h"
#include "scenes/ply/ply_header.h"

namespace mray {

/// What both encodings have in common: the item that is read, for messages.
class PlySource {
public:
    PlySource(std::string_view rest, const std::string& name) : rest_(rest), name_(name) {}
    /// The bytes that have not been read.
    std::size_t left() const { return rest_.size(); }

protected:
    [[noreturn]] void fail_end(const std::string& place) const {
        fail(place, fmt::format("ends within {} {} of {}; is the file complete?",
                                quote(element_->name), item_, element_->count));
    }
    [[noreturn]] static void fail(const std::string& place, const std::string& what) {
        throw Error(ErrorKind::kBadInput, fmt::format("{}: {}", place, what));
    }

    std::string_view rest_;
    const std::string& name_;
    const PlyElement* element_ = nullptr;
    std::uint64_t item_ = 0;
};

/// A line for each item, blank lines left out.
class PlyText : public PlySource {
public:
    PlyText(std::string_view rest, const PlyHeader& header, const std::string& name)
        : PlySource(rest, name), next_line_(header.line_count + 1) {}

    static constexpr bool kHasRows = true;
    std::string place() const { return fmt::format("{}:{}", name_, line_); }

    void begin(const PlyElement& element, std::uint64_t item) {
        element_ = &element;
        item_ = item;
        skip_blank_lines();
        line_ = next_line_;
        if (rest_.empty()) fail_end(place());
        const auto* const end =
            std::find_if(rest_.begin(), rest_.end(), [](char c) { return c == '\n' || c == '\r'; });
        row_ = rest_.substr(0, static_cast<std::size_t>(end - rest_.begin()));
        rest_.remove_prefix(row_.size());
    }
    void end() {
        if (std::all_of(row_.begin(), row_.end(), is_blank)) return;
        fail(place(),
             fmt::format("more values than {} has; is the header right?", quote(element_->name)));
    }

    /// Correctly rounded to float whatever the type.
    float number(PlyScalar) {
        const std::string_view word = next_word();
        const auto number = parse_float(word);
        if (!number) fail(place(), not_a_number(word));
        return *number;
    }
    std::int64_t integer(PlyScalar) {
        const std::string_view word = next_word();
        const auto number = parse_integer(word);
        if (!number)
            fail(place(), fmt::format("{} is not a whole number; a list needs one", quote(word)));
        return *number;
    }
    void skip(PlyScalar) { next_word(); }
    void skip_blank_lines() {
        std::size_t i = 0;
        for (; i < rest_.size(); ++i) {
            if (rest_[i] == '\n' || (rest_[i] == '\r' && !rest_.substr(i + 1).starts_with('\n')))
                ++next_line_;
            else if (rest_[i] != ' ' && rest_[i] != '\t' && rest_[i] != '\r')
                break;
        }
        rest_.remove_prefix(i);
    }

private:
    static bool is_blank(char c) { return c == ' ' || c == '\t'; }

    std::string_view next_word() {
        const auto* const begin = std::find_if_not(row_.begin(), row_.end(), is_blank);
        const auto* const end = std::find_if(begin, row_.end(), is_blank);
        if (begin == end) {
            fail(place(), fmt::format("fewer values than {} has; is the file complete?",
                                      quote(element_->name)));
        }
        row_.remove_prefix(static_cast<std::size_t>(end - row_.begin()));
        return {begin, static_cast<std::size_t>(end - begin)};
    }

    std::uint64_t next_line_;
    /// That of row_, which is what is left of it.
    std::uint64_t line_ = 0;
    std::string_view row_;
};

/// `kSwap` if bytes are in the other order than the machine's.
template <bool kSwap>
class PlyBinary : public PlySource {
public:
    PlyBinary(std::string_view rest, const PlyHeader& header, const std::string& name)
        : PlySource(rest, name), end_(header.size + rest.size()) {}

    static constexpr bool kHasRows = false;
    std::string place() const { return fmt::format("{}: byte {}", name_, end_ - left_at_begin_); }

    void begin(const PlyElement& element, std::uint64_t item) {
        element_ = &element;
        item_ = item;
        left_at_begin_ = left();
    }
    void end() {}

    float number(PlyScalar type) { return number_at(take(size_of(type)), type); }
    /// The number that lies this many bytes ahead, which are there.
    float number_ahead(std::size_t bytes, PlyScalar type) const {
        return number_at(rest_.data() + bytes, type);
    }
    std::int64_t integer(PlyScalar type) {
        return static_cast<std::int64_t>(value_at(take(size_of(type)), type));
    }
    void skip(PlyScalar type) { take(size_of(type)); }
    void skip_bytes(std::size_t count) { take(count); }

    static constexpr std::size_t kTriangleBytes = 1 + 3 * sizeof(std::uint32_t);
    /// Appends the corners of the next triangles, lists of one byte and three integers of 32 bits,
    /// up to a face that is none. Returns their number, at most `most`.
    std::size_t take_triangles(std::uint64_t most, std::size_t vertex_count,
                               std::vector<std::uint32_t>& corners) {
        const auto end =
            static_cast<std::size_t>(std::min<std::uint64_t>(most, rest_.size() / kTriangleBytes));
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
    template <class T>
    static T load(const char* from) {
        using Bits = std::conditional_t<
            sizeof(T) == 1, std::uint8_t,
            std::conditional_t<sizeof(T) == 2, std::uint16_t,
                               std::conditional_t<sizeof(T) == 4, std::uint32_t, std::uint64_t>>>;
        Bits bits;
        std::memcpy(&bits, from, sizeof bits);
        if constexpr (kSwap && sizeof(T) == 2) bits = __builtin_bswap16(bits);
        if constexpr (kSwap && sizeof(T) == 4) bits = __builtin_bswap32(bits);
        if constexpr (kSwap && sizeof(T) == 8) bits = __builtin_bswap64(bits);
        return std::bit_cast<T>(bits);
    }

    const char* take(std::size_t size) {
        if (rest_.size() < size) fail_end(place());
        const char* const from = rest_.data();
        rest_.remove_prefix(size);
        return from;
    }

    static float number_at(const char* from, PlyScalar type) {
        // Nearly all files have them.
        if (type == PlyScalar::kFloat) return load<float>(from);
        const double number = value_at(from, type);
        constexpr double kMost = std::numeric_limits<float>::max();
        constexpr float kInfinity = std::numeric_limits<float>::infinity();
        // The cast of a double beyond floats is undefined.
        if (number > kMost) return kInfinity;
        return number < -kMost ? -kInfinity : static_cast<float>(number);
    }

    /// All types are exact in a double.
    static double value_at(const char* from, PlyScalar type) {
        switch (type) {
            case PlyScalar::kInt8:
                return load<std::int8_t>(from);
            case PlyScalar::kUint8:
                return load<std::uint8_t>(from);
            case PlyScalar::kInt16:
                return load<std::int16_t>(from);
            case PlyScalar::kUint16:
                return load<std::uint16_t>(from);
            case PlyScalar::kInt32:
                return load<std::int32_t>(from);
            case PlyScalar::kUint32:
                return load<std::uint32_t>(from);
            case PlyScalar::kFloat:
                return double{load<float>(from)};
            case PlyScalar::kDouble:
                break;
        }
        return load<double>(from);
    }

    /// The size of the file.
    std::uint64_t end_;
    std::uint64_t left_at_begin_ = 0;
};

}  // namespace mray
