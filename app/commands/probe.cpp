// morphray probe: describes one pixel.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "app/commands/commands.h"
#include "app/commands/pixel_probe.h"
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

bool is_same_hit(const Hit& a, const Hit& b) { return std::memcmp(&a, &b, sizeof(a)) == 0; }

std::string text_of(const Hit& hit) {
    return hit.prim_id == kNoPrim ? "nothing" : fmt::format("triangle {}", hit.prim_id);
}

/// The hit that another way finds in the place of the image's.
std::string other(const Hit& hit, const Hit& image) {
    return hit.prim_id == image.prim_id ? "it with other t, u or v" : text_of(hit);
}

Hit best_of(const std::vector<Candidate>& candidates) {
    Hit hit = no_hit();
    if (candidates.empty() || !candidates.front().is_hit) return hit;
    const Candidate& first = candidates.front();
    hit.prim_id = first.prim_id;
    hit.t = first.t;
    hit.u = first.u;
    hit.v = first.v;
    return hit;
}

double distance_of(const ProbeReport& report) {
    const vec3 d = report.ray.dir;
    return std::ldexp(report.image.t * std::hypot(d.x, d.y, d.z), -report.exponent);
}

}  // namespace

std::string probe_sentence(const ProbeReport& report) {
    std::string text = text_of(report.image);
    if (report.image.prim_id != kNoPrim) text += fmt::format(", {:.3g} away", distance_of(report));
    text += fmt::format(", {}; ", colour_name(report.colour));
    const Hit brute = best_of(report.candidates);
    const bool is_alone = is_same_hit(report.image, report.alone);
    const bool is_brute = is_same_hit(report.image, brute);
    if (is_alone && is_brute) return text + "all agree";
    if (!is_alone) text += "THE RAY ALONE FINDS " + other(report.alone, report.image);
    if (!is_alone && !is_brute) text += ", ";
    if (!is_brute) text += "BRUTE FORCE FINDS " + other(brute, report.image);
    return text;
}

std::string colour_name(std::uint32_t colour) {
    const int red = static_cast<int>(colour & 0xFF);
    const int green = static_cast<int>((colour >> 8) & 0xFF);
    const int blue = static_cast<int>((colour >> 16) & 0xFF);
    const int most = std::max({red, green, blue});
    const int spread = most - std::min({red, green, blue});
    if (most < 24) return "black";
    if (8 * spread < most) {
        if (most > 240) return "white";
        return most < 85 ? "dark grey" : most > 170 ? "light grey" : "grey";
    }
    // The hue in degrees, from red over green and blue.
    const double part = 60.0 / spread;
    double hue = 0;
    if (most == red)
        hue = part * (green - blue);
    else if (most == green)
        hue = 120 + part * (blue - red);
    else
        hue = 240 + part * (red - green);
    if (hue < 0) hue += 360;
    struct Hue {
        double end;
        const char* name;
    };
    constexpr Hue kHues[] = {{15, "red"},     {45, "orange"}, {70, "yellow"},
                             {165, "green"},  {195, "cyan"},  {255, "blue"},
                             {290, "violet"}, {345, "pink"},  {361, "red"}};
    const char* const name =
        std::ranges::find_if(kHues, [&](const Hue& one) { return hue < one.end; })->name;
    return fmt::format("{}{}",
                       most < 140                        ? "dark "
                       : 2 * spread < most && most > 180 ? "light "
                                                         : "",
                       name);
}

ExitCode run_probe(const ProbeOptions& options, const Messages& messages) {
    check_reports({options.json});
    const ProbeReport report = probe_pixel(options, messages);
    if (!options.json.empty()) write_report(options.json, to_json(report));
    if (!takes_stdout({options.json})) messages.print(probe_text(report));
    return ExitCode::kOk;
}

}  // namespace mray::app
