// Whoever takes part in the charts. None of them is a mode of the program.
#pragma once

#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "accuracy/charts/chart_scene.h"
#include "common/backend.h"

namespace morphray::accuracy {

/// What the charts tell apart by colour.
enum class Family { kOurs, kRule, kPeer };

/// Answers a batch in the space that it works in: hits[i] answers rays[i].
using TraceBatch = std::function<void(std::span<const Ray>, std::span<Hit>)>;

/// Makes a backend; throws Error(kUnavailable) where there is none.
using MakeBackend = std::function<std::unique_ptr<Backend>()>;

/// A method with a scene of its own, which outlives it.
struct Method {
    std::string name;
    Family family = Family::kRule;
    bool in_scene_space = false;
    /// Any rays, in batches, from several threads at once; or from one, if it is `alone`.
    TraceBatch trace;
    bool alone = false;
    /// A tile of the camera's rays (kChartTile of them) by its number; others go through `trace`.
    /// May be empty.
    std::function<void(std::size_t, std::span<Hit>)> trace_tile = {};

    const ChartSpace& space(const ChartScene& scene) const {
        return in_scene_space ? scene.scene_space : scene.world_space;
    }
};

/// Intersection rules, all over one plain traversal: ours; T. Moeller, B. Trumbore. Fast, Minimum
/// Storage Ray/Triangle Intersection. 1997; S. Woop, C. Benthin, I. Wald. Watertight Ray/Triangle
/// Intersection. 2013; edge planes d . (b x c). Each but ours with fused multiply-add too, where
/// the machine has it.
std::vector<Method> rule_methods(const ChartScene& scene);

/// Box tests and precisions of nodes, with our rule over the plain traversal: plain slabs; padded
/// by 2 ulp; ours; boxes of 16 and of 8 bits.
std::vector<Method> box_methods(const ChartScene& scene);

/// The tracers of the program: the scalar reference, single rays and packets of each SIMD target,
/// and Vulkan if it can be had.
std::vector<Method> our_methods(const ChartScene& scene, const MakeBackend& make_vulkan);

/// Our tracer of single rays on the best target.
Method single_method(const ChartScene& scene);

/// Embree, fast and robust, if the program was built with it.
std::vector<Method> embree_methods(const ChartScene& scene);

/// All of them.
std::vector<Method> all_methods(const ChartScene& scene, const MakeBackend& make_vulkan);

}  // namespace morphray::accuracy
