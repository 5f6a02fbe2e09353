#include "lab/gpu_model/gpu_time.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <queue>
#include <unordered_map>

namespace mray::lab {

double warps_in_flight(const Card& card, const Kernel& kernel) {
    // A workgroup has two warps.
    return std::min(card.most_warps, 2 * std::floor(card.registers / kernel.registers / 64));
}

std::vector<WarpLoad> load_warps(const Card& card, const Kernel& kernel,
                                 std::span<const WarpTrace> warps, double scene_bytes) {
    const double dram_share = std::max(0.0, 1 - card.l2_bytes / scene_bytes);
    const double bytes_of_cycle = 1e3 / (card.units * card.ghz);
    const double beyond_l1 = card.l2_latency + dram_share * (card.dram_latency - card.l2_latency);
    std::vector<WarpLoad> loads(warps.size());
    const auto add_step = [&](WarpLoad& load, const Step& step, double missed) {
        const auto kind = std::size_t(step.kind);
        const double instructions = kernel.instructions[kind];
        const bool is_begin = step.kind == StepKind::kBegin;
        const double bytes = is_begin ? double(step.active) * kernel.ray_bytes : 0;
        const double l1 = double(step.wavefronts) / card.l1_lines;
        load.parts += glm::dvec4(
            std::max(instructions / card.issued, (instructions - kernel.floats[kind]) / card.other),
            l1, (32 * missed + bytes) / card.l2_tb_s / bytes_of_cycle,
            (32 * missed * dram_share + bytes) / card.dram_tb_s / bytes_of_cycle);
        load.alone += instructions * kernel.cycles_alone + l1;
        const double first_load = missed > 0 ? beyond_l1 : card.l1_latency;
        if (kernel.loads[kind] > 0)
            load.alone += first_load + (kernel.loads[kind] - 1) * card.l1_latency;
        if (is_begin) load.alone += card.dram_latency;
    };
    // When each sector was loaded into the first cache, which drops the oldest: so many before it.
    std::unordered_map<std::uint64_t, double> loaded;
    double all_loads = 0;
    // The warp and the step that each slot of the unit is at.
    std::vector<std::pair<std::size_t, std::size_t>> slots;
    std::size_t next = 0;
    while (double(next) < warps_in_flight(card, kernel)) slots.emplace_back(next++, 0);
    for (std::size_t ended = 0; ended < warps.size();) {
        for (std::size_t i = 0; i < slots.size(); ++i) {
            auto& [warp, at] = slots[i];
            if (warp >= warps.size()) continue;
            const Step& step = warps[warp].steps[at];
            double missed = 0;
            for (const std::uint64_t sector : step.sectors) {
                const std::uint64_t own = sector >= kStackSector ? sector + (i << 20) : sector;
                const auto [place, is_new] = loaded.try_emplace(own, all_loads);
                if (!is_new && all_loads - place->second < card.l1_bytes / 32) continue;
                place->second = all_loads++;
                ++missed;
            }
            add_step(loads[warp], step, missed);
            if (++at < warps[warp].steps.size()) continue;
            slots[i] = {next++, 0};
            ++ended;
        }
    }
    return loads;
}

WarpLoad mean_of(std::span<const WarpLoad> warps) {
    const auto count = static_cast<double>(warps.size());
    WarpLoad mean;
    for (const WarpLoad& warp : warps) {
        mean.parts += warp.parts / count;
        mean.alone += warp.alone / count;
    }
    return mean;
}

double dispatch_us(const Card& card, double in_flight, std::span<const WarpLoad> warps,
                   double warp_count) {
    // The cycles of a warp where n are in flight, for each n: mean-value analysis of a closed
    // network, whose stations are the parts of a unit (M. Reiser, S. S. Lavenberg. JACM 27(2),
    // 1980).
    const WarpLoad mean = mean_of(warps);
    constexpr glm::dvec4 kOnes(1);
    const double delay = std::max(mean.alone - glm::dot(mean.parts, kOnes), 0.0);
    glm::dvec4 queues(0);
    std::vector<double> cycles = {mean.alone};
    for (double n = 1; n <= in_flight; ++n) {
        const glm::dvec4 demand = mean.parts * (kOnes + queues);
        cycles.push_back(delay + glm::dot(demand, kOnes));
        queues = n / cycles.back() * demand;
    }
    // The ends of the warps in flight, in cycles of a warp that is alone.
    std::priority_queue<double, std::vector<double>, std::greater<>> ends;
    double now = 0;
    double us = 0;
    for (std::size_t i = 0; double(i) < warp_count || !ends.empty();) {
        const double of_unit = double(ends.size()) / card.units;
        if (double(i) < warp_count && of_unit < in_flight) {
            // In an order without a pattern.
            ends.push(now + warps[i++ * 7919 % warps.size()].alone);
            continue;
        }
        us += (ends.top() - now) * cycles[std::size_t(std::ceil(of_unit))] / mean.alone / card.ghz /
              1e3;
        now = ends.top();
        ends.pop();
    }
    return us;
}

}  // namespace mray::lab
