// morphray probe: describes one pixel.
#include <fmt/format.h>

#include "app/commands/commands.h"
#include "app/commands/pixel_probe.h"
#include "app/commands/probe/probe_sentence.h"
#include "app/report/probe_report.h"
#include "common/report/table.h"
#include "common/text/number_text.h"

namespace mray::app {
namespace {

// Every bit, and a number to read.
std::string both(float x) { return fmt::format("{} ({:.6g})", hex_text(x), x); }

std::string hex_point(vec3 p) {
    return fmt::format("{}  {}  {}", hex_text(p.x), hex_text(p.y), hex_text(p.z));
}

std::string point(vec3 p) {
    return fmt::format("{}\n         ({:.6g}, {:.6g}, {:.6g})", hex_point(p), p.x, p.y, p.z);
}

std::string hit_text(const char* name, const Hit& hit, double world_depth) {
    if (hit.prim_id == kNoPrim) return fmt::format("{:<22}miss\n", name);
    return fmt::format("{:<22}prim {}, depth {:.9g} in world space\n  t {}\n  u {}  v {}\n", name,
                       hit.prim_id, hit.t * world_depth, both(hit.t), both(hit.u), both(hit.v));
}

std::string ray_text(const ProbeReport& report) {
    const Ray& ray = report.ray;
    std::string text = "ray in scene space\n";
    text += "  org    " + point(ray.org) + "\n  dir    " + point(ray.dir) + "\n";
    text += fmt::format("  tnear  {}\n  tfar   {}\n", both(ray.tnear), both(ray.tfar));
    text += fmt::format(
        "ray in world space\n  org    ({:.9g}, {:.9g}, {:.9g})\n  depth of t = 1   {:.9g}\n",
        report.world_org[0], report.world_org[1], report.world_org[2], report.world_depth);
    return text;
}

std::string secondary_text(const ProbeReport& report) {
    if (report.rays == "primary") return {};
    std::string text =
        fmt::format("secondary rays        {} occluded in the image\n", report.occlusion);
    if (report.rays == "shadow" && report.image.prim_id != kNoPrim && !report.faces_light) {
        text += "  the surface faces away from the light: in shadow without a ray\n";
    }
    for (std::size_t i = 0; i < report.secondary.size(); ++i) {
        const ProbeReport::Secondary& s = report.secondary[i];
        const std::string hit =
            s.hit.prim_id == kNoPrim
                ? std::string("free")
                : fmt::format("prim {} at t {}", s.hit.prim_id, hex_text(s.hit.t));
        text += fmt::format("  {:<3}  org {}\n       dir {}\n       tfar {}  {}\n", i,
                            hex_point(s.ray.org), hex_point(s.ray.dir), hex_text(s.ray.tfar), hit);
    }
    return text;
}

std::string candidates_text(const ProbeReport& report) {
    if (report.candidates.empty()) return "no triangle comes near\n";
    Table hits({"prim", "verdict", "t", "u", "v", "inside", "area", "range", "finite"});
    Table edges({"prim", "edge U", "edge V", "edge W", "box", "may hit"});
    const auto mark = [](bool condition) { return condition ? "yes" : "no"; };
    for (const Candidate& c : report.candidates) {
        const bool first = &c == &report.candidates.front();
        const std::string prim = fmt::format("{}", c.prim_id);
        hits.add({prim,
                  !c.is_hit ? "no hit"
                  : first   ? "wins"
                            : "hit",
                  hex_text(c.t), hex_text(c.u), hex_text(c.v), mark(c.inside), mark(c.has_area),
                  mark(c.in_range), mark(c.finite)});
        edges.add({prim, hex_text(c.edge_u), hex_text(c.edge_v), hex_text(c.edge_w),
                   mark(c.meets_box), mark(c.may_hit)});
    }
    return "triangles by brute force, the answer first\n" + hits.text() +
           "their edge functions and filters\n" + edges.text();
}

std::string probe_text(const ProbeReport& report) {
    const BvhStats& tree = report.tree;
    std::string text = probe_sentence(report) + '\n';
    text += fmt::format("{}, frame {}, pixel {},{} of {}x{}, {} rays\n", report.head.scene,
                        report.frame, report.pixel.x, report.pixel.y, report.head.width,
                        report.head.height, report.rays);
    text += fmt::format("backend {}: {}\n", report.backend, report.device);
    text += fmt::format(
        "tree    {}{}: {} nodes, {} leaves, depth {}, SAH cost {:.3f}\n        hash {}\n\n",
        report.update, report.refit_on.empty() ? "" : " on " + report.refit_on, tree.node_count,
        tree.leaf_count, tree.depth, tree.sah_cost, hash_text(report.bvh_hash));
    text += ray_text(report) + "\n";
    text += hit_text("hit in the image", report.image, report.world_depth);
    text += hit_text("hit of the ray alone", report.alone, report.world_depth);
    text += fmt::format("colour                #{:02x}{:02x}{:02x}\n", report.colour & 0xFF,
                        (report.colour >> 8) & 0xFF, (report.colour >> 16) & 0xFF);
    return text + secondary_text(report) + "\n" + candidates_text(report);
}

}  // namespace

ExitCode run_probe(const Options& options, const Messages& messages) {
    check_reports({options.json});
    const ProbeReport report = probe_pixel(options, messages);
    if (!options.json.empty()) write_report(options.json, to_json(report));
    if (!takes_stdout({options.json})) messages.print(probe_text(report));
    return ExitCode::kOk;
}

}  // namespace mray::app
