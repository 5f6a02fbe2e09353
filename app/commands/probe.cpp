// morphray probe: describes one pixel.
#include <fmt/format.h>

#include <cmath>
#include <cstring>
#include <utility>

#include "app/commands/commands.h"
#include "app/commands/pixel_probe.h"
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
    Table table({"prim", "result", "t", "edge U", "edge V", "edge W", "fails"});
    for (const Candidate& c : report.candidates) {
        std::string fails;
        for (const auto& [holds, name] :
             {std::pair(c.inside, "inside"), std::pair(c.has_area, "area"),
              std::pair(c.in_range, "range"), std::pair(c.finite, "finite"),
              std::pair(c.meets_box, "box"), std::pair(c.may_hit, "filter")})
            if (!holds) fails += std::string(fails.empty() ? "" : " ") + name;
        const bool is_first = &c == &report.candidates.front();
        table.add({fmt::format("{}", c.prim_id),
                   !c.is_hit  ? "no hit"
                   : is_first ? "wins"
                              : "hit",
                   hex_text(c.t), hex_text(c.edge_u), hex_text(c.edge_v), hex_text(c.edge_w),
                   fails});
    }
    return "triangles by brute force, the answer first; and the conditions that fail\n" +
           table.text();
}

std::string probe_text(const ProbeReport& report) {
    const BvhStats& tree = report.tree;
    std::string text = probe_sentence(report) + '\n';
    text += fmt::format("{}, frame {}, pixel {},{} of {}x{}, {} rays\n", report.head.scene,
                        report.frame, report.pixel.x, report.pixel.y, report.head.width,
                        report.head.height, report.rays);
    text += fmt::format("backend {}: {}\n", report.backend, report.device);
    text += fmt::format(
        "tree    {}: {} nodes, {} leaves, depth {}, SAH cost {:.3f}\n        hash {}\n\n",
        report.update, tree.node_count, tree.leaf_count, tree.depth, tree.sah_cost,
        hash_text(report.bvh_hash));
    text += ray_text(report) + "\n";
    text += hit_text("hit in the image", report.image, report.world_depth);
    text += hit_text("hit of the ray alone", report.alone, report.world_depth);
    text += fmt::format("colour                #{:02x}{:02x}{:02x}\n", report.colour & 0xFF,
                        (report.colour >> 8) & 0xFF, (report.colour >> 16) & 0xFF);
    return text + secondary_text(report) + "\n" + candidates_text(report);
}

/// The answer of brute force.
Hit best_of(const std::vector<Candidate>& candidates) {
    if (candidates.empty() || !candidates.front().is_hit) return no_hit();
    const Candidate& first = candidates.front();
    return {first.t, first.u, first.v, first.prim_id};
}

std::string text_of(const Hit& hit) {
    if (hit.prim_id == kNoPrim) return "nothing";
    return fmt::format("triangle {} at t {}", hit.prim_id, hex_text(hit.t));
}

}  // namespace

std::string probe_sentence(const ProbeReport& report) {
    const auto differs = [&](const Hit& hit) {
        return std::memcmp(&hit, &report.image, sizeof(hit)) != 0;
    };
    const Hit brute = best_of(report.candidates);
    if (differs(report.alone) || differs(brute))
        return fmt::format("DIFFERENT: the image has {}, the ray alone {}, brute force {}",
                           text_of(report.image), text_of(report.alone), text_of(brute));
    if (report.image.prim_id == kNoPrim) return "nothing; all agree";
    const vec3 d = report.ray.dir;
    const double distance =
        std::ldexp(report.image.t * std::hypot(d.x, d.y, d.z), -report.exponent);
    return fmt::format("triangle {}, {:.3g} away; all agree", report.image.prim_id, distance);
}

ExitCode run_command(const ProbeOptions& options, const Messages& messages) {
    messages.print(probe_text(probe_pixel(options, messages)));
    return ExitCode::kOk;
}

}  // namespace mray::app
