#include "lab/bench/report.h"

#include <fmt/format.h>

#include <array>
#include <cstdio>
#include <fstream>
#include <thread>
#include <utility>

#include "common/base/output_file.h"

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
    constexpr std::array kNames = {"Mray/s", "ns", "ms"};
    return kNames[static_cast<std::size_t>(unit)];
}

double in_unit(double ms, Unit unit, std::uint64_t count) {
    const auto n = static_cast<double>(count);
    if (unit == Unit::kMrayPerSecond) return n / (ms * 1e3);
    return unit == Unit::kMs ? ms : ms * 1e6 / n;
}

// At most 100 characters a row.
const Column kColumns[] = {{"work", 8, false}, {"tracer", 8, false}, {"peer", 32, false},
                           {"unit", 6, false}, {"ours", 6},          {"theirs", 6},
                           {"ratio", 5},       {"at best", 7},       {"differ", 6}};

std::vector<std::string> header_of_file() {
    std::vector<std::string> header = {"scene", "threads"};
    for (const Column& column : kColumns) header.push_back(column.name);
    return header;
}

}  // namespace

std::string machine_name() {
    return fmt::format("{}, family {}, model {}, {} cores", cpu_info("model name"),
                       cpu_info("cpu family"), cpu_info("model"),
                       std::thread::hardware_concurrency());
}

std::string machine_isa() {
    const std::string flags = cpu_info("flags") + ' ';
    if (flags.find(" avx512f ") != std::string::npos) return "AVX-512";
    if (flags.find(" avx2 ") != std::string::npos) return "AVX2";
    return flags.find(" sse4_1 ") != std::string::npos ? "SSE4.1" : "";
}

void set_times(Row& row, const Times& ours, const Times& theirs, Unit unit, std::uint64_t count) {
    row.unit = unit;
    row.ours = in_unit(ours.median_ms, unit, count);
    row.theirs = in_unit(theirs.median_ms, unit, count);
    row.ratio = theirs.median_ms / ours.median_ms;
    row.at_best = theirs.least_ms / ours.least_ms;
}

Report::Report(std::string head, std::string file)
    : head_(std::move(head)), file_(std::move(file)), table_(header_of_file()) {
    if (!file_.empty()) check_writable(file_);
    fmt::print("{}", head_);
}

void Report::begin(const std::string& scene, int threads) {
    scene_ = scene;
    threads_ = threads;
    fmt::print("\n{}, threads: {}\n{}", scene, threads, header_text(kColumns));
}

void Report::add(const Row& row) {
    const auto number = [](double value) { return fmt::format("{:.4g}", value); };
    std::vector<std::string> cells = {row.work,
                                      row.tracer,
                                      row.peer,
                                      name_of(row.unit),
                                      number(row.ours),
                                      number(row.theirs),
                                      fmt::format("{:.2f}", row.ratio),
                                      fmt::format("{:.2f}", row.at_best),
                                      std::to_string(row.differences)};
    fmt::print("{}", row_text(kColumns, cells));
    std::fflush(stdout);
    cells.insert(cells.begin(), {scene_, std::to_string(threads_)});
    table_.add(cells);
    if (!file_.empty()) write_file(file_, head_ + table_.csv());
}

}  // namespace mray::bench
