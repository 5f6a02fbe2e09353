#include "lab/bench/row.h"

namespace mray::bench {
namespace {

double in_unit(double ms, Unit unit, std::uint64_t count) {
    const auto n = static_cast<double>(count);
    switch (unit) {
        case Unit::kMrayPerSecond:
            return n / (ms * 1e3);
        case Unit::kNsPerTriangle:
        case Unit::kNsPerQuery:
            return ms * 1e6 / n;
        case Unit::kMs:
            break;
    }
    return ms;
}

}  // namespace

const char* name_of(Unit unit) {
    switch (unit) {
        case Unit::kMrayPerSecond:
            return "Mray/s";
        case Unit::kNsPerTriangle:
            return "ns/triangle";
        case Unit::kNsPerQuery:
            return "ns/query";
        case Unit::kMs:
            break;
    }
    return "ms";
}

void set_times(Row& row, const Times& ours, const Times& peer, Unit unit, std::uint64_t count) {
    row.unit = unit;
    row.ours = in_unit(ours.median_ms, unit, count);
    row.peer_value = in_unit(peer.median_ms, unit, count);
    row.ours_at_best = in_unit(ours.least_ms, unit, count);
    row.peer_at_best = in_unit(peer.least_ms, unit, count);
    row.ratio = ratio_of(ours, peer);
}

}  // namespace mray::bench
