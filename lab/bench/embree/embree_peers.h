// Embree's scenes and ways as peers of a work.
#pragma once

#include <deque>
#include <span>
#include <string>
#include <vector>

#include "lab/bench/bench_scene.h"
#include "lab/bench/embree/embree_scene.h"
#include "lab/bench/peer.h"

namespace mray::bench {

/// A scene by every instruction set, over a MEDIUM and a HIGH tree, fast and robust. Takes the time
/// of eight builds.
class EmbreeScenes {
public:
    EmbreeScenes(std::span<const EmbreeDevice> devices, const BenchScene& scene);

    struct Variant {
        EmbreeScene scene;
        bool robust;
        /// "MEDIUM, avx2"
        std::string name;
    };
    const std::deque<Variant>& variants() const { return variants_; }

private:
    EmbreeMesh mesh_;
    std::deque<Variant> variants_;
};

/// Embree's ways to trace a work over each of its scenes, which outlive the peers, as does the
/// work.
std::vector<Peer> embree_peers(const EmbreeScenes& scenes, const TraceWork& work);

}  // namespace mray::bench
