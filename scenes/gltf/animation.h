// The animation of a glTF file that is shown.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <tuple>
#include <vector>

#include "scenes/gltf/accessor.h"

namespace mray::gltf {

enum class Interpolation : std::uint8_t { kStep, kLinear, kCubicSpline };
enum class Target : std::uint8_t { kTranslation, kRotation, kScale, kWeights };

/// One property of a node over time.
struct Channel {
    std::uint32_t node = 0;
    Target target = Target::kTranslation;
    Interpolation interpolation = Interpolation::kLinear;
    /// Numbers a value: 3, 4, or the number of morph targets.
    std::size_t width = 3;
    /// Seconds; they increase.
    std::span<const float> times = {};
    /// `width` numbers for each time; of a cubic spline in-tangent, value and out-tangent.
    std::span<const float> values = {};
};

/// Values of all channels; rotations have directions.
struct Animation {
    std::vector<Channel> channels;
    /// The last time of any channel.
    double seconds = 0;

    /// The numbers that the channels refer to, by the index of the accessor, the numbers an element
    /// has, and whether it may have integers.
    std::map<std::tuple<std::uint32_t, std::size_t, bool>, std::vector<float>> numbers = {};
};

/// Which animation a text means: one of that name, or of that index; without text the first. Throws
/// Error(kBadArgument) that lists the names.
std::size_t find_animation(const GltfFile& file, const std::string& text);

/// `target_counts` has the number of morph targets of each node. Throws Error(kBadInput) for times
/// that are negative, not finite or do not increase, values that are not finite or do not fit, and
/// two channels of one property.
Animation read_animation(const GltfFile& file, std::size_t index,
                         std::span<const std::size_t> target_counts);

/// The names of all animations of a file, empty where it gives none.
std::vector<std::string> animation_names(const GltfFile& file);

/// The value of a channel at a time in seconds; a rotation has length 1.
void sample(const Channel& channel, double time, std::span<double> out);

}  // namespace mray::gltf
