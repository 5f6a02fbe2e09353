#include "clips/gltf/motion/motion_rates.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "clips/gltf/motion/interpolation.h"
#include "clips/gltf/motion/pose.h"

namespace mray::gltf {
namespace {

constexpr std::size_t kNoChannel = ~std::size_t{0};
// Stands for rates without a bound.
constexpr double kUnbounded = 1e15;

Rates sum(const Rates& a, const Rates& b) {
    return {a.length + b.length, a.speed + b.speed, a.acceleration + b.acceleration};
}

/// Rates of a product, for norms with |a * b| <= |a| * |b|.
Rates product(const Rates& a, const Rates& b) {
    return {a.length * b.length, a.speed * b.length + a.length * b.speed,
            a.acceleration * b.length + 2 * a.speed * b.speed + a.length * b.acceleration};
}

Rates larger(const Rates& a, const Rates& b) {
    return {std::max(a.length, b.length), std::max(a.speed, b.speed),
            std::max(a.acceleration, b.acceleration)};
}

Rates scaled(const Rates& a, double factor) {
    return {a.length * factor, a.speed * factor, a.acceleration * factor};
}

double length_of(const glm::dvec3& v) { return std::sqrt(v.x * v.x + v.y * v.y + v.z * v.z); }

double length_of(const glm::dvec4& v) { return std::sqrt(dot(v, v)); }

/// The Bezier points of up to four components of a channel in a key interval: the curve lies in
/// their hull, and its derivatives in those of their differences.
struct Curve {
    std::array<glm::dvec4, 4> points;
    double seconds = 0;
};

Curve curve_of(const Channel& channel, const KeyAt& at, std::size_t first, std::size_t count) {
    const bool is_spline = channel.interpolation == Interpolation::kCubicSpline;
    const auto value = [&](std::size_t key, std::size_t part) {
        glm::dvec4 result(0, 0, 0, 0);
        for (std::size_t k = 0; k < count; ++k) {
            const std::size_t index = is_spline ? 3 * key + part : key;
            result[static_cast<int>(k)] =
                static_cast<double>(channel.values[index * channel.width + first + k]);
        }
        return result;
    };
    const glm::dvec4 from = value(at.key, 1);
    if (at.seconds == 0 || channel.interpolation == Interpolation::kStep)
        return {{from, from, from, from}, 1};
    const glm::dvec4 to = value(at.key + 1, 1);
    const double third = at.seconds / 3;
    if (!is_spline)
        return {{from, from + (to - from) / 3.0, to - (to - from) / 3.0, to}, at.seconds};
    return {{from, from + value(at.key, 2) * third, to - value(at.key + 1, 0) * third, to},
            at.seconds};
}

Rates rates_of_curve(const Curve& curve, bool is_straight) {
    const auto& p = curve.points;
    Rates rates;
    for (const glm::dvec4& point : p) rates.length = std::max(rates.length, length_of(point));
    for (std::size_t i = 0; i < 3; ++i)
        rates.speed = std::max(rates.speed, 3 * length_of(p[i + 1] - p[i]) / curve.seconds);
    if (is_straight) return rates;
    for (std::size_t i = 0; i < 2; ++i) {
        rates.acceleration =
            std::max(rates.acceleration, 6 * length_of(p[i + 2] - 2.0 * p[i + 1] + p[i]) /
                                             (curve.seconds * curve.seconds));
    }
    return rates;
}

/// Bounds a rotation matrix of constant speed w: the norms of it and its two derivatives are 1, w,
/// w^2. Two quaternions with a chord of 2 * x have an angle of 2 * asin(x), at most 2 * x /
/// sqrt(1 - x^2), and rotations twice that.
Rates rates_of_slerp(const Curve& curve) {
    const glm::dvec4 from = unit_quaternion(curve.points[0]);
    const glm::dvec4 to = unit_quaternion(curve.points[3]);
    const double x = length_of(dot(from, to) < 0 ? from + to : to - from) / 2;
    const double speed = 4 * x / std::sqrt(std::max(1 - x * x, 0.5)) / curve.seconds;
    return {1, speed, speed * speed};
}

/// Bounds the rotation matrix of u = q / |q| for a curve q whose length is at least m:
/// |u'| <= |q'| / m and |u''| <= 2 |q''| / m + 4 |q'|^2 / m^2; the derivatives of the matrix are at
/// most 2 |u'| and 2 |u''| + 2 |u'|^2. All points of the curve lie at least as far along any
/// direction as one of the Bezier points.
Rates rates_of_rotation_curve(const Curve& curve) {
    const glm::dvec4 direction = unit_quaternion(curve.points[0] + curve.points[3]);
    double least = dot(curve.points[0], direction);
    for (const glm::dvec4& point : curve.points) least = std::min(least, dot(point, direction));
    if (!(least > 1e-3)) return {1, kUnbounded, kUnbounded};
    const Rates q = rates_of_curve(curve, false);
    const double speed = q.speed / least;
    const double acceleration = 2 * q.acceleration / least + 4 * speed * speed;
    return {1, 2 * speed, 2 * acceleration + 2 * speed * speed};
}

Rates rates_of_rotation(const Channel& channel, const KeyAt& at) {
    if (at.seconds == 0 || channel.interpolation == Interpolation::kStep) return {1, 0, 0};
    const Curve curve = curve_of(channel, at, 0, 4);
    return channel.interpolation == Interpolation::kLinear ? rates_of_slerp(curve)
                                                           : rates_of_rotation_curve(curve);
}

/// Returns the rates of components [first, first + count) together.
Rates rates_of_components(const Channel& channel, const KeyAt& at, std::size_t first,
                          std::size_t count) {
    return rates_of_curve(curve_of(channel, at, first, count),
                          channel.interpolation != Interpolation::kCubicSpline);
}

Rates rates_of_channel(const Channel& channel, const KeyAt& at) {
    if (channel.target == Target::kRotation) return rates_of_rotation(channel, at);
    if (channel.target == Target::kTranslation) return rates_of_components(channel, at, 0, 3);
    Rates rates;
    for (std::size_t k = 0; k < channel.width; ++k)
        rates = larger(rates, rates_of_components(channel, at, k, 1));
    return rates;
}

double stretch_of(const Affine& a) {
    double square = 0;
    for (std::size_t k = 0; k < 3; ++k) {
        const double length = length_of(a.column[k]);
        square += length * length;
    }
    return std::sqrt(square);
}

glm::dvec3 in_double(const vec3& p) {
    return {static_cast<double>(p.x), static_cast<double>(p.y), static_cast<double>(p.z)};
}

}  // namespace

MotionRates::MotionRates(const GltfScene& scene) : scene_(scene) {
    channels_of_node_.resize(scene.tree.nodes.size(),
                             {kNoChannel, kNoChannel, kNoChannel, kNoChannel});
    for (std::size_t i = 0; i < scene.animation.channels.size(); ++i) {
        const Channel& channel = scene.animation.channels[i];
        channels_of_node_[channel.node][static_cast<std::size_t>(channel.target)] = i;
    }
    for (std::size_t part = 0; part < scene.parts.size(); ++part) add_movers(part);
}

void MotionRates::add_movers(std::size_t index) {
    const Part& part = scene_.parts[index];
    const std::vector<vec3>& positions = part.set->positions;
    if (!part.skin) {
        Mover mover{.node = part.node, .part = index};
        for (const vec3& p : positions)
            mover.reach = std::max(mover.reach, length_of(in_double(p)));
        movers_.push_back(mover);
        return;
    }
    const Skin& skin = scene_.skins.at(*part.skin);
    const Influences& influences = part.set->influences;
    std::map<std::uint16_t, Mover> movers;
    for (std::size_t i = 0; i < influences.joints.size(); ++i) {
        if (!(influences.weights[i] > 0)) continue;
        const std::uint16_t joint = influences.joints[i];
        const Affine& to_joint = skin.inverse_binds[joint];
        Mover& mover = movers[joint];
        mover.node = skin.joints[joint];
        mover.part = index;
        mover.stretch = stretch_of(to_joint);
        const glm::dvec3 place =
            transformed(to_joint, in_double(positions[i / influences.per_vertex]));
        mover.reach = std::max(mover.reach, length_of(place));
    }
    for (const auto& [joint, mover] : movers) movers_.push_back(mover);
}

Rates MotionRates::displacement(std::size_t index, const ChannelRates& channels) const {
    const Part& part = scene_.parts[index];
    const std::size_t channel =
        channels_of_node_[part.node][static_cast<std::size_t>(Target::kWeights)];
    const std::vector<double>& rest = rest_weights(scene_, part);
    Rates total;
    for (std::size_t k = 0; k < part.set->targets.size(); ++k) {
        const Rates weight = channel == kNoChannel ? Rates{std::abs(rest[k]), 0, 0}
                                                   : channels.of_weights[channel][k];
        total = sum(total, scaled(weight, part.set->targets[k].reach));
    }
    return total;
}

Rates MotionRates::rates_of(const ChannelRates& channels) const {
    const std::size_t node_count = scene_.tree.nodes.size();
    // The rates of the linear part of the map from each node to world space, and of the node's
    // origin there.
    std::vector<Rates> linear(node_count);
    std::vector<Rates> origin(node_count);
    for (const std::uint32_t index : scene_.tree.parents_first) {
        const Node& node = scene_.tree.nodes[index];
        const auto rates = [&](Target target, double rest) {
            const std::size_t channel = channels_of_node_[index][static_cast<std::size_t>(target)];
            return channel == kNoChannel ? Rates{rest, 0, 0} : channels.of_channel[channel];
        };
        const glm::dvec3& s = node.trs.scale;
        Rates own =
            product(rates(Target::kRotation, 1),
                    rates(Target::kScale, std::max({std::abs(s.x), std::abs(s.y), std::abs(s.z)})));
        Rates place = rates(Target::kTranslation, length_of(node.trs.translation));
        if (node.matrix) {
            own = {stretch_of(*node.matrix), 0, 0};
            place = {length_of(node.matrix->column[3]), 0, 0};
        }
        const std::uint32_t parent = node.parent;
        linear[index] = parent == kNoNode ? own : product(linear[parent], own);
        origin[index] =
            parent == kNoNode ? place : sum(origin[parent], product(linear[parent], place));
    }
    std::vector<Rates> displacements;
    for (std::size_t part = 0; part < scene_.parts.size(); ++part)
        displacements.push_back(displacement(part, channels));
    Rates largest;
    for (const Mover& mover : movers_) {
        const Rates local =
            sum({mover.reach, 0, 0}, scaled(displacements[mover.part], mover.stretch));
        largest = larger(largest, sum(origin[mover.node], product(linear[mover.node], local)));
    }
    return largest;
}

Rates MotionRates::within(double begin, double end) const {
    ChannelRates rates;
    const double middle = begin + (end - begin) / 2;
    for (const Channel& channel : scene_.animation.channels) {
        const KeyAt at = key_at(channel.times, middle);
        std::vector<Rates> weights;
        for (std::size_t k = 0; channel.target == Target::kWeights && k < channel.width; ++k)
            weights.push_back(rates_of_components(channel, at, k, 1));
        rates.of_weights.push_back(std::move(weights));
        rates.of_channel.push_back(
            channel.target == Target::kWeights ? Rates{} : rates_of_channel(channel, at));
    }
    return rates_of(rates);
}

double MotionRates::reach() const {
    ChannelRates rates;
    for (const Channel& channel : scene_.animation.channels) {
        const bool is_weights = channel.target == Target::kWeights;
        std::vector<Rates> weights(is_weights ? channel.width : 0);
        Rates of_channel;
        for (std::size_t key = 0; key < channel.times.size(); ++key) {
            KeyAt at{key};
            if (key + 1 < channel.times.size()) {
                at.seconds = static_cast<double>(channel.times[key + 1]) -
                             static_cast<double>(channel.times[key]);
            }
            for (std::size_t k = 0; k < weights.size(); ++k)
                weights[k] = larger(weights[k], rates_of_components(channel, at, k, 1));
            if (!is_weights) of_channel = larger(of_channel, rates_of_channel(channel, at));
        }
        rates.of_weights.push_back(std::move(weights));
        rates.of_channel.push_back(of_channel);
    }
    return rates_of(rates).length;
}

}  // namespace mray::gltf
