#include "app/cli/unused_options.h"

#include <fmt/format.h>

#include <algorithm>
#include <initializer_list>
#include <string_view>

#include "common/base/errors.h"
#include "common/text/message_text.h"

namespace mray::app {
namespace {

using morphray::Shading;

bool is_lit(const Options& o) {
    if (o.command != Command::kRender && o.command != Command::kView) return false;
    return o.shading.shading ? *o.shading.shading == Shading::lit : !o.rays_given;
}

bool has_normals(const Options& o) { return is_lit(o) || o.shading.shading == Shading::normal; }

/// Whether some image of the command traces such rays.
bool traces(const Options& o, std::uint32_t rays) {
    const bool takes_all = o.command == Command::kCrosscheck && !o.rays_given;
    return takes_all || is_lit(o) || o.view.rays == rays;
}

bool has_ao(const Options& o) { return traces(o, kRaysAo); }
bool has_light(const Options& o) { return traces(o, kRaysShadow); }

bool may_use_vulkan(const Options& o) {
    return o.backend.choice == BackendChoice::kAuto || o.backend.choice == BackendChoice::kVulkan ||
           o.tree.refit_on == RefitOn::kVulkan;
}

bool may_use_cpu(const Options& o) {
    return o.backend.choice != BackendChoice::kVulkan || o.tree.refit_on == RefitOn::kCpu;
}

bool compares_policies(const Options& o) {
    return !o.policies.empty() || o.tree.update.has_value();
}

bool updates_by_times(const Options& o) {
    return o.tree.has_policy(PolicyKind::kAuto) ||
           std::ranges::count(o.policies, PolicyKind::kAuto, &PolicySpec::kind) > 0;
}

bool has_scene(const Options& o) { return !o.scene.empty(); }
bool has_no_scene(const Options& o) { return o.scene.empty(); }
bool takes_fps(const Options& o) { return !o.time.empty() || has_seconds(o); }
bool describes_trees(const Options& o) { return o.tree_facts; }
bool takes_all_hits(const Options& o) { return o.all_hits; }
bool asks(const Options& o, Question question) {
    return std::ranges::count(o.questions, question) > 0;
}
bool asks_inside(const Options& o) {
    return asks(o, Question::kInside) || asks(o, Question::kDistance);
}
bool asks_distance(const Options& o) {
    return asks(o, Question::kClosest) || asks(o, Question::kDistance);
}

/// Options that have an effect only if `has_effect`, and why not otherwise.
struct Rule {
    std::initializer_list<Command> commands;
    std::initializer_list<const char*> options;
    bool (*has_effect)(const Options&);
    const char* reason;
};

constexpr auto kRender = Command::kRender;
constexpr auto kView = Command::kView;
constexpr auto kCrosscheck = Command::kCrosscheck;
constexpr auto kProbe = Command::kProbe;
constexpr auto kProfile = Command::kProfile;
constexpr auto kTrace = Command::kTrace;
constexpr auto kQuery = Command::kQuery;
constexpr auto kInfo = Command::kInfo;

const Rule kRules[] = {
    {{kInfo},
     {"--missing", "--allow-empty", "--lenient", "--frame", "--time", "--fps", "--animation",
      "--bvh", "--threads"},
     has_scene,
     "is about a scene; give one, too"},
    {{kRender, kView, kCrosscheck, kProbe, kProfile, kTrace, kQuery, kInfo},
     {"--fps"},
     takes_fps,
     "only glTF files have seconds; choose frames of other scenes by --time, or leave it out"},
    {{kInfo}, {"--formats"}, has_no_scene, "is about the program; leave the scene out"},
    {{kInfo}, {"--threads"}, describes_trees, "only --bvh builds trees"},
    {{kRender, kView},
     {"--flat"},
     has_normals,
     "only --shading lit and normal have smooth normals"},
    {{kRender, kView}, {"--ground"}, is_lit, "only --shading lit shows a ground"},
    {{kRender}, {"--exr"}, is_lit, "only --shading lit has linear colours"},
    {{kRender},
     {"--ao-samples", "--ao-distance"},
     has_ao,
     "only --shading lit and --rays ao trace ambient occlusion"},
    {{kRender}, {"--light"}, has_light, "only --shading lit and --rays shadow have a point light"},
    {{kCrosscheck, kProbe, kProfile},
     {"--ao-samples", "--ao-distance"},
     has_ao,
     "only --rays ao traces ambient occlusion"},
    {{kCrosscheck, kProbe, kProfile},
     {"--light"},
     has_light,
     "only --rays shadow has a point light"},
    {{kRender, kCrosscheck, kProbe, kProfile, kTrace, kQuery},
     {"--device", "--validate"},
     may_use_vulkan,
     "nothing runs on a Vulkan device; choose another --backend, or leave it out"},
    {{kRender, kCrosscheck, kProbe, kProfile, kTrace, kQuery},
     {"--simd"},
     may_use_cpu,
     "nothing is traced on the CPU; choose another --backend, or leave it out"},
    {{kTrace},
     {"--max-hits", "--crossing"},
     takes_all_hits,
     "is about all hits of a ray; give --all, too"},
    {{kQuery}, {"--rule"}, asks_inside, "only --ask inside and distance tell inside from outside"},
    {{kQuery}, {"--max-distance"}, asks_distance, "only --ask distance and closest have one"},
    {{kProfile}, {"--plot"}, compares_policies, "shows how policies compare; give --policies too"},
    {{kRender, kProbe, kProfile},
     {"--update-budget", "--deterministic-updates"},
     updates_by_times,
     "only the update policy auto has a budget and decides by times; choose it, or leave it out"},
};

}  // namespace

void check_unused_options(const Options& options) {
    for (const Rule& rule : kRules) {
        if (std::ranges::count(rule.commands, options.command) == 0) continue;
        for (const char* const option : rule.options) {
            if (!options.is_given(option) || rule.has_effect(options)) continue;
            throw Error(ErrorKind::kBadArgument, fmt::format("{}: {}", option, rule.reason));
        }
    }
}

}  // namespace mray::app
