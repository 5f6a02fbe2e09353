// The results of `render`.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "app/report/report_head.h"
#include "common/frame_times.h"

namespace mray::app {

struct FrameReport {
    double frame = 0;
    std::string backend;
    /// name_of(TreeStep) and the reason for it.
    std::string update;
    std::string reason;
    double cost_ratio = 1;
    /// The backend that refitted, or empty.
    std::string refit_on;
    std::uint64_t hits_hash = 0;
    std::uint64_t image_hash = 0;
    std::uint64_t bvh_hash = 0;
    FrameTimes times;
    /// The time that render waited for the frame's positions, which are made while the frame before
    /// is traced; the time that its outputs took to encode and write, while later frames are
    /// traced; and the time that render waited for the outputs of earlier frames.
    double read_wait_ms = 0;
    double write_ms = 0;
    double write_wait_ms = 0;
    std::uint64_t hits = 0;
    std::uint64_t misses = 0;
    std::uint64_t occluded = 0;
    double sah_cost = 0;
    /// The image's file name, if there is one.
    std::string file;
};

struct RenderReport {
    ReportHead head;
    std::string backend;
    std::string device;
    std::string rays;
    std::string shading;
    /// Camera rays a pixel.
    std::uint32_t samples = 1;
    /// False if an error or a signal ended it early.
    bool complete = true;
    std::vector<FrameReport> frames;
    /// Frames whose images of an earlier run were kept.
    std::vector<double> kept;
};

std::string to_json(const RenderReport& report);

}  // namespace mray::app
