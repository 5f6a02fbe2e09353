#include "lab/gpu_model/gpu_time.h"

#include <algorithm>
#include <cmath>
#include <queue>
#include <unordered_map>

namespace mray::lab {
namespace {

/// Instructions of vectors in RADV's code, those of them that add or multiply floats, and loads of
/// which each waits for the one before.
struct StepCost {
    double instructions = 0, floats = 0, loads = 0;
};
/// By StepKind and Kernel. The notes say how they were found.
constexpr StepCost kSteps[kStepKinds][3] = {
    {{290, 137, 1}, {290, 136, 1}, {40, 10, 1}},  // kBegin
    {{547, 225, 2}, {124, 57, 1}, {61, 24, 1}},   // kNode
    {{}, {124, 60, 2}, {}},                       // kQuarter
    {{}, {10, 0, 0}, {4, 0, 0}},                  // kPush
    {{12, 0, 1}, {12, 0, 1}, {6, 0, 1}},          // kPop
    {{30, 1, 1}, {27, 0, 1}, {6, 0, 0}},          // kLeaf
    {{}, {117, 57, 1}, {}},                       // kGroups
    {{112, 53, 2}, {109, 49, 2}, {66, 37, 2}},    // kTriangle
    {{153, 71, 2}, {99, 46, 1}, {}},              // kHit
};

/// Which sectors of 32 bytes are in a cache that drops the oldest.
class Cache {
public:
    explicit Cache(double bytes) : sectors_(bytes / 32) {}
    bool has_or_loads(std::uint64_t sector) {
        const auto [at, is_new] = loaded_.try_emplace(sector, loads_);
        if (!is_new && loads_ - at->second < sectors_) return true;
        at->second = loads_++;
        return false;
    }

private:
    double sectors_;
    double loads_ = 0;
    std::unordered_map<std::uint64_t, double> loaded_;
};

/// The cycles that a warp takes where n are in flight, for each n: mean-value analysis of a closed
/// network (M. Reiser, S. S. Lavenberg. JACM 27(2), 1980), whose stations are the parts of a unit.
std::vector<double> cycles_by_warps(const WarpLoad& mean, double most) {
    double delay = mean.alone;
    for (const double demand : mean.parts) delay -= demand;
    std::array<double, 4> queues = {};
    std::vector<double> cycles = {mean.alone};
    for (double n = 1; n <= most; ++n) {
        double all = std::max(delay, 0.0);
        for (std::size_t k = 0; k < 4; ++k) all += mean.parts[k] * (1 + queues[k]);
        for (std::size_t k = 0; k < 4; ++k) queues[k] = n / all * mean.parts[k] * (1 + queues[k]);
        cycles.push_back(all);
    }
    return cycles;
}

}  // namespace

double warps_in_flight(const Card& card, const KernelForm& form) {
    // A workgroup has two warps.
    return std::min(card.most_warps, 2 * std::floor(card.registers / form.registers / 64));
}

std::vector<WarpLoad> load_warps(const Card& card, const KernelForm& form,
                                 std::span<const WarpTrace> warps, double scene_bytes) {
    const double dram_share = std::max(0.0, 1 - card.l2_bytes / scene_bytes);
    const double bytes_of_cycle = 1e3 / (card.units * card.ghz);
    const double beyond_l1 = card.l2_latency + dram_share * (card.dram_latency - card.l2_latency);
    std::vector<WarpLoad> loads(warps.size());
    const auto add_step = [&](WarpLoad& load, const Step& step, double missed) {
        const StepCost& cost = kSteps[std::size_t(step.kind)][std::size_t(form.kernel)];
        const bool is_begin = step.kind == StepKind::kBegin;
        const double bytes = is_begin ? step.active * form.ray_bytes : 0;
        const double l1 = step.wavefronts / card.l1_lines;
        load.parts[0] += std::max(cost.instructions / card.issued,
                                  (cost.instructions - cost.floats) / card.other);
        load.parts[1] += l1;
        load.parts[2] += (32 * missed + bytes) / card.l2_tb_s / bytes_of_cycle;
        load.parts[3] += (32 * missed * dram_share + bytes) / card.dram_tb_s / bytes_of_cycle;
        load.alone += cost.instructions * form.cycles_alone + l1;
        const double first_load = missed > 0 ? beyond_l1 : card.l1_latency;
        if (cost.loads > 0) load.alone += first_load + (cost.loads - 1) * card.l1_latency;
        if (is_begin) load.alone += card.dram_latency;
    };
    Cache cache(card.l1_bytes);
    struct Running {
        std::size_t warp, step = 0, sector = 0;
    };
    std::vector<Running> slots;
    std::size_t next = 0;
    while (static_cast<double>(next) < warps_in_flight(card, form)) slots.push_back({next++});
    for (std::size_t ended = 0; ended < warps.size();) {
        for (std::size_t i = 0; i < slots.size(); ++i) {
            auto& [warp, step, sector] = slots[i];
            if (warp >= warps.size()) continue;
            double missed = 0;
            for (; sector < warps[warp].steps[step].sectors_end; ++sector) {
                const std::uint64_t at = warps[warp].sectors[sector];
                const bool is_stack = at >= kStackSector;
                missed += cache.has_or_loads(is_stack ? at + (i << 20) : at) ? 0 : 1;
            }
            add_step(loads[warp], warps[warp].steps[step], missed);
            if (++step < warps[warp].steps.size()) continue;
            slots[i] = {next++};
            ++ended;
        }
    }
    return loads;
}

WarpLoad mean_of(std::span<const WarpLoad> warps) {
    const auto count = static_cast<double>(warps.size());
    WarpLoad mean;
    for (const WarpLoad& warp : warps) {
        for (std::size_t k = 0; k < 4; ++k) mean.parts[k] += warp.parts[k] / count;
        mean.alone += warp.alone / count;
    }
    return mean;
}

double dispatch_us(const Card& card, double in_flight, std::span<const WarpLoad> warps,
                   double warp_count) {
    const WarpLoad mean = mean_of(warps);
    const std::vector<double> cycles = cycles_by_warps(mean, in_flight);
    // The ends of the warps in flight, in cycles of a warp that is alone.
    std::priority_queue<double, std::vector<double>, std::greater<>> ends;
    double now = 0;
    double us = 0;
    for (std::size_t i = 0; static_cast<double>(i) < warp_count || !ends.empty();) {
        const double of_unit = static_cast<double>(ends.size()) / card.units;
        if (static_cast<double>(i) < warp_count && of_unit < in_flight) {
            // In an order without a pattern.
            ends.push(now + warps[i++ * 7919 % warps.size()].alone);
            continue;
        }
        const auto n = static_cast<std::size_t>(std::ceil(of_unit));
        us += (ends.top() - now) * cycles[n] / mean.alone / card.ghz / 1e3;
        now = ends.top();
        ends.pop();
    }
    return us;
}

}  // namespace mray::lab
