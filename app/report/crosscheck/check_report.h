// The results of a cross-check, from which its table, JSON, JUnit and HTML are made.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "app/base/options.h"
#include "app/report/json_parts.h"
#include "common/report/compare.h"

namespace mray::app {

/// The comparison of one variant of one frame with the reference.
struct CheckRow {
    double frame = 0;
    std::string backend;
    /// The CPU's instruction set; empty for the CPU without SIMD and for other backends.
    std::string simd;
    /// "refit" or "rebuild", and the backend that refitted.
    std::string update;
    std::string refit_on;
    std::string rays;
    /// "brute" or "cpu".
    std::string reference;
    FrameDifference difference;
    std::uint64_t expected_hits_hash = 0;
    std::uint64_t hits_hash = 0;
    std::uint64_t expected_image_hash = 0;
    std::uint64_t image_hash = 0;
    double trace_ms = 0;

    bool equal() const {
        return difference.total() == 0 && hits_hash == expected_hits_hash &&
               image_hash == expected_image_hash;
    }
    /// "vulkan, refit on cpu" or "cpu avx2, rebuild".
    std::string variant() const;
};

/// Fills in the difference and the hashes.
void compare(const Frame& expected, const Frame& actual, CheckRow& row);

/// The trees of one frame, refitted on two backends.
struct TreeRow {
    double frame = 0;
    std::uint64_t cpu_hash = 0;
    std::uint64_t vulkan_hash = 0;
    bool equal() const { return cpu_hash == vulkan_hash; }
};

/// The numbers of rays and points whose answers differ.
struct QueryDifference {
    std::size_t all_hits = 0;
    std::size_t winding = 0;
    std::size_t closest = 0;
    std::size_t total() const { return all_hits + winding + closest; }
};
/// "3 rays differ in all hits, 1 point differs in the winding"; empty if nothing differs.
std::string describe(const QueryDifference& difference);

/// The answers of one variant of one frame to --queries, against the reference.
struct QueryRow {
    double frame = 0;
    /// CheckRow::variant().
    std::string variant;
    /// "brute" or "cpu".
    std::string reference;
    /// The number of rays, and of points.
    std::uint32_t count = 0;
    QueryDifference difference = {};
    bool equal() const { return difference.total() == 0; }
};

struct CheckReport {
    ReportHead head;
    /// The scene as the command line names it.
    std::string spec;
    /// The device's description; empty without Vulkan.
    std::string device;
    bool complete = true;
    /// Why it is not complete.
    std::string error;
    /// The tree that is refitted is built at the first one.
    std::vector<double> frames;
    std::vector<std::string> warnings;
    std::vector<CheckRow> rows;
    std::vector<TreeRow> trees;
    /// For --queries.
    std::vector<QueryRow> queries;

    std::size_t comparisons() const { return rows.size() + trees.size() + queries.size(); }
    std::size_t differing() const;
    bool equal() const { return differing() == 0; }
};

/// Lists what was compared, for reports that are read on another machine.
struct CheckEnvironment {
    std::vector<morphray::VulkanDeviceInfo> devices;
    /// Instruction sets of the CPU that are compared.
    std::vector<std::string> simd;
    /// The command, ready for a shell.
    std::string command;
};

struct CheckRun {
    CheckEnvironment environment;
    std::vector<CheckReport> scenes;
    /// Why the run ended before its last scene, if it did.
    std::string error;

    bool complete() const;
    bool equal() const;
};

Json crosscheck_json(const CheckRun& run);
std::string to_json(const CheckRun& run);

/// A test suite for each scene, with the environment as properties. It has a test case for each
/// variant, frame and kind of rays and for each pair of trees. A scene that was not finished has
/// one with an <error>. The root is the test suite, or
/// <testsuites> for several scenes.
std::string to_junit(const CheckRun& run);

/// HTML that needs no other file and no network. It holds the object of --json with one more
/// member, "details": the pixels and commands of rows that differ.
std::string to_html(const CrosscheckOptions& options, const CheckRun& run);

/// The first differing pixels of a comparison with both values, exactly, and for each the commands
/// that trace it as the reference and as the variant. `build_at` is the frame that the refitted
/// tree was built at.
std::string describe_row(const CrosscheckOptions& options, const CheckRow& row, double build_at);

/// "frame 3, vulkan, rebuild, against brute: 3 rays differ in all hits".
std::string query_text(const QueryRow& row);

/// A line for each variant, one for each pair of trees and each set of answers that differ.
std::string table_text(const CheckReport& report);

/// "all 12 comparisons are equal bit by bit", or how many differ.
std::string summary_text(const CheckReport& report);

/// Everything about the scenes, one after the other; nothing about a scene that was not begun.
std::string run_text(const CrosscheckOptions& options, const CheckRun& run);

}  // namespace mray::app
