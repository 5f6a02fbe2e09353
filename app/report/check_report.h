// The report of a cross-check: the object of --json, from which its text, JUnit and HTML are made.
#pragma once

#include <cstddef>

#include "app/base/options.h"
#include "app/report/json_parts.h"
#include "common/image/frame.h"

namespace mray::app {

/// An image by a variant: a backend, its instruction set and its tree.
struct CheckedImage {
    std::string backend;
    /// The CPU's instruction set; empty for the CPU without SIMD and for other backends.
    std::string simd = {};
    /// The backend that refitted the tree; empty for a tree that was built.
    std::string refit_on = {};
    double frame = 0;
    morphray::Rays rays = morphray::Rays::primary;
    /// "brute" or "cpu".
    std::string reference = {};
    double trace_ms = 0;

    const char* update() const { return refit_on.empty() ? "rebuild" : "refit"; }
    /// "vulkan, refit on cpu" or "cpu avx2, rebuild".
    std::string variant() const;
};

/// How many answers to a kind of query differ: its name in JSON, and for people.
struct QueryDifference {
    const char* name;
    const char* what;
    std::size_t count;
};

/// A report before the first scene. It has each scene of the options, as not complete.
Json empty_report(const Options& options);

// Each adds a comparison to the report, with a "title", and if it differs with a "message".

/// The first hundred images that differ get "details": differing pixels, and commands to trace
/// them.
void add_images(Json& scene, const Options& options, const CheckedImage& image,
                const Frame& expected, const Frame& actual);
void add_trees(Json& scene, double frame, std::uint64_t cpu_hash, std::uint64_t vulkan_hash);
/// The answers about options.query_count rays and as many points.
void add_answers(Json& scene, const Options& options, const CheckedImage& image,
                 const std::vector<QueryDifference>& differences);

inline constexpr const char* kResults[] = {"rows", "trees", "queries"};
std::size_t count_differing(const Json& results);

/// Sets "verdict", "equal" and "complete", such as "equal: 144 comparisons of 3 scenes".
/// `unfinished` says why a scene was not finished; empty if all were. What has no comparison is
/// not "equal".
void conclude(Json& report, const std::string& unfinished);

/// Everything about the scenes that were begun, one after the other, and the verdict.
std::string run_text(const Json& report);

/// A test suite a scene, with a test case a result, or one <error> if it was not finished.
std::string to_junit(const Json& report);

/// HTML that needs no other file, script or network. It has the JSON of the report, too.
std::string to_html(const Json& report);

}  // namespace mray::app
