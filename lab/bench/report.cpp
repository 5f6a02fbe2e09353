#include "lab/bench/report.h"

#include <fmt/format.h>

#include <array>
#include <fstream>
#include <thread>

#include "common/report/table.h"
#include "common/text/text_parts.h"

namespace mray::bench {
namespace {

/// What /proc/cpuinfo says under a key about the first processor; empty if nothing.
std::string cpu_info(const std::string& key) {
    std::ifstream file("/proc/cpuinfo");
    for (std::string line; std::getline(file, line) && !line.empty();) {
        const std::size_t colon = line.find(": ");
        if (colon != std::string::npos && line.starts_with(key + '\t'))
            return line.substr(colon + 2);
    }
    return {};
}

const char* name_of(Unit unit) {
    constexpr std::array kNames = {"Mray/s", "ns/triangle", "ns/query", "ms"};
    return kNames[static_cast<std::size_t>(unit)];
}

double in_unit(double ms, Unit unit, std::uint64_t count) {
    const auto n = static_cast<double>(count);
    if (unit == Unit::kMrayPerSecond) return n / (ms * 1e3);
    return unit == Unit::kMs ? ms : ms * 1e6 / n;
}

const Column kColumns[] = {
    {"scene", 24, false}, {"triangles", 9},    {"view", 6, false},
    {"work", 7, false},   {"th", 2},           {"hits %", 6},
    {"ours", 19, false},  {"peer", 55, false}, {"unit", 11, false},
    {"ours", 9},          {"peer", 9},         {"ratio", 7},
    {"at best", 7},       {"min - max", 15},   {"mismatches", 10},
};

template <class Value>
std::string text(const Value& value) {
    return fmt::format("{}", value);
}
std::string fixed(double value) { return fmt::format("{:.2f}", value); }
std::string short_text(double value) { return fmt::format("{:.4g}", value); }

}  // namespace

std::string machine_name() {
    std::string name;
    for (const char c : lower_case(fmt::format("{} family{} model{} {}c", cpu_info("model name"),
                                               cpu_info("cpu family"), cpu_info("model"),
                                               std::thread::hardware_concurrency()))) {
        // One dash for each run of anything else.
        if ((c >= 'a' && c <= 'z') || (c >= '0' && c <= '9')) {
            name.push_back(c);
        } else if (!name.empty() && name.back() != '-') {
            name.push_back('-');
        }
    }
    return name;
}

std::string machine_isa() {
    const std::string flags = cpu_info("flags") + ' ';
    if (flags.find(" avx512f ") != std::string::npos) return "AVX-512";
    if (flags.find(" avx2 ") != std::string::npos) return "AVX2";
    return flags.find(" sse4_1 ") != std::string::npos ? "SSE4.1" : "";
}

void set_times(Row& row, const Times& ours, const Times& peer, Unit unit, std::uint64_t count) {
    row.unit = unit;
    row.ours = in_unit(ours.median_ms, unit, count);
    row.peer_value = in_unit(peer.median_ms, unit, count);
    row.ours_at_best = in_unit(ours.least_ms, unit, count);
    row.peer_at_best = in_unit(peer.least_ms, unit, count);
    row.ratio = ratio_of(ours, peer);
}

std::string table_header() { return header_text(kColumns); }

std::string table_line(const Row& row) {
    const std::vector<std::string> cells = {
        row.scene,
        text(row.triangles),
        row.view,
        row.work,
        text(row.threads),
        row.rays == 0 ? "" : fmt::format("{:.1f}", 100 * row.hit_share),
        row.tracer + ' ' + row.target,
        row.peer,
        name_of(row.unit),
        fixed(row.ours),
        fixed(row.peer_value),
        fixed(row.ratio.median),
        fixed(row.ratio.least),
        fixed(row.ratio.min) + " - " + fixed(row.ratio.max),
        text(row.mismatches.total())};
    return row_text(kColumns, cells);
}

std::string to_csv(std::span<const Row> rows) {
    Table table({"scene",        "triangles",     "view",
                 "work",         "threads",       "rays",
                 "hit_share",    "tracer",        "target",
                 "unit",         "ours",          "peer",
                 "peer_value",   "ratio",         "ours_at_best",
                 "peer_at_best", "ratio_at_best", "ratio_min",
                 "ratio_max",    "mismatches",    "largest_difference"});
    for (const Row& row : rows) {
        table.add({row.scene,
                   text(row.triangles),
                   row.view,
                   row.work,
                   text(row.threads),
                   text(row.rays),
                   short_text(row.hit_share),
                   row.tracer,
                   row.target,
                   name_of(row.unit),
                   short_text(row.ours),
                   row.peer,
                   short_text(row.peer_value),
                   short_text(row.ratio.median),
                   short_text(row.ours_at_best),
                   short_text(row.peer_at_best),
                   short_text(row.ratio.least),
                   short_text(row.ratio.min),
                   short_text(row.ratio.max),
                   text(row.mismatches.total()),
                   short_text(row.largest_difference)});
    }
    return table.csv();
}

}  // namespace mray::bench
