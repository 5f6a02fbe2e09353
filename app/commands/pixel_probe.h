// One pixel with everything that decides it.
#pragma once

#include <string>
#include <vector>

#include "app/cli/options.h"
#include "app/commands/candidates.h"
#include "app/report/reports.h"
#include "app/terminal/messages.h"

namespace morphray::app {

struct ProbeReport {
    ReportHead head;
    double frame = 0;
    Pixel pixel;
    std::string backend;
    std::string device;
    std::string update;
    std::string refit_on;
    std::string rays;

    /// user = scene * 2^-exponent, but for a shift of the origin.
    int exponent = 0;
    Ray ray;
    Point user_org = {};
    /// Depth along the viewing direction in world space, for t = 1.
    double user_depth = 0;

    /// The pixel of the whole image, and its ray traced alone.
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
    /// As find_candidates orders them.
    std::vector<Candidate> candidates;
};

/// Renders the frame of options.frame and looks at options.pixel. Throws Error, kUsage for a pixel
/// outside the image.
ProbeReport probe_pixel(const Options& options, const Messages& messages);

}  // namespace morphray::app
