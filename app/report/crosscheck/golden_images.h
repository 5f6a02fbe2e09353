// Hashes of images that were found good once, and comparisons with them.
#pragma once

#include <string>
#include <vector>

#include "app/base/options.h"
#include "app/report/crosscheck/check_report.h"

namespace mray::app {

/// The images of one scene at one size and view.
struct GoldenScene {
    /// As the command line names it.
    std::string scene;
    std::uint32_t width = 0;
    std::uint32_t height = 0;
    /// The options that decide which image is traced.
    std::string view;
    std::vector<ReferenceImage> images;
};

/// A file of --bless.
struct GoldenImages {
    std::string file;
    std::vector<GoldenScene> scenes;

    /// Compares an image of options.scene with the one in the file. An image that the file lacks is
    /// a problem.
    ExpectedRow compare(const Options& options, const ReferenceImage& image) const;
};

/// The run's reference images and its environment as JSON.
std::string golden_text(const Options& options, const CheckRun& run);

/// Throws Error(kBadInput), with the line if it is not JSON, for any other file.
GoldenImages read_golden(const std::string& file);

}  // namespace mray::app
