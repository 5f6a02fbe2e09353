// The options of all commands as plain data.
#pragma once

#include <fmt/format.h>

#include <algorithm>

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
    bool operator==(const Pixel&) const = default;
};

enum class BackendChoice { kAuto, kCpu, kVulkan, kBrute };

enum class ExrColours { kHalf, kFloat };

enum class Question { kInside, kWinding, kDistance, kClosest, kCrossings };

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

/// The values of a command line. app/cli/command_line.cpp says which commands have which option.
struct Options {
    std::string command = {};
    bool quiet = false;
    bool verbose = false;
    /// The scenes of crosscheck, the files of diff.
    std::vector<std::string> inputs = {};
    /// The scene; crosscheck sets it to each scene in turn.
    SourceOptions source = {};
    std::string frames = {};
    /// Without a value it is the first frame of the scene.
    std::optional<double> frame = {};
    Pixel pixel = {};
    /// Its points and lengths are in the coordinates of the file.
    morphray::View view = {};
    /// The rays that crosscheck compares.
    std::vector<morphray::Rays> rays = {morphray::Rays::primary, morphray::Rays::shadow,
                                        morphray::Rays::ao};
    /// True if a plane below the scene shows shadows. Without a value has_ground() decides.
    std::optional<bool> ground = {};
    BackendOptions backend = {};
    TreeOptions tree = {};

    std::string out = {};
    std::string json = {};
    /// The format of colours in EXR files of render. Without a value there are none.
    std::optional<ExrColours> exr = {};
    /// The file of raw hits that render writes, or empty.
    std::string hits = {};
    /// True if the viewer plays from its start.
    bool plays = false;
    /// The file of the viewer's first complete image, after which it ends; or empty.
    std::string screenshot = {};
    /// True if crosscheck compares digests of devices instead of scenes.
    bool digest = false;
    /// True if crosscheck refers to brute force. Without a value it does where that takes seconds.
    std::optional<bool> brute_reference = {};
    /// The number of rays, and of points, that crosscheck asks every backend about in a frame.
    std::uint32_t query_count = 0;
    std::string junit = {};
    std::string html = {};
    /// The command line without the program's name.
    std::vector<std::string> arguments = {};
    /// The runs of profile whose median is reported. Without a value 10, or 5 to compare policies.
    std::optional<int> repeat = {};
    /// The policies that profile compares. Without any it reports the times of stages.
    std::vector<PolicySpec> policies = {};
    std::string csv = {};
    /// The rays of trace, and what it writes about them.
    std::string ray_file = {};
    bool binary_rays = false;
    bool all_hits = false;
    morphray::AllHitsOptions hit_lists = {};
    /// The points of query.
    std::string point_file = {};
    /// The questions of query, in the order of the answers. None is there twice.
    std::vector<Question> questions = {};
    bool counts_only = false;
    morphray::FillRule rule = morphray::FillRule::nonzero;
    float max_distance = std::numeric_limits<float>::infinity();
    /// True if chart draws small charts.
    bool quick = false;
    /// True if info describes the tree; and if it counts crossings.
    bool tree_facts = false;
    bool crossing_count = false;
    /// True if devices tests each device.
    bool checks = false;
};

/// The arguments by which another command traces the same scene from the same view.
std::vector<std::string> arguments_of(const Options& options, morphray::Rays rays, bool is_lit);

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
inline constexpr Choice<Question> kQuestions[] = {{"inside", Question::kInside},
                                                  {"winding", Question::kWinding},
                                                  {"distance", Question::kDistance},
                                                  {"closest", Question::kClosest},
                                                  {"crossings", Question::kCrossings}};
inline constexpr const char* kQuestionsHelp =
    "what is answered, in this order: inside: 0 or 1; winding: how often meshes wind around the "
    "point; distance: to the surface, negative inside; closest: `x y z distance prim u v feature` "
    "(prim: the triangle's number); or, without points, crossings: a line `frame mesh prim mesh "
    "prim` for each pair of triangles that cross";
inline constexpr Choice<std::optional<bool>> kReferences[] = {
    {"auto", std::nullopt}, {"brute", true}, {"cpu", false}};

}  // namespace mray::app
