// The differences of two OpenEXR images.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "app/files/exr_reader.h"

namespace mray::app {

/// The meaning of a channel. A pixel is counted once, for the first kind that differs.
enum class ExrKind { kPrimId, kGeomId, kT, kUv, kNormal, kOcclusion, kColour, kOther };
inline constexpr std::size_t kExrKindCount = 8;

struct ExrKindInfo {
    const char* name;
    /// In images of differences; where `mray::difference_kinds` has the kind, the same.
    std::uint32_t colour;
};
const ExrKindInfo& info_of(ExrKind kind);

/// The kind of a channel of `render --exr` by its name, and of R, G, B, A, Y and Z of others.
ExrKind kind_of_channel(const std::string& name);

/// A channel of either image.
struct ExrChannelDifference {
    std::string name;
    ExrKind kind = ExrKind::kOther;
    /// Nothing where a file lacks it. Values are compared where both types are the same.
    std::optional<ExrType> expected_type;
    std::optional<ExrType> actual_type;
    /// Pixels that differ, as bits.
    std::uint64_t pixels = 0;
    /// The largest difference, actual less expected, of those that are finite, and its first pixel;
    /// for `uint` channels 0 and the first pixel that differs.
    double by = 0;
    std::uint32_t x = 0;
    std::uint32_t y = 0;
    /// Pixels of which one value is infinite or NaN.
    std::uint64_t not_finite = 0;

    bool is_compared() const { return expected_type && expected_type == actual_type; }
    bool equal() const { return is_compared() && pixels == 0; }
};

/// A pixel that differs: each channel that differs, with the bits of both values.
struct ExrPixelDifference {
    std::uint32_t x = 0;
    std::uint32_t y = 0;
    struct Value {
        /// An index of ExrComparison::channels.
        std::size_t channel = 0;
        std::uint32_t expected = 0;
        std::uint32_t actual = 0;
    };
    std::vector<Value> values;
};

struct ExrComparison {
    std::uint32_t width = 0;
    std::uint32_t height = 0;
    /// The channels of both files, sorted by name.
    std::vector<ExrChannelDifference> channels;
    /// Differing pixels by ExrKind.
    std::array<std::uint64_t, kExrKindCount> kinds = {};
    /// The first pixels that differ, row by row, at most 10.
    std::vector<ExrPixelDifference> first;

    std::uint64_t pixels() const;
    bool equal() const;
};

/// Two OpenEXR files.
struct ExrDiffReport {
    std::string expected;
    std::string actual;
    ExrComparison comparison;
};
/// The value of a channel: floats in hexadecimal.
std::string value_text(ExrType type, std::uint32_t bits);

std::string to_json(const ExrDiffReport& report);

}  // namespace mray::app
