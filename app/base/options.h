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

/// What a command line says; app/cli/command_line.cpp lists the commands that have an option.
struct Options {
    std::string command = {};
    bool quiet = false;
    bool verbose = false;
    /// SCENES or FILES.
    std::vector<std::string> inputs = {};
    /// With SCENE; of crosscheck the one that is being checked.
    SourceOptions source = {};
    std::string frames = {};
    /// Without a value the first frame of the scene.
    std::optional<double> frame = {};
    Pixel pixel = {};
    /// In the coordinates of the file, as all views of options.
    morphray::View view = {};
    /// The kinds that crosscheck compares.
    std::vector<morphray::Rays> rays = {morphray::Rays::primary, morphray::Rays::shadow,
                                        morphray::Rays::ao};
    /// The scene stands on a plane that shows the background; without a value has_ground() decides.
    std::optional<bool> ground = {};
    BackendOptions backend = {};
    TreeOptions tree = {};

    std::string out = {};
    std::string json = {};
    /// Of render: also writes EXR files, and the hits to this file.
    std::optional<ExrColours> exr = {};
    std::string hits = {};
    /// Of view: with a file for the first image that is complete no window stays open.
    bool plays = false;
    std::string screenshot = {};
    /// Of crosscheck: compares the digests of devices instead of scenes.
    bool digest = false;
    /// Whether the reference is brute force; without a value where that takes seconds.
    std::optional<bool> brute_reference = {};
    /// The number of rays and of points a frame that the backends are asked about.
    std::uint32_t query_count = 0;
    std::string junit = {};
    std::string html = {};
    /// The command line without the program's name.
    std::vector<std::string> arguments = {};
    /// Of profile: the runs whose median is reported; without a value 10, or 5 for policies.
    std::optional<int> repeat = {};
    /// Without policies to compare the times of the stages are reported.
    std::vector<PolicySpec> policies = {};
    std::string plot = {};
    std::string csv = {};
    /// Of trace.
    std::string ray_file = {};
    bool binary_rays = false;
    bool all_hits = false;
    morphray::AllHitsOptions hit_lists = {};
    /// Of query. Each question is there at most once, in the order of the answers.
    std::string point_file = {};
    std::vector<Question> questions = {};
    bool counts_only = false;
    morphray::FillRule rule = morphray::FillRule::nonzero;
    float max_distance = std::numeric_limits<float>::infinity();
    /// Of chart, info and devices.
    bool quick = false;
    bool tree_facts = false;
    bool crossing_count = false;
    bool checks = false;
};

/// The arguments that make another command trace the scene and this view, as far as the image has
/// them: its size, and what is given.
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
