// Traces one pixel and describes how its result comes about.
#pragma once

#include <string>
#include <vector>

#include "app/cli/options.h"
#include "app/commands/candidates.h"
#include "app/report/reports.h"
#include "app/terminal/messages.h"

namespace mray::app {

struct ProbeReport {
    ReportHead head;
    double frame = 0;
    Pixel pixel;
    std::string backend;
    std::string device;
    std::string update;
    std::string refit_on;
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

/// Traces the image of options.frame and describes options.pixel, and writes options.bundle. Throws
/// Error(kBadArgument) for a pixel outside the image.
ProbeReport probe_pixel(const Options& options, const Messages& messages);

}  // namespace mray::app
