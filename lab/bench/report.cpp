#include "lab/bench/report.h"

#include <fmt/format.h>

#include "common/report/table.h"

namespace mray::bench {
namespace {

constexpr const char* kTableFormat =
    "{:<24}  {:>9}  {:<6}  {:<7}  {:>2}  {:>6}  {:<19}  {:<55}  {:<11}  {:>9}  {:>9}  {:>7}  "
    "{:>7}  {:>15}  {:>10}\n";

}  // namespace

std::string table_header() {
    return fmt::format(fmt::runtime(kTableFormat), "scene", "triangles", "view", "work", "th",
                       "hits %", "ours", "peer", "unit", "ours", "peer", "ratio", "at best",
                       "min - max", "mismatches");
}

std::string table_line(const Row& row) {
    return fmt::format(
        fmt::runtime(kTableFormat), row.scene, row.triangles, row.view, row.work, row.threads,
        row.rays == 0 ? "" : fmt::format("{:.1f}", 100 * row.hit_share),
        row.tracer + ' ' + row.target, row.peer, name_of(row.unit), fmt::format("{:.2f}", row.ours),
        fmt::format("{:.2f}", row.peer_value), fmt::format("{:.2f}", row.ratio.median),
        fmt::format("{:.2f}", row.ratio.least),
        fmt::format("{:.2f} - {:.2f}", row.ratio.min, row.ratio.max), row.mismatches.total());
}

std::string to_csv(const ReportHead& head, std::span<const Row> rows) {
    Table table({"scene",        "triangles",     "view",
                 "work",         "threads",       "rays",
                 "hit_share",    "tracer",        "target",
                 "unit",         "ours",          "peer",
                 "peer_value",   "ratio",         "ours_at_best",
                 "peer_at_best", "ratio_at_best", "ratio_min",
                 "ratio_max",    "mismatches",    "largest_difference"});
    const auto text = [](const auto& value) { return fmt::format("{}", value); };
    const auto short_text = [](double value) { return fmt::format("{:.4g}", value); };
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
    const std::string left_out =
        head.left_out.empty() ? "" : fmt::format(", which has no {}", head.left_out);
    return fmt::format("# {}, {}; morphray {}, Embree {}{}\n# {}\n{}", head.machine, head.isa,
                       head.version, head.embree, left_out, head.command, table.csv());
}

}  // namespace mray::bench
