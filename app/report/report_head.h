// The head of every report.
#pragma once

#include <cstdint>
#include <string>

namespace mray::app {

/// The head of every report.
struct ReportHead {
    std::string command;
    std::string scene;
    std::uint64_t triangles = 0;
    std::uint64_t vertices = 0;
    std::uint32_t width = 0;
    std::uint32_t height = 0;
};

}  // namespace mray::app
