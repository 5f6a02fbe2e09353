// Options that take one of a few names.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <span>
#include <string>
#include <type_traits>
#include <vector>

#include "app/base/options.h"
#include "common/base/errors.h"
#include "common/text/nearest_name.h"

namespace mray::app {

template <class T>
struct Choice {
    const char* name;
    T value;
};

/// "a|b|c".
template <class T>
std::string names_of(std::span<const Choice<T>> choices) {
    std::string names;
    for (const Choice<T>& choice : choices) {
        if (!names.empty()) names += '|';
        names += choice.name;
    }
    return names;
}

/// The name of a value that is one of the choices.
template <class T>
std::string name_in(std::type_identity_t<std::span<const Choice<T>>> choices, T value) {
    return std::ranges::find(choices, value, &Choice<T>::value)->name;
}

/// The value of the name; throws Error(kBadArgument) with a similar name for any other text.
template <class T>
T parse_choice(const std::string& option, const std::string& text,
               std::type_identity_t<std::span<const Choice<T>>> choices) {
    std::vector<std::string> names;
    for (const auto& [name, value] : choices) {
        if (text == name) return value;
        names.emplace_back(name);
    }
    // A GPU is a Vulkan device.
    const bool has_vulkan = std::find(names.begin(), names.end(), "vulkan") != names.end();
    const std::string hint =
        text == "gpu" && has_vulkan ? "; did you mean vulkan?" : suggestion(text, names);
    throw Error(ErrorKind::kBadArgument, fmt::format("{}: '{}' is not one of {}{}", option, text,
                                                     fmt::join(names, ", "), hint));
}

inline constexpr Choice<BackendChoice> kBackends[] = {{"auto", BackendChoice::kAuto},
                                                      {"cpu", BackendChoice::kCpu},
                                                      {"vulkan", BackendChoice::kVulkan},
                                                      {"brute", BackendChoice::kBrute}};
inline constexpr Choice<BackendChoice> kProfiledBackends[] = {{"auto", BackendChoice::kAuto},
                                                              {"cpu", BackendChoice::kCpu},
                                                              {"vulkan", BackendChoice::kVulkan},
                                                              {"brute", BackendChoice::kBrute}};
inline constexpr Choice<BackendChoice> kCheckedBackends[] = {{"all", BackendChoice::kAuto},
                                                             {"cpu", BackendChoice::kCpu},
                                                             {"vulkan", BackendChoice::kVulkan}};
inline constexpr Choice<std::uint32_t> kRays[] = {
    {"primary", kRaysPrimary}, {"shadow", kRaysShadow}, {"ao", kRaysAo}};
inline constexpr Choice<morphray::Shading> kShadings[] = {
    {"lit", morphray::Shading::lit},       {"plain", morphray::Shading::plain},
    {"normal", morphray::Shading::normal}, {"depth", morphray::Shading::depth},
    {"prim", morphray::Shading::prim},     {"steps", morphray::Shading::steps},
    {"sah", morphray::Shading::sah}};
inline constexpr Choice<std::uint32_t> kSampleCounts[] = {
    {"1", 1}, {"4", 4}, {"16", 16}, {"64", 64}};
inline constexpr Choice<const char*> kExrColours[] = {{"half", "half"}, {"float", "float"}};
inline constexpr Choice<SplitMethod> kSplits[] = {{"binned", SplitMethod::kBinned},
                                                  {"sweep", SplitMethod::kSweep}};
inline constexpr Choice<MissingFrames> kMissing[] = {
    {"fail", MissingFrames::kFail}, {"hold", MissingFrames::kHold}, {"skip", MissingFrames::kSkip}};
inline constexpr Choice<RefitOn> kRefitOn[] = {{"cpu", RefitOn::kCpu},
                                               {"vulkan", RefitOn::kVulkan}};
inline constexpr Choice<ProgressChoice> kProgress[] = {{"auto", ProgressChoice::kAuto},
                                                       {"plain", ProgressChoice::kPlain},
                                                       {"json", ProgressChoice::kJson},
                                                       {"off", ProgressChoice::kOff}};
inline constexpr Choice<AnswerForm> kAnswerForms[] = {{"text", AnswerForm::kText},
                                                      {"json", AnswerForm::kJson}};
inline constexpr Choice<morphray::Crossing> kCrossings[] = {{"each", morphray::Crossing::each},
                                                            {"owner", morphray::Crossing::owner}};
inline constexpr Choice<morphray::FillRule> kFillRules[] = {
    {"nonzero", morphray::FillRule::nonzero}, {"odd", morphray::FillRule::odd}};
inline constexpr Choice<Question> kQuestions[] = {{"inside", Question::kInside},
                                                  {"winding", Question::kWinding},
                                                  {"distance", Question::kDistance},
                                                  {"closest", Question::kClosest}};
inline constexpr Choice<bool> kCheckedDevices[] = {{"one", false}, {"all", true}};
inline constexpr Choice<Reference> kReferences[] = {
    {"auto", Reference::kAuto}, {"brute", Reference::kBrute}, {"cpu", Reference::kCpu}};

}  // namespace mray::app
