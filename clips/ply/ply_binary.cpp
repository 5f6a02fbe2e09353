#include "clips/ply/ply_binary.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <limits>
#include <memory>
#include <type_traits>
#include <vector>

#include "common/base/errors.h"

namespace mray {
namespace {

constexpr std::size_t kBufferBytes = std::size_t{256} << 10;

/// A number in the file; `kSwap` if its bytes are in the other order than the machine's.
template <class T, bool kSwap>
T load(const std::byte* from) {
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

template <class T>
float to_float(T value) {
    if constexpr (std::is_same_v<T, double>) {
        constexpr double kMost = std::numeric_limits<float>::max();
        constexpr float kInfinity = std::numeric_limits<float>::infinity();
        if (value > kMost) return kInfinity;
        if (value < -kMost) return -kInfinity;
    }
    return static_cast<float>(value);
}

/// Calls `use` with a value of the C++ type of `type`.
template <class Use>
void with_type(PlyScalar type, const Use& use) {
    switch (type) {
        case PlyScalar::kInt8:
            return use(std::int8_t{});
        case PlyScalar::kUint8:
            return use(std::uint8_t{});
        case PlyScalar::kInt16:
            return use(std::int16_t{});
        case PlyScalar::kUint16:
            return use(std::uint16_t{});
        case PlyScalar::kInt32:
            return use(std::int32_t{});
        case PlyScalar::kUint32:
            return use(std::uint32_t{});
        case PlyScalar::kFloat:
            return use(float{});
        case PlyScalar::kDouble:
            return use(double{});
    }
}

/// Bytes of the file from an offset on, as many as the buffer holds at a time.
class Source {
public:
    Source(const InputFile& file, std::uint64_t offset)
        : file_(file), offset_(offset), buffer_(new std::byte[kBufferBytes]) {}

    /// The offset in the file of the next byte.
    std::uint64_t offset() const { return offset_ - (end_ - at_); }
    std::uint64_t left() const { return file_.size() - offset(); }

    /// The next bytes, at least `count` of at most kBufferBytes that the file must have.
    const std::byte* next(std::size_t count) {
        if (end_ - at_ < count) fill();
        return buffer_.get() + at_;
    }
    /// How many bytes lie at next().
    std::size_t ready() const { return end_ - at_; }
    /// Drops bytes that next() gave.
    void take(std::size_t count) { at_ += count; }
    void skip(std::uint64_t count) {
        const std::uint64_t from_buffer = std::min<std::uint64_t>(count, end_ - at_);
        at_ += static_cast<std::size_t>(from_buffer);
        offset_ += count - from_buffer;
    }

private:
    void fill() {
        const std::size_t kept = end_ - at_;
        std::memmove(buffer_.get(), buffer_.get() + at_, kept);
        const auto more = static_cast<std::size_t>(
            std::min<std::uint64_t>(kBufferBytes - kept, file_.size() - offset_));
        file_.read(offset_, {buffer_.get() + kept, more});
        offset_ += more;
        at_ = 0;
        end_ = kept + more;
    }

    const InputFile& file_;
    /// The offset in the file of the end of the buffer.
    std::uint64_t offset_;
    std::unique_ptr<std::byte[]> buffer_;
    std::size_t at_ = 0;
    std::size_t end_ = 0;
};

template <bool kSwap>
class BinaryBody {
public:
    BinaryBody(const InputFile& file, std::uint64_t offset, const std::string& name, PlyMesh& mesh)
        : source_(file, offset),
          name_(name),
          mesh_(mesh),
          place_([this] { return place(item_offset_); }) {}

    void read(const PlyElement& element) {
        const bool is_read = std::any_of(
            element.properties.begin(), element.properties.end(),
            [](const PlyProperty& property) { return property.role != PlyRole::kNone; });
        if (element.properties.empty()) return;
        if (!element.has_lists() && !is_read) {
            if (source_.left() < element.count * element.least_bytes()) fail_end(element, 0);
            source_.skip(element.count * element.least_bytes());
        } else if (!element.has_lists() && element.least_bytes() <= kBufferBytes) {
            read_columns(element);
        } else if (is_list_of_triangles(element)) {
            read_triangles(element);
        } else {
            for (std::uint64_t item = 0; item < element.count; ++item)
                read_item(element, static_cast<std::size_t>(item));
        }
    }

    std::uint64_t offset() const { return source_.offset(); }

private:
    std::string place(std::uint64_t offset) const {
        return fmt::format("{}: byte {}", name_, offset);
    }
    [[noreturn]] void fail_end(const PlyElement& element, std::uint64_t item) const {
        throw Error(ErrorKind::kBadInput,
                    fmt::format("{}: ends within {} {} of {}; is the file complete?",
                                place(item_offset_), element.shown_name(), item, element.count));
    }

    /// Reads items without lists, in blocks that fit into the buffer, a property at a time.
    void read_columns(const PlyElement& element) {
        const auto stride = static_cast<std::size_t>(element.least_bytes());
        std::size_t item = 0;
        while (item < element.count) {
            const auto count = static_cast<std::size_t>(
                std::min<std::uint64_t>(kBufferBytes / stride, element.count - item));
            const std::uint64_t begin = source_.offset();
            if (source_.left() < count * stride) fail_end(element, item);
            const std::byte* column = source_.next(count * stride);
            for (const PlyProperty& property : element.properties) {
                if (property.role != PlyRole::kNone)
                    read_column(property, column, stride, item, count);
                column += size_of(property.type);
            }
            const std::size_t first = item;
            mesh_.check_vertices(item, item + count, [&](std::size_t i) {
                return place(begin + (i - first) * stride);
            });
            source_.take(count * stride);
            item += count;
        }
    }

    void read_column(const PlyProperty& property, const std::byte* from, std::size_t stride,
                     std::size_t first, std::size_t count) {
        const int axis = PlyMesh::axis_of(property.role);
        vec3* const out = mesh_.components(property.role).data() + first;
        const bool is_channel = property.role >= PlyRole::kRed;
        with_type(property.type, [&](auto type) {
            using T = decltype(type);
            for (std::size_t i = 0; i < count; ++i) {
                const T value = load<T, kSwap>(from + i * stride);
                if constexpr (std::is_same_v<T, std::uint8_t>)
                    out[i][axis] = is_channel ? PlyMesh::linear_channel(value) : to_float(value);
                else
                    out[i][axis] = to_float(value);
            }
        });
    }

    /// Whether faces have a list alone, with a count of one byte and integers of 32 bits, as in
    /// nearly all files.
    static bool is_list_of_triangles(const PlyElement& element) {
        if (element.properties.size() != 1) return false;
        const PlyProperty& list = element.properties[0];
        return list.role == PlyRole::kFace && size_of(*list.count_type) == 1 &&
               size_of(list.type) == 4;
    }

    void read_triangles(const PlyElement& element) {
        // Each takes 13 bytes, if they are triangles.
        mesh_.reserve_triangles(std::min(element.count, source_.left() / kTriangleBytes));
        for (std::uint64_t item = 0; item < element.count;) {
            item_offset_ = source_.offset();
            const std::size_t count = read_some_triangles(element.count - item);
            item += count;
            if (count == 0) read_item(element, static_cast<std::size_t>(item++));
        }
    }

    /// Reads the next triangles up to a face that is none or whose corners are not there. Returns
    /// their number, at most `most`.
    std::size_t read_some_triangles(std::uint64_t most) {
        if (source_.left() < kTriangleBytes) return 0;
        const std::byte* from = source_.next(kTriangleBytes);
        const auto end = static_cast<std::size_t>(
            std::min<std::uint64_t>({most, source_.ready() / kTriangleBytes, kBatch}));
        const std::size_t vertex_count = mesh_.vertex_count();
        std::size_t count = 0;
        for (; count < end; ++count, from += kTriangleBytes) {
            const auto a = load<std::uint32_t, kSwap>(from + 1);
            const auto b = load<std::uint32_t, kSwap>(from + 5);
            const auto c = load<std::uint32_t, kSwap>(from + 9);
            // Negative ones are large, and no file has as many vertices.
            if (from[0] != std::byte{3} || std::max({a, b, c}) >= vertex_count) break;
            batch_[3 * count] = a;
            batch_[3 * count + 1] = b;
            batch_[3 * count + 2] = c;
        }
        mesh_.add_triangles(std::span(batch_).first(3 * count), place_);
        source_.take(count * kTriangleBytes);
        return count;
    }

    void read_item(const PlyElement& element, std::size_t item) {
        item_offset_ = source_.offset();
        bool has_components = false;
        for (const PlyProperty& property : element.properties) {
            const std::size_t size = size_of(property.count_type.value_or(property.type));
            if (source_.left() < size) fail_end(element, item);
            const std::byte* const from = source_.next(size);
            if (property.count_type) {
                const std::int64_t count = load_integer(*property.count_type, from);
                source_.take(size);
                read_list(element, item, property, count);
                continue;
            }
            if (property.role != PlyRole::kNone) {
                has_components = true;
                read_column(property, from, size, item, 1);
            }
            source_.take(size);
        }
        if (has_components)
            mesh_.check_vertices(item, item + 1, [this](std::size_t) { return place_(); });
    }

    void read_list(const PlyElement& element, std::size_t item, const PlyProperty& property,
                   std::int64_t count) {
        const std::size_t size = size_of(property.type);
        if (count < 0) {
            throw Error(ErrorKind::kBadInput,
                        fmt::format("{}: list of {} entries in {} {}; is the header right?",
                                    place(item_offset_), count, element.shown_name(), item));
        }
        const auto entries = static_cast<std::uint64_t>(count);
        if (source_.left() / size < entries) fail_end(element, item);
        if (property.role == PlyRole::kNone) {
            source_.skip(entries * size);
            return;
        }
        corners_.clear();
        while (corners_.size() < entries) {
            const std::byte* const from = source_.next(size);
            const auto ready = static_cast<std::size_t>(
                std::min<std::uint64_t>(source_.ready() / size, entries - corners_.size()));
            for (std::size_t i = 0; i < ready; ++i)
                corners_.push_back(load_integer(property.type, from + i * size));
            source_.take(ready * size);
        }
        if (property.role == PlyRole::kFace)
            mesh_.add_face(corners_, place_);
        else
            mesh_.add_strips(corners_, place_);
    }

    static std::int64_t load_integer(PlyScalar type, const std::byte* from) {
        std::int64_t integer = 0;
        with_type(type, [&](auto value) {
            using T = decltype(value);
            if constexpr (std::is_integral_v<T>) integer = load<T, kSwap>(from);
        });
        return integer;
    }

    static constexpr std::size_t kTriangleBytes = 1 + 3 * sizeof(std::uint32_t);
    /// Triangles at a time.
    static constexpr std::size_t kBatch = 1024;

    Source source_;
    const std::string& name_;
    PlyMesh& mesh_;
    std::array<std::uint32_t, 3 * kBatch> batch_;
    /// Where the item begins that is read.
    std::uint64_t item_offset_ = 0;
    const PlyMesh::Place place_;
    std::vector<std::int64_t> corners_;
};

template <bool kSwap>
std::uint64_t read_body(const InputFile& file, const PlyHeader& header, const std::string& name,
                        PlyMesh& mesh) {
    BinaryBody<kSwap> body(file, header.size, name, mesh);
    for (const PlyElement& element : header.elements) body.read(element);
    return body.offset();
}

}  // namespace

std::uint64_t read_ply_binary(const InputFile& file, const PlyHeader& header,
                              const std::string& name, PlyMesh& mesh) {
    static_assert(std::endian::native == std::endian::little);
    return header.encoding == PlyEncoding::kBigEndian ? read_body<true>(file, header, name, mesh)
                                                      : read_body<false>(file, header, name, mesh);
}

}  // namespace mray
