// The report of a judged driver.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "accuracy/suspect/suspect.h"

namespace mray::app {

/// The answers to one set of rays at one pose.
struct SuspectRow {
    std::string scene;
    std::uint64_t triangles = 0;
    double frame = 0;
    /// "built", "updated" or "rebuilt".
    std::string structure;
    /// "camera" or "aimed".
    std::string view;
    accuracy::SuspectCounts counts;
    /// The hash of the driver's closest hits.
    std::uint64_t hits_hash = 0;
    /// Milliseconds of the build or update, and of the closest hits of all rays.
    double build_ms = 0;
    double trace_ms = 0;
};

struct SuspectFinding {
    accuracy::Fault fault = accuracy::Fault::kLost;
    /// Scene, frame, structure, and pixel or number of the ray.
    std::string place;
    std::string description;
    /// The `morphray probe` of the pixel; empty for aimed rays.
    std::string probe;
    /// The finding on the fewest triangles, as C; empty if it was not shrunk.
    std::string reproducer;
    std::size_t triangles = 0;
};

/// An image whose pixels are grey, or coloured by their fault.
struct SuspectPicture {
    std::string title;
    std::vector<std::byte> png;
};

struct SuspectRun {
    std::string driver;
    std::string command;
    std::uint32_t width = 0;
    std::uint32_t height = 0;
    std::vector<SuspectRow> rows;
    std::vector<SuspectFinding> findings;
    std::vector<SuspectPicture> pictures;

    std::uint64_t wrong() const;
};

/// The colour of a fault in pictures, 8-bit RGBA with R in bits 0-7.
std::uint32_t colour_of(accuracy::Fault fault);

std::string suspect_text(const SuspectRun& run);
std::string suspect_json(const SuspectRun& run);
/// HTML that needs no other file and no network.
std::string suspect_html(const SuspectRun& run);

}  // namespace mray::app
