#include "lab/methods/report.h"

#include <algorithm>
#include <cstdio>

#include "common/base/output_file.h"
#include "report/spread.h"

namespace mray::lab {
namespace {

// At most 80 characters a row.
const Column kColumns[] = {{"tracer", 6, false}, {"peer", 32, false}, {"ours", 6},  {"theirs", 6},
                           {"ratio", 5},         {"at best", 7},      {"differ", 6}};

}  // namespace

std::vector<Times> time_in_turn(std::span<const Method> methods, std::size_t parts, int repeat) {
    // By method, then by part.
    using Samples = std::vector<double>;
    std::vector<std::vector<Samples>> samples(methods.size(), std::vector<Samples>(parts));
    for (int round = -1; round < repeat; ++round) {
        for (std::size_t i = 0; i < methods.size(); ++i) {
            const std::size_t turn = (i + static_cast<std::size_t>(round + 1)) % methods.size();
            const Method& method = methods[turn];
            if (method.prepare) method.prepare(round);
            for (std::size_t part = 0; part < parts; ++part) {
                const double ms = method.run(part);
                if (round >= 0) samples[turn][part].push_back(ms);
            }
        }
    }
    std::vector<Times> times(methods.size());
    for (std::size_t i = 0; i < methods.size(); ++i) {
        for (const Samples& part : samples[i]) {
            times[i].median += median(part);
            times[i].least += std::ranges::min(part);
        }
    }
    return times;
}

std::vector<std::size_t> fastest_of_groups(std::span<const Method> methods,
                                           std::span<const Times> times, std::size_t count) {
    std::vector<std::size_t> fastest;
    for (std::size_t i = 0; i < methods.size(); ++i) {
        std::vector<std::size_t> group;
        for (std::size_t k = 0; k < methods.size(); ++k) {
            if (methods[k].group == methods[i].group) group.push_back(k);
        }
        if (group.front() != i) continue;
        std::ranges::stable_sort(group, {}, [&](std::size_t k) { return times[k].least; });
        group.resize(std::min(count, group.size()));
        fastest.insert(fastest.end(), group.begin(), group.end());
    }
    return fastest;
}

Report::Report(std::string head, std::string file)
    : head_(std::move(head)), file_(std::move(file)), table_([] {
          std::vector<std::string> header = {"scene", "threads", "work", "unit"};
          for (const Column& column : kColumns) header.push_back(column.name);
          return header;
      }()) {
    if (!file_.empty()) check_writable(file_);
    fmt::print("{}", head_);
}

void Report::begin(const std::string& scene, int threads) {
    scene_ = scene;
    threads_ = threads;
    work_.clear();
    fmt::print("\n{}, threads: {}\n{}", scene, threads, header_text(kColumns));
}

void Report::add(const Row& row) {
    const auto figure = [&row](const Times& times) {
        return fmt::format("{:.4g}", row.unit.figure(times.median, static_cast<double>(row.count)));
    };
    // Above 1 if morphray is faster, in any unit.
    const auto ratio = [&row](double Times::*ms) {
        return fmt::format("{:.2f}", row.theirs.*ms / row.ours.*ms);
    };
    const std::string work = fmt::format("{}, {}", row.work, row.unit.name);
    if (work != work_) fmt::print("{}\n", work);
    work_ = work;
    std::vector<std::string> cells = {row.tracer,
                                      row.peer,
                                      figure(row.ours),
                                      figure(row.theirs),
                                      ratio(&Times::median),
                                      ratio(&Times::least),
                                      std::to_string(row.differences)};
    fmt::print("{}", row_text(kColumns, cells));
    std::fflush(stdout);
    cells.insert(cells.begin(), {scene_, std::to_string(threads_), row.work, row.unit.name});
    table_.add(cells);
    if (!file_.empty()) write_file(file_, head_ + table_.csv());
}

std::uint64_t Report::compare(Row row, std::span<const Method> methods, std::size_t parts,
                              int repeat) {
    const std::vector<Times> times = time_in_turn(methods, parts, repeat);
    row.tracer = methods[0].name;
    row.ours = times[0];
    std::uint64_t differences = 0;
    for (const std::size_t peer :
         fastest_of_groups(methods.subspan(1), std::span(times).subspan(1), 1)) {
        const Method& method = methods[1 + peer];
        row.peer = method.name;
        row.theirs = times[1 + peer];
        row.differences = method.differences ? method.differences() : 0;
        add(row);
        differences += row.differences;
    }
    return differences;
}

}  // namespace mray::lab
