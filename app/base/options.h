// The options of the commands as plain data: a structure for each command.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <variant>

#include "common/base/errors.h"
#include "common/bvh/builder/bvh_builder.h"
#include "common/text/text.h"
#include "common/update/policy.h"
#include "morphray/images.hpp"
#include "morphray/queries.hpp"
#include "scenes/animation.h"

namespace mray::app {

struct Pixel {
    std::uint32_t x = 0;
    std::uint32_t y = 0;
};

enum class BackendChoice { kAuto, kCpu, kVulkan, kBrute };

enum class Reference { kAuto, kBrute, kCpu };

enum class ExrColours { kHalf, kFloat };

enum class PointQuery { kInside, kWinding, kDistance, kClosest };

struct SourceOptions : AnimationOptions {
    std::string scene = {};
};

struct BackendOptions {
    BackendChoice choice = BackendChoice::kAuto;
    std::string device = {};
    /// 0 stands for as many as the machine has.
    int threads = 0;
    std::string simd = {};
    bool validate = false;
};

struct TreeOptions {
    PolicySpec update = {};
    bool record_cost_ratio = false;
    /// The tree is built at the positions of this frame, or else of the first selected one.
    std::optional<double> build_at = {};
};

struct ImageOptions {
    SourceOptions source = {};
    /// In the coordinates of the file, as all views of options.
    morphray::View view = {.shading = morphray::Shading::lit};
    /// Also writes EXR files.
    std::optional<ExrColours> exr = {};
    /// The scene stands on a plane that shows the background; without a value has_ground() decides.
    std::optional<bool> ground = {};
    BackendOptions backend = {};
    TreeOptions tree = {.update = {PolicyKind::kAuto}};
};

struct RenderOptions {
    ImageOptions image = {};
    std::string frames = {};
    std::string out = "out";
    std::string hits = {};
    std::string json = {};
};

struct ViewOptions {
    ImageOptions image = {
        .view = {.width = 1280, .height = 720, .shading = morphray::Shading::lit}};
    /// Without a value the first frame of the scene is shown first.
    std::optional<double> frame = {};
    bool plays = false;
    /// The file of the first image that is complete; with it no window stays open.
    std::string screenshot = {};
};

struct CrosscheckOptions {
    std::vector<std::string> scenes = {};
    /// Its scene is the one that is being checked.
    SourceOptions source = {};
    std::string frames = {};
    morphray::View view = {.width = 256, .height = 256};
    /// Without a value all three kinds of rays are compared.
    std::optional<morphray::Rays> rays = {};
    BackendOptions backend = {};
    Reference reference = Reference::kAuto;
    /// The number of rays and of points a frame that the backends are asked about.
    std::uint32_t query_count = 0;
    /// Compares the digests of devices instead of scenes.
    bool digest = false;
    std::string json = {};
    std::string junit = {};
    std::string html = {};
    /// The command line without the program's name.
    std::vector<std::string> arguments = {};
};

struct DiffOptions {
    /// The file that is expected, and the other one.
    std::vector<std::string> files = {};
};

struct ProbeOptions {
    SourceOptions source = {};
    double frame = 0;
    Pixel pixel = {};
    morphray::View view = {};
    BackendOptions backend = {};
    TreeOptions tree = {};
};

struct ProfileOptions {
    SourceOptions source = {};
    std::string frames = {};
    morphray::View view = {};
    BackendOptions backend = {};
    TreeOptions tree = {};
    /// The number of runs whose median is reported: without a value 10, or 5 for policies.
    std::optional<int> repeat = {};
    /// Without policies to compare the times of the stages are reported.
    std::vector<PolicySpec> policies = {};
    std::string plot = {};
    std::string json = {};
    std::string csv = {};
};

struct TraceOptions {
    SourceOptions source = {};
    std::optional<double> frame = {};
    BackendOptions backend = {.choice = BackendChoice::kCpu};
    std::string ray_file = {};
    bool binary_rays = false;
    bool all_hits = false;
    morphray::AllHitsOptions hit_lists = {};
    std::string out = {};
};

struct QueryOptions {
    SourceOptions source = {};
    std::optional<double> frame = {};
    BackendOptions backend = {.choice = BackendChoice::kCpu};
    std::string point_file = {};
    /// Each at most once, in the order of the answers.
    std::vector<PointQuery> queries = {};
    morphray::FillRule rule = morphray::FillRule::nonzero;
    float max_distance = std::numeric_limits<float>::infinity();
    std::string out = "-";
};

struct ChartOptions {
    std::vector<std::string> scenes = {};
    std::string out = {};
    bool quick = false;
    bool lenient = false;
};

struct InfoOptions {
    /// Without a scene the program is described.
    SourceOptions source = {};
    std::optional<double> frame = {};
    bool tree_facts = false;
    std::string json = {};
};

struct DevicesOptions {
    bool checks = false;
    std::string json = {};
};

using CommandOptions = std::variant<RenderOptions, ViewOptions, CrosscheckOptions, DiffOptions,
                                    ProbeOptions, ProfileOptions, TraceOptions, QueryOptions,
                                    ChartOptions, InfoOptions, DevicesOptions>;

/// The arguments that make another command read the scene in the same way, without its name.
std::vector<std::string> arguments_of(const SourceOptions& source);
/// The arguments that make another command trace this view, as far as the image has them.
std::vector<std::string> arguments_of(const morphray::View& view, morphray::Rays rays, bool is_lit);

template <class T>
struct Choice {
    const char* name;
    T value;
};

template <class T, std::size_t N>
std::string names_of(const Choice<T> (&choices)[N]) {
    std::string names = choices[0].name;
    for (std::size_t i = 1; i < N; ++i) names.append("|").append(choices[i].name);
    return names;
}

template <class T, std::size_t N>
const char* name_in(const Choice<T> (&choices)[N], T value) {
    return std::ranges::find(choices, value, &Choice<T>::value)->name;
}

/// The value of the name; throws Error(kBadArgument) for any other text.
template <class T, std::size_t N>
T value_in(const Choice<T> (&choices)[N], std::string_view text) {
    const auto* const found = std::ranges::find(choices, text, &Choice<T>::name);
    if (found == std::end(choices))
        throw Error(ErrorKind::kBadArgument, "{} is not one of {}", quote(text), names_of(choices));
    return found->value;
}

inline constexpr Choice<BackendChoice> kBackends[] = {{"auto", BackendChoice::kAuto},
                                                      {"cpu", BackendChoice::kCpu},
                                                      {"vulkan", BackendChoice::kVulkan},
                                                      {"brute", BackendChoice::kBrute}};
inline constexpr Choice<BackendChoice> kCheckedBackends[] = {{"all", BackendChoice::kAuto},
                                                             {"cpu", BackendChoice::kCpu},
                                                             {"vulkan", BackendChoice::kVulkan}};
inline constexpr Choice<morphray::Rays> kRays[] = {{"primary", morphray::Rays::primary},
                                                   {"shadow", morphray::Rays::shadow},
                                                   {"ao", morphray::Rays::ao}};
inline const char* name_of_rays(morphray::Rays rays) { return name_in(kRays, rays); }
inline constexpr Choice<morphray::Shading> kShadings[] = {{"lit", morphray::Shading::lit},
                                                          {"plain", morphray::Shading::plain},
                                                          {"normal", morphray::Shading::normal},
                                                          {"depth", morphray::Shading::depth},
                                                          {"prim", morphray::Shading::prim}};
inline constexpr Choice<std::uint32_t> kSampleCounts[] = {
    {"1", 1}, {"4", 4}, {"16", 16}, {"64", 64}};
inline constexpr Choice<bool> kOnOff[] = {{"on", true}, {"off", false}};
inline constexpr Choice<ExrColours> kExrColours[] = {{"half", ExrColours::kHalf},
                                                     {"float", ExrColours::kFloat}};
inline constexpr Choice<morphray::Crossing> kCrossings[] = {{"once", morphray::Crossing::once},
                                                            {"each", morphray::Crossing::each},
                                                            {"owner", morphray::Crossing::owner}};
inline constexpr Choice<morphray::FillRule> kFillRules[] = {
    {"nonzero", morphray::FillRule::nonzero}, {"odd", morphray::FillRule::odd}};
inline constexpr Choice<PointQuery> kPointQueries[] = {{"inside", PointQuery::kInside},
                                                       {"winding", PointQuery::kWinding},
                                                       {"distance", PointQuery::kDistance},
                                                       {"closest", PointQuery::kClosest}};
inline constexpr const char* kPointQueriesHelp =
    "what is answered, in this order: inside: 0 or 1; winding: how often meshes wind around the "
    "point; distance: to the surface, negative inside; closest: `x y z distance prim u v feature` "
    "(prim: the triangle's number)";
inline constexpr Choice<Reference> kReferences[] = {
    {"auto", Reference::kAuto}, {"brute", Reference::kBrute}, {"cpu", Reference::kCpu}};

}  // namespace mray::app
