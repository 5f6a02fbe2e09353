// The only file that includes meshoptimizer.
#include "scenes/gltf/file/compressed_view.h"

#include <fmt/format.h>
#include <meshoptimizer.h>

#include <array>
#include <cstdint>
#include <string_view>
#include <utility>

#include "common/text/message_text.h"
#include "scenes/gltf/file/view_filters.h"

namespace mray::gltf {
namespace {

// A group of 16 bytes takes two bits or more, and a triangle of 12 bytes one byte: no stream says
// more than this, but for its last groups, of which each byte of an element has one.
constexpr std::uint64_t kMostCompression = 64;
constexpr std::uint64_t kMostInLastGroups = 16 * 256;

// Numbers are read into up to four times their bytes.
constexpr std::uint64_t kBudgetPerPackedByte = 5;

enum class Mode { kAttributes, kTriangles, kIndices };

/// The value of a member whose text is one of some names.
template <class Value, std::size_t kCount>
Value choice_of(const JsonAt& at,
                const std::array<std::pair<std::string_view, Value>, kCount>& choices) {
    std::string names;
    for (const auto& [name, value] : choices) {
        if (at.text() == name) return value;
        names += fmt::format("{}{}", names.empty() ? "" : ", ", name);
    }
    at.fail(fmt::format("is {}; must be one of {}", in_quotes(at.text()), names));
}

struct Compression {
    Mode mode = Mode::kAttributes;
    ViewFilter filter = ViewFilter::kNone;
    std::uint64_t stride = 0;
    std::uint64_t count = 0;
};

/// Checks the members against each other, as the extension does.
Compression read_compression(const JsonAt& view, const JsonAt& at) {
    Compression result;
    result.mode = choice_of<Mode, 3>(at.at("mode"), {{{"ATTRIBUTES", Mode::kAttributes},
                                                      {"TRIANGLES", Mode::kTriangles},
                                                      {"INDICES", Mode::kIndices}}});
    if (const auto filter = at.find("filter")) {
        result.filter =
            choice_of<ViewFilter, 4>(*filter, {{{"NONE", ViewFilter::kNone},
                                                {"OCTAHEDRAL", ViewFilter::kOctahedral},
                                                {"QUATERNION", ViewFilter::kQuaternion},
                                                {"EXPONENTIAL", ViewFilter::kExponential}}});
    }
    const bool is_attributes = result.mode == Mode::kAttributes;
    result.count = at.at("count").count();
    if (result.mode == Mode::kTriangles && result.count % 3 != 0)
        at.at("count").fail(fmt::format("is {}, no multiple of 3", result.count));
    result.stride = at.at("byteStride").count();
    const bool fits = is_attributes
                          ? result.stride % 4 == 0 && result.stride <= 256 && result.stride > 0 &&
                                fits_filter(result.filter, result.stride)
                          : result.stride == 2 || result.stride == 4;
    if (!fits) {
        at.at("byteStride")
            .fail(fmt::format("is {}, which its mode or filter does not allow", result.stride));
    }
    if (!is_attributes && result.filter != ViewFilter::kNone)
        at.at("filter").fail("belongs to the mode ATTRIBUTES");
    if (const auto stride = view.find("byteStride"); stride && stride->count() != result.stride) {
        stride->fail(fmt::format("is {}, but the compressed elements have {} bytes",
                                 stride->count(), result.stride));
    }
    // At most 2^53 / 256 elements have this length, so that the product does not overflow.
    const std::uint64_t length = view.at("byteLength").count();
    if (result.count > length || length != result.stride * result.count) {
        view.at("byteLength")
            .fail(fmt::format("is {}, but {} elements of {} bytes are compressed", length,
                              result.count, result.stride));
    }
    return result;
}

std::string_view encoded_bytes(const JsonAt& at, std::span<const Buffer> buffers) {
    const std::size_t index = at.at("buffer").index_below(buffers.size(), "buffers");
    const std::string_view bytes = buffers[index].bytes;
    const std::uint64_t offset = at.count_or("byteOffset", 0);
    const std::uint64_t length = at.at("byteLength").count();
    if (length > bytes.size() || offset > bytes.size() - length) {
        at.at("byteLength")
            .fail(fmt::format("bytes {} to {} are not in the buffer, which has {}", offset,
                              offset + length, bytes.size()));
    }
    return bytes.substr(offset, length);
}

}  // namespace

std::string decompressed(const JsonAt& view, const JsonAt& compression,
                         std::span<const Buffer> buffers, ContentBudget& budget) {
    const Compression c = read_compression(view, compression);
    const std::string_view encoded = encoded_bytes(compression, buffers);
    const std::uint64_t length = c.stride * c.count;
    if (length > kMostCompression * encoded.size() + kMostInLastGroups) {
        compression.at("count").fail(
            fmt::format("is {}, more elements than {} bytes can have; is the file complete?",
                        c.count, encoded.size()));
    }
    if (!budget.take(length))
        view.fail("has more bytes, once it is decompressed, than the file's size allows");
    std::string bytes(length, '\0');
    const auto* const from = reinterpret_cast<const unsigned char*>(encoded.data());
    int error = 0;
    switch (c.mode) {
        case Mode::kAttributes:
            error =
                meshopt_decodeVertexBuffer(bytes.data(), c.count, c.stride, from, encoded.size());
            break;
        case Mode::kTriangles:
            error =
                meshopt_decodeIndexBuffer(bytes.data(), c.count, c.stride, from, encoded.size());
            break;
        case Mode::kIndices:
            error =
                meshopt_decodeIndexSequence(bytes.data(), c.count, c.stride, from, encoded.size());
            break;
    }
    if (error != 0)
        compression.fail("its bytes are not compressed as it says; is the file complete?");
    apply_filter(c.filter, c.stride, bytes);
    budget.add(kBudgetPerPackedByte * length);
    return bytes;
}

}  // namespace mray::gltf
