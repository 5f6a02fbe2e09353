// Traces one pixel and describes how its result comes about.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "app/base/options.h"
#include "app/report/json_parts.h"
#include "app/terminal/messages.h"
#include "common/bvh/bvh_stats.h"
#include "common/interop/ray.h"
#include "common/scene/camera_setup.h"

namespace mray::app {

/// A triangle that a ray may hit, with the result of every condition of the hit rule.
struct Candidate {
    std::uint32_t prim_id = 0;
    /// Edge functions of the projected vertices; inside the triangle all have one sign.
    float edge_u = 0;
    float edge_v = 0;
    float edge_w = 0;
    float t = 0;
    float u = 0;
    float v = 0;
    /// The least depth of hits in the triangle's own box (least_depth in common/interop/slab.h).
    float t_least = 0;

    bool may_hit = false;   // the fast filter keeps it
    bool inside = false;    // no two edges of opposite signs
    bool has_area = false;  // its vertices are not collinear
    bool in_range = false;  // 0 < t, tnear <= t <= tfar
    bool finite = false;
    bool meets_box = false;  // its own box, with a t_least up to last_depth of t
    bool is_hit = false;     // the result of the rule

    bool operator==(const Candidate&) const = default;
};

struct ProbeReport {
    ReportHead head;
    double frame = 0;
    Pixel pixel;
    std::string backend;
    std::string device;
    std::string update;
    std::string rays;

    /// world = scene * 2^-exponent, apart from a shift of the origin.
    int exponent = 0;
    Ray ray;
    /// The origin of the ray in world space.
    Point world_org = {};
    /// Depth along the viewing direction in world space, for t = 1.
    double world_depth = 0;

    /// The hit in the image, and the hit of the same ray traced alone.
    Hit image = no_hit();
    std::uint32_t occlusion = 0;
    std::uint32_t colour = 0;
    Hit alone = no_hit();

    bool faces_light = false;
    struct Secondary {
        Ray ray;
        Hit hit;
    };
    /// The shadow ray or the ambient-occlusion rays, each with its closest hit.
    std::vector<Secondary> secondary;

    BvhStats tree;
    std::uint64_t bvh_hash = 0;
    /// In the order of find_candidates.
    std::vector<Candidate> candidates;
};

/// Traces the image of options.frame and describes options.pixel. Throws Error(kBadArgument) for a
/// pixel outside the image.
ProbeReport probe_pixel(const ProbeOptions& options, const Messages& messages);

/// Returns a line such as "triangle 46629, 9.28 away; all agree", without a newline. It has the hit
/// in the image and its distance in world space. All agree if the single ray and brute force give
/// the same bits.
std::string probe_sentence(const ProbeReport& report);

}  // namespace mray::app
