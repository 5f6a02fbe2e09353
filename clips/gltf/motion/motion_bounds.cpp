#include "clips/gltf/motion/motion_bounds.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_reduce.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <vector>

#include "clips/gltf/motion/motion_rates.h"

namespace mray::gltf {
namespace {

// How far a vertex may leave the line between its places at two times:
//
// 1. In an interval without a key inside, the place under a joint (or node) is a product of smooth
//    functions of the time. A function f with |f''| <= a leaves its chord over h seconds by at most
//    a * h^2 / 8.
// 2. The place of a vertex is the mean, by constant weights, of its places under its joints; so is
//    its distance from the chord.
// 3. At a key a channel that steps has two values; the box takes the places just before the key and
//    at it.
// 4. Places are rounded to float, by less than 2^-23 of the largest coordinate together with the
//    errors of double arithmetic.

constexpr double kMostWork = 0x1p29;
constexpr double kMostWorkBetween = 0x1p26;
constexpr double kWantedPad = 1.0 / 256;
constexpr double kMostPieces = 256;
constexpr double kRounding = 0x1p-22;

/// Times of the keys, from 0 on.
std::vector<double> key_times(const Animation& animation) {
    std::vector<double> times = {0};
    // Channels mostly share their times.
    std::set<const float*> known;
    for (const Channel& channel : animation.channels) {
        if (!known.insert(channel.times.data()).second) continue;
        for (const float time : channel.times) times.push_back(static_cast<double>(time));
    }
    std::sort(times.begin(), times.end());
    times.erase(std::unique(times.begin(), times.end()), times.end());
    return times;
}

bool has_steps(const Animation& animation) {
    return std::any_of(
        animation.channels.begin(), animation.channels.end(),
        [](const Channel& channel) { return channel.interpolation == Interpolation::kStep; });
}

double diagonal(const WorldBounds& bounds) {
    double square = 0;
    for (int axis = 0; axis < 3; ++axis) {
        const double side = bounds.upper[axis] - bounds.lower[axis];
        square += side * side;
    }
    return bounds.empty() ? 0 : std::sqrt(square);
}

void extend(WorldBounds& bounds, const WorldBounds& other) {
    if (!other.empty()) bounds.extend(other.lower, other.upper);
}

WorldBounds bounds_of_all(std::span<const vec3> points) {
    constexpr std::size_t kGrain = 16384;
    using Range = tbb::blocked_range<std::size_t>;
    return tbb::parallel_reduce(
        Range(0, points.size(), kGrain), WorldBounds{},
        [&](const Range& range, WorldBounds bounds) {
            extend(bounds, bounds_of(points.subspan(range.begin(), range.size())));
            return bounds;
        },
        [](WorldBounds a, const WorldBounds& b) {
            extend(a, b);
            return a;
        });
}

class Bounder {
public:
    Bounder(const GltfScene& scene, const Skinning& skinning, const Watch& watch)
        : scene_(scene),
          skinning_(skinning),
          watch_(watch),
          rates_(scene),
          positions_(scene.topology.vertex_count),
          times_(key_times(scene.animation)) {}

    MotionBounds run() {
        look(0);
        if (scene_.animation.channels.empty()) return result_;
        const double samples = static_cast<double>(times_.size());
        if (samples * work_of_sample() > kMostWork) {
            hold_reach();
            return result_;
        }
        look_at_keys();
        widen(std::min(pad_between_keys(), 2 * rates_.reach()));
        return result_;
    }

private:
    /// In vertices.
    double work_of_sample() const {
        constexpr double kPerItem = 30;
        std::size_t items = scene_.tree.nodes.size() + scene_.animation.channels.size();
        for (const auto& [index, skin] : scene_.skins) items += skin.joints.size();
        for (const Part& part : scene_.parts) items += part.set->targets.size();
        return static_cast<double>(scene_.topology.vertex_count) +
               kPerItem * static_cast<double>(items);
    }

    /// Extends the bounds by the places at a time.
    void look(double time) {
        watch_.throw_if_cancelled();
        const std::size_t bad = skinning_.place(pose_at(scene_, time), positions_);
        if (bad != kNoVertex && result_.bad_vertex == kNoVertex) {
            result_.bad_vertex = bad;
            result_.bad_time = time;
        }
        extend(result_.bounds, bounds_of_all(positions_));
    }

    void look_at_keys() {
        const bool steps = has_steps(scene_.animation);
        for (std::size_t i = 1; i < times_.size(); ++i) {
            if (steps) look(std::nextafter(times_[i], 0.0));
            look(times_[i]);
        }
    }

    /// Looks at times between keys where that is needed, and returns how much wider the box has to
    /// be than that of all times that were looked at.
    double pad_between_keys() {
        const double wanted = kWantedPad * diagonal(result_.bounds);
        const double intervals = static_cast<double>(times_.size());
        const double affordable =
            std::clamp(kMostWorkBetween / (intervals * work_of_sample()), 1.0, kMostPieces);
        double pad = 0;
        for (std::size_t i = 1; i < times_.size(); ++i) {
            const double begin = times_[i - 1];
            const double seconds = times_[i] - begin;
            const double whole =
                rates_.within(begin, times_[i]).acceleration * seconds * seconds / 8;
            double pieces = 1;
            if (whole > wanted && wanted > 0)
                pieces = std::min(std::ceil(std::sqrt(whole / wanted)), std::floor(affordable));
            for (double piece = 1; piece < pieces; ++piece)
                look(begin + seconds * (piece / pieces));
            pad = std::max(pad, whole / (pieces * pieces));
        }
        return pad;
    }

    /// Bounds of all that joints can reach.
    void hold_reach() {
        const double reach = rates_.reach();
        const double lower[3] = {-reach, -reach, -reach};
        const double upper[3] = {reach, reach, reach};
        if (std::isfinite(reach)) result_.bounds.extend(lower, upper);
    }

    void widen(double pad) {
        if (result_.bounds.empty() || !std::isfinite(pad)) return;
        WorldBounds& bounds = result_.bounds;
        double largest = 0;
        for (int axis = 0; axis < 3; ++axis)
            largest = std::max({largest, -bounds.lower[axis], bounds.upper[axis]});
        constexpr double kMost = 3e38;
        for (int axis = 0; axis < 3; ++axis) {
            bounds.lower[axis] = std::max(bounds.lower[axis] - pad - kRounding * largest, -kMost);
            bounds.upper[axis] = std::min(bounds.upper[axis] + pad + kRounding * largest, kMost);
        }
    }

    const GltfScene& scene_;
    const Skinning& skinning_;
    const Watch& watch_;
    MotionRates rates_;
    std::vector<vec3> positions_;
    std::vector<double> times_;
    MotionBounds result_;
};

}  // namespace

MotionBounds motion_bounds(const GltfScene& scene, const Skinning& skinning, const Watch& watch) {
    return Bounder(scene, skinning, watch).run();
}

}  // namespace mray::gltf
