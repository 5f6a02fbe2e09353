// Options that take one of a few names.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>

#include "app/base/options.h"
#include "common/base/errors.h"
#include "common/text/text.h"

namespace mray::app {

template <class T>
struct Choice {
    const char* name;
    T value;
};

template <class T>
std::string names_of(std::span<const Choice<T>> choices) {
    std::string names;
    for (const Choice<T>& choice : choices) {
        if (!names.empty()) names += '|';
        names += choice.name;
    }
    return names;
}

template <class T>
std::string name_in(std::type_identity_t<std::span<const Choice<T>>> choices, T value) {
    return std::ranges::find(choices, value, &Choice<T>::value)->name;
}

/// The value of the name; throws Error(kBadArgument) for any other text.
template <class T>
T value_in(std::type_identity_t<std::span<const Choice<T>>> choices, std::string_view text) {
    const auto found = std::ranges::find(choices, text, &Choice<T>::name);
    if (found == choices.end())
        throw Error(ErrorKind::kBadArgument, "{} is not one of {}", quote(text),
                    names_of<T>(choices));
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
inline constexpr Choice<morphray::Shading> kShadings[] = {
    {"lit", morphray::Shading::lit},       {"plain", morphray::Shading::plain},
    {"normal", morphray::Shading::normal}, {"depth", morphray::Shading::depth},
    {"prim", morphray::Shading::prim},     {"steps", morphray::Shading::steps},
    {"sah", morphray::Shading::sah}};
inline constexpr Choice<std::uint32_t> kSampleCounts[] = {
    {"1", 1}, {"4", 4}, {"16", 16}, {"64", 64}};
inline constexpr Choice<bool> kOnOff[] = {{"on", true}, {"off", false}};
inline constexpr Choice<const char*> kExrColours[] = {{"half", "half"}, {"float", "float"}};
inline constexpr Choice<morphray::Crossing> kCrossings[] = {{"once", morphray::Crossing::once},
                                                            {"each", morphray::Crossing::each},
                                                            {"owner", morphray::Crossing::owner}};
inline constexpr Choice<morphray::FillRule> kFillRules[] = {
    {"nonzero", morphray::FillRule::nonzero}, {"odd", morphray::FillRule::odd}};
inline constexpr Choice<PointQuery> kPointQueries[] = {{"inside", PointQuery::kInside},
                                                       {"winding", PointQuery::kWinding},
                                                       {"distance", PointQuery::kDistance},
                                                       {"closest", PointQuery::kClosest}};
inline constexpr Choice<Reference> kReferences[] = {
    {"auto", Reference::kAuto}, {"brute", Reference::kBrute}, {"cpu", Reference::kCpu}};

}  // namespace mray::app
