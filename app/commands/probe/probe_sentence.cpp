#include "app/commands/probe/probe_sentence.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>

namespace mray::app {
namespace {

bool is_same_hit(const Hit& a, const Hit& b) { return std::memcmp(&a, &b, sizeof(a)) == 0; }

std::string name_of(const Hit& hit) {
    return hit.prim_id == kNoPrim ? "nothing" : fmt::format("triangle {}", hit.prim_id);
}

/// The hit that another way finds in the place of the image's.
std::string other(const Hit& hit, const Hit& image) {
    return hit.prim_id == image.prim_id ? "it with other t, u or v" : name_of(hit);
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
    std::string text = name_of(report.image);
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

}  // namespace mray::app
