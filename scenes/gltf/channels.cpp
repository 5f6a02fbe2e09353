#include "scenes/gltf/gltf_scene.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <set>
#include <utility>

#include "common/base/errors.h"
#include "common/text/number_text.h"
#include "common/text/text_parts.h"

namespace mray::gltf {
namespace {

// Beyond this neighbouring frames are no longer told apart.
constexpr float kMostSeconds = 1e6f;
/// Three values a key.
constexpr std::size_t kSplineParts = 3;

std::string list_of(const std::vector<std::string>& names) {
    std::string list;
    for (std::size_t i = 0; i < names.size(); ++i)
        list += fmt::format("{}{} {}", i == 0 ? "" : ", ", i, quote(names[i]));
    return list;
}

Target target_of(const JsonAt& path) {
    constexpr std::pair<std::string_view, Target> kTargets[] = {
        {"translation", Target::kTranslation},
        {"rotation", Target::kRotation},
        {"scale", Target::kScale},
        {"weights", Target::kWeights}};
    for (const auto& [name, target] : kTargets)
        if (path.text() == name) return target;
    path.fail("is {}; must be translation, rotation, scale or weights", quote(path.text()));
}

Interpolation interpolation_of(const JsonAt& sampler) {
    const auto given = sampler.find("interpolation");
    if (!given || given->text() == "LINEAR") return Interpolation::kLinear;
    if (given->text() == "STEP") return Interpolation::kStep;
    if (given->text() == "CUBICSPLINE") return Interpolation::kCubicSpline;
    given->fail("is {}; must be LINEAR, STEP or CUBICSPLINE", quote(given->text()));
}

class AnimationReader {
public:
    AnimationReader(const GltfFile& file, std::size_t index, const AnimationOptions& options,
                    GltfScene& scene)
        : options_(options),
          file_(file),
          at_(file.element("animations", index)),
          scene_(scene),
          animation_(scene.animation) {}

    void run() {
        const JsonAt channels = at_.at("channels");
        for (std::size_t i = 0; i < channels.size(); ++i) read_channel(channels[i]);
        equal_times_.tell(options_.warn);
    }

private:
    void read_channel(const JsonAt& at) {
        const JsonAt target = at.at("target");
        const auto node = target.index_or_none("node", file_.count("nodes"), "nodes");
        if (!node) return;  // An extension's target.
        const JsonAt samplers = at_.at("samplers");
        const JsonAt sampler = samplers[at.at("sampler").index_below(samplers.size(), "samplers")];
        Channel channel{.node = *node,
                        .target = target_of(target.at("path")),
                        .interpolation = interpolation_of(sampler)};
        if (!known_.insert({channel.node, channel.target}).second)
            target.fail("is that of another channel, too");
        channel.times = times_of(sampler.at("input"));
        animation_.seconds =
            std::max(animation_.seconds, static_cast<double>(channel.times.back()));
        const Node& moved = scene_.tree.nodes[*node];
        if (channel.target == Target::kWeights) {
            const auto mesh = moved.mesh ? scene_.meshes.find(*moved.mesh) : scene_.meshes.end();
            // The mesh of a node that is not shown has not been read.
            if (moved.mesh && mesh == scene_.meshes.end()) return;
            channel.width = moved.mesh ? mesh->second.target_count : 0;
            if (channel.width == 0) target.fail("has no morph targets");
        } else if (moved.matrix) {
            file_.element("nodes", *node)
                .at("matrix")
                .fail(
                    "stands in a node that an animation moves; give translation, rotation and "
                    "scale");
        }
        if (channel.target == Target::kRotation) channel.width = 4;
        channel.values = values_of(sampler.at("output"), channel);
        animation_.channels.push_back(channel);
    }

    std::span<const float> numbers_of(const JsonAt& reference, const Wanted& wanted) {
        const std::tuple key(reference.index_below(file_.count("accessors"), "accessors"),
                             wanted.width, wanted.integers != Wanted::Integers::kNone);
        auto known = animation_.numbers.find(key);
        if (known == animation_.numbers.end()) {
            std::vector<float> values = floats(file_, reference, wanted);
            known = animation_.numbers.emplace(key, std::move(values)).first;
            for (std::size_t i = 0; i < known->second.size(); ++i) {
                if (!std::isfinite(known->second[i])) reference.fail("number {} is not finite", i);
            }
        }
        return known->second;
    }

    /// Equal times are an error; if lenient, a warning, and the later one holds.
    void check_times(const JsonAt& reference, std::span<const float> times) {
        for (std::size_t i = 0; i < times.size(); ++i) {
            if (times[i] >= 0 && times[i] <= kMostSeconds && (i == 0 || times[i] > times[i - 1]))
                continue;
            if (i > 0 && times[i] == times[i - 1]) {
                const std::string what = fmt::format("times {} and {} are equal", i - 1, i);
                if (!options_.lenient) reference.fail(what + "; repair them", Hint::kLenient);
                equal_times_.add([&] {
                    return Warning{file_.name(), fmt::format("{}: {}; the later one holds",
                                                             reference.path(), what)};
                });
                continue;
            }
            reference.fail("time {} is {}; times must increase, from 0 to {}", i, times[i],
                           kMostSeconds);
        }
    }

    std::span<const float> times_of(const JsonAt& reference) {
        const std::span<const float> times = numbers_of(reference, {});
        if (checked_times_.insert(times.data()).second) check_times(reference, times);
        return times;
    }

