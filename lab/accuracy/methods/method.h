// The methods under test in the charts. None of them is a mode of the program.
#pragma once

#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "common/backend.h"
#include "lab/accuracy/chart_scene.h"

namespace mray::accuracy {

/// Traces a batch in the space of the method: hits[i] is the hit of rays[i].
using TraceBatch = std::function<void(std::span<const Ray>, std::span<Hit>)>;

/// Makes a backend; throws Error(kUnavailable) if there is none.
using MakeBackend = std::function<std::unique_ptr<Backend>()>;

/// A method under test over one scene, which outlives it.
struct Method {
    std::string name;
    bool in_scene_space = false;
    /// Traces batches of any rays, called by several threads at once, or by one thread if `alone`.
    TraceBatch trace;
    bool alone = false;
    /// Traces the camera rays of the tile with this number. If it is empty, `trace` does.
    std::function<void(std::size_t, std::span<Hit>)> trace_tile = {};

    const ChartSpace& space(const ChartScene& scene) const {
        return in_scene_space ? scene.scene_space : scene.world_space;
    }
};

/// Intersection rules over one plain traversal: T. Moeller, B. Trumbore. Fast, Minimum Storage
/// Ray/Triangle Intersection. 1997; S. Woop, C. Benthin, I. Wald. Watertight Ray/Triangle
/// Intersection. 2013.
std::vector<Method> rule_methods(const ChartScene& scene);

/// The scalar reference, single rays and packets on the best SIMD target, and Vulkan.
std::vector<Method> our_methods(const ChartScene& scene, const MakeBackend& make_vulkan);

Method single_method(const ChartScene& scene);

/// Embree, fast and robust, if the program was built with it.
std::vector<Method> embree_methods(const ChartScene& scene);

}  // namespace mray::accuracy
