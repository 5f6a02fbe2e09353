// The differences of two files of hits.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/report/compare.h"

namespace mray::app {

/// Two files of hits.
struct DiffReport {
    std::string expected;
    std::string actual;
    std::uint32_t width = 0;
    std::uint32_t height = 0;
    /// One for each image of both files.
    std::vector<FrameDifference> images;

    std::uint64_t differing_images() const;
    std::uint64_t differing_pixels() const;
    bool equal() const { return differing_images() == 0; }
};

std::string to_json(const DiffReport& report);

}  // namespace mray::app
