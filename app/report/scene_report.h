// The results of `info` and `devices`.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "app/files/format_table.h"
#include "app/report/report_head.h"
#include "common/bvh/bvh_stats.h"
#include "common/scene/mesh.h"
#include "morphray/device.hpp"
#include "scenes/clip.h"

namespace mray::app {

struct SceneReport {
    ReportHead head;
    double first_frame = 0;
    double last_frame = 0;
    /// Frames a second, if the scene has seconds.
    std::optional<double> fps;
    std::vector<ClipAnimation> animations;
    WorldBounds bounds;
    int exponent = 0;
    DegenerateCount degenerate;
    std::uint64_t topology_hash = 0;
    /// File names, and the number of triangles that show one of them.
    std::vector<std::string> textures;
    std::uint64_t textured_triangles = 0;
    struct Tree {
        std::string build;
        double build_ms = 0;
        BvhStats stats;
        std::uint64_t bvh_hash = 0;
    };
    std::vector<Tree> trees;
};

struct ProgramReport {
    std::string build;
    struct Builtin {
        std::string name;
        std::string description;
        std::uint32_t default_triangles = 0;
    };
    std::vector<Builtin> builtins;
    std::vector<std::string> backends;
};

std::string to_json(const SceneReport& report);
std::string to_json(const ProgramReport& report);
std::string to_json(const std::vector<FileFormat>& formats);
/// `checks` has the result of each device that was tested.
std::string to_json(const std::vector<morphray::VulkanDeviceInfo>& devices,
                    const std::vector<std::optional<morphray::DeviceCheck>>& checks);

}  // namespace mray::app
