// The time of dispatches on a GPU, from the steps of warps.
#pragma once

#include <span>
#include <string_view>
#include <vector>

#include "lab/gpu_model/warp_trace.h"

namespace mray::lab {

/// Public figures of a card. A unit is a multiprocessor or a compute unit, times are cycles.
struct Card {
    std::string_view name;
    double units, ghz;
    /// Instructions of warps a cycle and unit: all, and those that neither add nor multiply floats.
    double issued, other;
    double registers, most_warps;
    /// Of a unit; lines a cycle.
    double l1_bytes, l1_lines;
    double l2_bytes, l2_tb_s, dram_tb_s;
    double l1_latency, l2_latency, dram_latency;
};

struct StepCost {
    /// Instructions of vectors in RADV's code, those of them that add or multiply floats, and loads
    /// of which each waits for the one before.
    double instructions = 0, floats = 0, loads = 0;
};

struct KernelCost {
    std::string_view name;
    double registers;
    /// In memory, for each ray.
    double ray_bytes;
    /// From an instruction to the next of a warp that is alone: less where more are independent.
    double cycles_alone;
    StepCost steps[kStepKinds] = {};
};

/// Cycles of a warp in each part of a unit, and in all where it is alone.
struct WarpLoad {
    double issue = 0, l1 = 0, l2 = 0, dram = 0, alone = 0;

    void add(const WarpLoad& other, double divisor) {
        issue += other.issue / divisor;
        l1 += other.l1 / divisor;
        l2 += other.l2 / divisor;
        dram += other.dram / divisor;
        alone += other.alone / divisor;
    }
};

struct Pass {
    std::vector<WarpLoad> warps;
    double warps_in_flight = 0;
};

/// The load of warps that follow each other on one unit, whose cache they share.
Pass load_warps(const Card& card, const KernelCost& kernel, std::span<const WarpTrace> warps,
                double scene_bytes);

/// Microseconds of a dispatch of so many warps, each like one of `warps`.
double dispatch_us(const Card& card, double warps_in_flight, std::span<const WarpLoad> warps,
                   double warp_count);

}  // namespace mray::lab
