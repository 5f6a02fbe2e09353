#include "lab/bench/report.h"

#include <fmt/format.h>

#include <array>
#include <cstdio>
#include <fstream>
#include <thread>
#include <utility>

#include "common/base/output_file.h"
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

const Column kColumns[] = {{"scene", 20, false},  {"triangles", 9},     {"work", 7, false},
                           {"threads", 7},        {"rays", 8},          {"hit_share", 9},
                           {"tracer", 24, false}, {"peer", 46, false},  {"unit", 11, false},
                           {"ours", 7},           {"peer_value", 10},   {"ratio", 6},
                           {"ours_at_best", 12},  {"peer_at_best", 12}, {"ratio_at_best", 13},
                           {"ratio_min", 9},      {"ratio_max", 9},     {"mismatches", 10}};

std::vector<std::string> cells_of(const Row& row) {
    const auto number = [](double value) { return fmt::format("{:.4g}", value); };
    return {row.scene,
            std::to_string(row.triangles),
            row.work,
            std::to_string(row.threads),
            std::to_string(row.rays),
            number(row.hit_share),
            row.tracer,
            row.peer,
            name_of(row.unit),
            number(row.ours),
            number(row.peer_value),
            number(row.ratio.median),
            number(row.ours_at_best),
            number(row.peer_at_best),
            number(row.ratio.least),
            number(row.ratio.min),
            number(row.ratio.max),
            std::to_string(row.mismatches)};
}

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

Report::Report(std::string head, std::string file)
    : head_(std::move(head)), file_(std::move(file)) {
    if (!file_.empty()) check_writable(file_);
    fmt::print("{}", head_);
}

void Report::begin_scene() const { fmt::print("{}", header_text(kColumns)); }

void Report::add(const Row& row) {
    rows_.push_back(row);
    fmt::print("{}", row_text(kColumns, cells_of(row)));
    std::fflush(stdout);
    if (file_.empty()) return;
    std::vector<std::string> names;
    for (const Column& column : kColumns) names.emplace_back(column.name);
    Table table(names);
    for (const Row& one : rows_) table.add(cells_of(one));
    write_file(file_, head_ + table.csv());
}

}  // namespace mray::bench
