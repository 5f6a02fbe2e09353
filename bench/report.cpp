#include "bench/report.h"

#include <fmt/format.h>

namespace morphray::bench {
namespace {

std::string json_text(const std::string& text) {
    std::string quoted = "\"";
    for (const char c : text) {
        if (c == '"' || c == '\\') {
            quoted += {'\\', c};
        } else if (static_cast<unsigned char>(c) < 0x20) {
            quoted += fmt::format("\\u{:04x}", static_cast<unsigned char>(c));
        } else {
            quoted.push_back(c);
        }
    }
    return quoted + '"';
}

std::string csv_text(const std::string& text) {
    if (text.find_first_of(",\"\n\r") == std::string::npos) return text;
    std::string quoted = "\"";
    for (const char c : text) quoted.append(c == '"' ? 2 : 1, c);
    return quoted + '"';
}

std::string to_json(const Row& row) {
    const Mismatches& m = row.mismatches;
    return fmt::format(
        "    {{\"scene\": {}, \"triangles\": {}, \"view\": {}, \"work\": {}, \"threads\": {}, "
        "\"rays\": {}, \"hit_share\": {:.4g}, \"tracer\": {}, "
        "\"target\": {}, \"unit\": {}, \"ours\": {:.6g}, \"peer\": {}, \"peer_value\": {:.6g}, "
        "\"ratio\": {:.6g}, \"ratio_min\": {:.6g}, \"ratio_max\": {:.6g}, \"mismatches\": {}, "
        "\"mismatch_kinds\": {{\"hit\": {}, \"prim_id\": {}, \"t\": {}}}}}",
        json_text(row.scene), row.triangles, json_text(row.view), json_text(row.work), row.threads,
        row.rays, row.hit_share, json_text(row.tracer), json_text(row.target),
        json_text(name_of(row.unit)), row.ours, json_text(row.peer), row.peer_value,
        row.ratio.median, row.ratio.min, row.ratio.max, m.total(), m.hit, m.prim_id, m.t);
}

constexpr const char* kTableFormat =
    "{:<24}  {:>9}  {:<5}  {:<7}  {:>2}  {:>6}  {:<19}  {:<37}  {:<11}  {:>9}  {:>9}  {:>7}  "
    "{:>15}  {:>10}\n";

}  // namespace

std::string table_header() {
    return fmt::format(fmt::runtime(kTableFormat), "scene", "triangles", "view", "work", "th",
                       "hits %", "ours", "peer", "unit", "ours", "peer", "ratio", "min - max",
                       "mismatches");
}

std::string table_line(const Row& row) {
    return fmt::format(
        fmt::runtime(kTableFormat), row.scene, row.triangles, row.view, row.work, row.threads,
        row.rays == 0 ? "" : fmt::format("{:.1f}", 100 * row.hit_share),
        row.tracer + ' ' + row.target, row.peer, name_of(row.unit), fmt::format("{:.2f}", row.ours),
        fmt::format("{:.2f}", row.peer_value), fmt::format("{:.2f}", row.ratio.median),
        fmt::format("{:.2f} - {:.2f}", row.ratio.min, row.ratio.max), row.mismatches.total());
}

std::string to_json(const ReportHead& head, std::span<const Row> rows) {
    std::string text = fmt::format(
        "{{\n  \"schema\": \"morphray-bench/1\",\n  \"machine\": {},\n  \"isa\": {},\n  "
        "\"embree\": {},\n  \"version\": {},\n  \"command\": {},\n  \"rows\": [\n",
        json_text(head.machine), json_text(head.isa), json_text(head.embree),
        json_text(head.version), json_text(head.command));
    for (std::size_t i = 0; i < rows.size(); ++i) {
        text += to_json(rows[i]) + (i + 1 < rows.size() ? ",\n" : "\n");
    }
    return text + "  ]\n}\n";
}

std::string to_csv(const ReportHead& head, std::span<const Row> rows) {
    std::string text = fmt::format("# {}, {}; morphray {}, Embree {}\n# {}\n", head.machine,
                                   head.isa, head.version, head.embree, head.command);
    text +=
        "scene,triangles,view,work,threads,rays,hit_share,tracer,target,unit,ours,peer,peer_value,"
        "ratio,ratio_min,"
        "ratio_max,mismatches\n";
    for (const Row& row : rows) {
        text += fmt::format(
            "{},{},{},{},{},{},{:.4g},{},{},{},{:.4g},{},{:.4g},{:.4g},{:.4g},{:.4g},{}\n",
            csv_text(row.scene), row.triangles, row.view, row.work, row.threads, row.rays,
            row.hit_share, csv_text(row.tracer), csv_text(row.target), name_of(row.unit), row.ours,
            csv_text(row.peer), row.peer_value, row.ratio.median, row.ratio.min, row.ratio.max,
            row.mismatches.total());
    }
    return text;
}

}  // namespace morphray::bench