    std::span<const float> values_of(const JsonAt& reference, const Channel& channel) {
        const bool is_scalar = channel.target == Target::kWeights;
        const bool may_be_integers = is_scalar || channel.target == Target::kRotation;
        const std::span<const float> values = numbers_of(
            reference, {is_scalar ? 1 : channel.width,
                        may_be_integers ? Wanted::Integers::kNormalized : Wanted::Integers::kNone});
        const std::size_t parts =
            channel.interpolation == Interpolation::kCubicSpline ? kSplineParts : 1;
        if (values.size() / parts / channel.width != channel.times.size() ||
            values.size() % (parts * channel.width) != 0) {
            reference.fail("has {} numbers for {} times of {}", values.size(), channel.times.size(),
                           parts * channel.width);
        }
        return values;
    }

    const AnimationOptions& options_;
    const GltfFile& file_;
    const JsonAt at_;
    const GltfScene& scene_;
    ChannelSet& animation_;
    std::set<std::pair<std::uint32_t, Target>> known_;
    std::set<const float*> checked_times_;
    WarningCount equal_times_;
};

double value_at(const Channel& channel, std::size_t key, std::size_t part, std::size_t k) {
    const bool is_spline = channel.interpolation == Interpolation::kCubicSpline;
    const std::size_t value = is_spline ? kSplineParts * key + part : key;
    return static_cast<double>(channel.values[value * channel.width + k]);
}

glm::dvec4 quaternion_at(const Channel& channel, std::size_t key) {
    return unit_quaternion({value_at(channel, key, 1, 0), value_at(channel, key, 1, 1),
                            value_at(channel, key, 1, 2), value_at(channel, key, 1, 3)});
}

void write(const glm::dvec4& q, std::span<double> out) {
    for (int k = 0; k < 4; ++k) out[static_cast<std::size_t>(k)] = q[k];
}

/// The last key at or before a time, or the end key, and the way to the next, in [0, 1).
struct KeyAt {
    std::size_t key = 0;
    double u = 0;
    /// From the key to the next one; 0 if u is 0.
    double seconds = 0;
};

KeyAt key_at(std::span<const float> times, double time) {
    const auto after = std::upper_bound(times.begin(), times.end(), time,
                                        [](double t, float key) { return t < double{key}; });
    if (after == times.begin()) return {};
    const auto key = static_cast<std::size_t>(after - times.begin()) - 1;
    if (after == times.end()) return {key};
    const double from = static_cast<double>(times[key]);
    const double seconds = static_cast<double>(times[key + 1]) - from;
    if (time == from) return {key};
    return {key, (time - from) / seconds, seconds};
}

void sample_spline(const Channel& channel, const KeyAt& at, std::span<double> out) {
    const std::array<double, 4> weights = hermite_weights(at.u, at.seconds);
    for (std::size_t k = 0; k < channel.width; ++k) {
        out[k] = weights[0] * value_at(channel, at.key, 1, k) +
                 weights[1] * value_at(channel, at.key, 2, k) +
                 weights[2] * value_at(channel, at.key + 1, 1, k) +
                 weights[3] * value_at(channel, at.key + 1, 0, k);
    }
}

}  // namespace

std::vector<std::string> animation_names(const GltfFile& file) {
    std::vector<std::string> names;
    const std::size_t count = file.count("animations");
    for (std::size_t i = 0; i < count; ++i) {
        const auto name = file.element("animations", i).find("name");
        names.push_back(name && name->is_text() ? std::string(name->text()) : std::string());
    }
    return names;
}

std::size_t find_animation(const GltfFile& file, const std::string& text) {
    if (text.empty()) return 0;
    const std::vector<std::string> names = animation_names(file);
    if (names.empty()) {
        throw Error(ErrorKind::kBadArgument, "animation {}: {} has no animations", quote(text),
                    file.name());
    }
    const auto named = std::find(names.begin(), names.end(), text);
    if (named != names.end()) return static_cast<std::size_t>(named - names.begin());
    const std::optional<std::uint64_t> index = parse_unsigned(text);
    if (index && *index < names.size()) return static_cast<std::size_t>(*index);
    throw Error(ErrorKind::kBadArgument, "animation {}: {} has no such one; choose one of {}",
                quote(text), file.name(), list_of(names));
}

void read_animation(const GltfFile& file, std::size_t index, const AnimationOptions& options,
                    GltfScene& scene) {
    AnimationReader(file, index, options, scene).run();
}

void sample(const Channel& channel, double time, std::span<double> out) {
    const KeyAt at = key_at(channel.times, time);
    const bool is_rotation = channel.target == Target::kRotation;
    if (at.u == 0 || channel.interpolation == Interpolation::kStep) {
        for (std::size_t k = 0; k < channel.width; ++k) out[k] = value_at(channel, at.key, 1, k);
    } else if (channel.interpolation == Interpolation::kCubicSpline) {
        sample_spline(channel, at, out);
    } else if (is_rotation) {
        return write(
            slerp(quaternion_at(channel, at.key), quaternion_at(channel, at.key + 1), at.u), out);
    } else {
        for (std::size_t k = 0; k < channel.width; ++k) {
            const double a = value_at(channel, at.key, 1, k);
            out[k] = a + (value_at(channel, at.key + 1, 1, k) - a) * at.u;
        }
    }
    if (is_rotation) write(unit_quaternion({out[0], out[1], out[2], out[3]}), out);
}

}  // namespace mray::gltf
