// The time of dispatches on a GPU, from the steps of warps.
#pragma once

#include <array>
#include <glm/vec4.hpp>
#include <string>

#include "lab/gpu_model/warp_trace.h"

namespace mray::lab {

/// Public figures of a card. A unit is a multiprocessor or a compute unit, times are cycles.
struct Card {
    std::string name;
    double units, ghz;
    /// Instructions of warps a cycle and unit: all, and those that neither add nor multiply floats.
    double issued, other;
    double registers, most_warps;
    /// Of a unit; lines a cycle.
    double l1_bytes, l1_lines;
    double l2_bytes, l2_tb_s, dram_tb_s;
    double l1_latency, l2_latency, dram_latency;
};

/// What a kernel needs.
struct Kernel {
    std::string name;
    double registers;
    /// In memory, for each ray.
    double ray_bytes;
    /// From an instruction to the next of a warp that is alone: less where more are independent.
    double cycles_alone;
    /// Of each StepKind: instructions of vectors, those of them that add or multiply floats, and
    /// loads of which each waits for the one before.
    std::array<double, kStepKinds> instructions, floats, loads;
};

/// Cycles of a warp in each part of a unit (issue, first cache, second cache, memory), and in all
/// where it is alone.
struct WarpLoad {
    glm::dvec4 parts{0};
    double alone = 0;
};

/// The warps that a kernel's registers leave room for on a unit.
double warps_in_flight(const Card& card, const Kernel& kernel);

/// The load of warps that follow each other on one unit, whose cache they share.
std::vector<WarpLoad> load_warps(const Card& card, const Kernel& kernel,
                                 std::span<const WarpTrace> warps, double scene_bytes);

WarpLoad mean_of(std::span<const WarpLoad> warps);

/// Microseconds of a dispatch of so many warps, each like one of `warps`.
double dispatch_us(const Card& card, double in_flight, std::span<const WarpLoad> warps,
                   double warp_count);

}  // namespace mray::lab
