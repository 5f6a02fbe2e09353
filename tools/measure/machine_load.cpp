#include "tools/measure/machine_load.h"

#include <sched.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <sstream>
#include <string>

namespace mray {
namespace {

/// Ticks are counted core by core and not all at the same time.
constexpr double kInexactTicks = 3;

double milliseconds(const timeval& time) {
    return 1e3 * static_cast<double>(time.tv_sec) + 1e-3 * static_cast<double>(time.tv_usec);
}

double tick_ms() { return 1e3 / static_cast<double>(sysconf(_SC_CLK_TCK)); }

}  // namespace

std::optional<MachineLoad::Times> MachineLoad::now() {
    cpu_set_t cores;
    rusage used{};
    if (sched_getaffinity(0, sizeof cores, &cores) != 0) return std::nullopt;
    if (getrusage(RUSAGE_SELF, &used) != 0) return std::nullopt;
    Times times{.own = milliseconds(used.ru_utime) + milliseconds(used.ru_stime)};
    std::ifstream file("/proc/stat");
    for (std::string line; std::getline(file, line);) {
        // "cpu0 user nice system idle iowait irq softirq steal": the line without a number is the
        // sum of all.
        std::istringstream words(line);
        std::string name;
        words >> name;
        if (!name.starts_with("cpu") || name.size() == 3) continue;
        const std::size_t core = std::stoul(name.substr(3));
        if (core >= CPU_SETSIZE || !CPU_ISSET(core, &cores)) continue;
        std::array<double, 8> ticks{};
        for (double& count : ticks) words >> count;
        for (std::size_t i = 0; i < ticks.size(); ++i) {
            const bool is_idle = i == 3 || i == 4;
            times.all += ticks[i] * tick_ms();
            if (!is_idle) times.busy += ticks[i] * tick_ms();
        }
    }
    if (times.all == 0) return std::nullopt;
    return times;
}

MachineLoad::MachineLoad() : start_(now()) {}

double MachineLoad::others() const {
    const std::optional<Times> end = now();
    if (!start_ || !end) return 0;
    const double all = end->all - start_->all;
    const double others = end->busy - start_->busy - (end->own - start_->own);
    if (others < kInexactTicks * tick_ms() || all <= 0) return 0;
    return std::min(1.0, others / all);
}

}  // namespace mray
