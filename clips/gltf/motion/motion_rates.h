// How fast the parts of a glTF scene may move between two keys.
#pragma once

#include <array>
#include <vector>

#include "clips/gltf/gltf_scene.h"

namespace mray::gltf {

/// Upper bounds of the length of a vector over an interval, and of its first and second derivative
/// by the time.
struct Rates {
    double length = 0;
    double speed = 0;
    double acceleration = 0;
};

/// Bounds the motion of the scene's parts; made once for a scene.
class MotionRates {
public:
    /// The scene must outlive it.
    explicit MotionRates(const GltfScene& scene);

    /// Rates of the places of all vertices in an interval of seconds that has no key inside: the
    /// largest of any part.
    Rates within(double begin, double end) const;
    /// How far from 0 a vertex may come at any time.
    double reach() const;

private:
    /// The joint of a skin, or the node of a part without one.
    struct Mover {
        std::uint32_t node = 0;
        /// The largest distance of its vertices from the node's origin, without morph targets.
        double reach = 0;
        /// How much the map to the node's space stretches displacements.
        double stretch = 1;
        std::size_t part = 0;
    };
    /// Rates of all channels: of a vector, of the matrix of a rotation, of the largest factor of a
    /// scale; of weights for each target.
    struct ChannelRates {
        std::vector<Rates> of_channel;
        std::vector<std::vector<Rates>> of_weights;
    };

    void add_movers(std::size_t part);
    Rates displacement(std::size_t part, const ChannelRates& channels) const;
    Rates rates_of(const ChannelRates& channels) const;

    const GltfScene& scene_;
    std::vector<Mover> movers_;
    /// For each node the indices of the channels that move it, by Target.
    std::vector<std::array<std::size_t, 4>> channels_of_node_;
};

}  // namespace mray::gltf
