#include "lab/gpu_model/gpu_time.h"

#include <algorithm>
#include <cmath>
#include <queue>
#include <unordered_map>

namespace mray::lab {
namespace {

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
    const double demands[] = {mean.issue, mean.l1, mean.l2, mean.dram};
    double queues[4] = {};
    const double delay = std::max(mean.alone - (mean.issue + mean.l1 + mean.l2 + mean.dram), 0.0);
    std::vector<double> cycles = {mean.alone};
    for (double n = 1; n <= most; ++n) {
        double times[4];
        for (int k = 0; k < 4; ++k) times[k] = demands[k] * (1 + queues[k]);
        const double all = delay + times[0] + times[1] + times[2] + times[3];
        for (int k = 0; k < 4; ++k) queues[k] = n * times[k] / all;
        cycles.push_back(all);
    }
    return cycles;
}

}  // namespace

Pass load_warps(const Card& card, const KernelCost& kernel, std::span<const WarpTrace> warps,
                double scene_bytes) {
    // A workgroup has two warps.
    const double fitting = 2 * std::floor(card.registers / kernel.registers / 64);
    Pass pass{std::vector<WarpLoad>(warps.size()), std::min(card.most_warps, fitting)};
    const double dram_share = std::max(0.0, 1 - card.l2_bytes / scene_bytes);
    const double bytes_of_cycle = 1e3 / (card.units * card.ghz);
    const double beyond_l1 = card.l2_latency + dram_share * (card.dram_latency - card.l2_latency);
    Cache cache(card.l1_bytes);
    struct Running {
        std::size_t warp = 0, step = 0, sector = 0;
    };
    std::vector<Running> slots;
    std::size_t next = 0;
    const auto run_step = [&](Running& r, std::uint64_t slot) {
        const WarpTrace& warp = warps[r.warp];
        const Step& step = warp.steps[r.step];
        const StepCost& cost = kernel.steps[static_cast<std::size_t>(step.kind)];
        double missed = 0;
        for (; r.sector < step.sectors_end; ++r.sector) {
            const std::uint64_t sector = warp.sectors[r.sector];
            const bool is_stack = sector >= kStackSector;
            missed += cache.has_or_loads(is_stack ? sector + (slot << 20) : sector) ? 0 : 1;
        }
        WarpLoad& load = pass.warps[r.warp];
        const double first_load = missed > 0 ? beyond_l1 : card.l1_latency;
        const double bytes = step.kind == StepKind::kBegin ? step.active * kernel.ray_bytes : 0;
        load.issue += std::max(cost.instructions / card.issued,
                               (cost.instructions - cost.floats) / card.other);
        load.l1 += step.wavefronts / card.l1_lines;
        load.l2 += (32 * missed + bytes) / card.l2_tb_s / bytes_of_cycle;
        load.dram += (32 * missed * dram_share + bytes) / card.dram_tb_s / bytes_of_cycle;
        load.alone += cost.instructions * kernel.cycles_alone + step.wavefronts / card.l1_lines;
        if (cost.loads > 0) load.alone += first_load + (cost.loads - 1) * card.l1_latency;
        if (bytes > 0) load.alone += card.dram_latency;
        return ++r.step < warp.steps.size();
    };
    while (static_cast<double>(slots.size()) < pass.warps_in_flight && next < warps.size())
        slots.push_back({next++});
    while (!slots.empty()) {
        for (std::size_t i = 0; i < slots.size();) {
            if (run_step(slots[i], i)) {
                ++i;
            } else if (next < warps.size()) {
                slots[i++] = {next++};
            } else {
                slots.erase(slots.begin() + static_cast<std::ptrdiff_t>(i));
            }
        }
    }
    return pass;
}

double dispatch_us(const Card& card, double warps_in_flight, std::span<const WarpLoad> warps,
                   double warp_count) {
    WarpLoad mean;
    for (const WarpLoad& warp : warps) mean.add(warp, static_cast<double>(warps.size()));
    const std::vector<double> cycles = cycles_by_warps(mean, warps_in_flight);
    // The ends of the warps in flight, in cycles of a warp that is alone.
    std::priority_queue<double, std::vector<double>, std::greater<>> ends;
    double now = 0;
    double us = 0;
    const auto end_one = [&] {
        const double in_flight = static_cast<double>(ends.size()) / card.units;
        const auto n = static_cast<std::size_t>(std::ceil(in_flight));
        us += (ends.top() - now) * cycles[n] / mean.alone / card.ghz / 1e3;
        now = ends.top();
        ends.pop();
    };
    for (std::size_t i = 0; i < static_cast<std::size_t>(warp_count); ++i) {
        if (static_cast<double>(ends.size()) >= warps_in_flight * card.units) end_one();
        // In an order without a pattern.
        ends.push(now + warps[i * 7919 % warps.size()].alone);
    }
    while (!ends.empty()) end_one();
    return us;
}

}  // namespace mray::lab
