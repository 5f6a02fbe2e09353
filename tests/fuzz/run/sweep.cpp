#include "tests/fuzz/run/sweep.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>

#include "app/clip/frames.h"
#include "common/base/errors.h"
#include "cpu/cpu_backend.h"
#include "tests/fuzz/generate/generator.h"
#include "tests/fuzz/generate/views.h"
#include "tests/fuzz/run/campaign.h"
#include "tests/fuzz/shrink/report.h"

namespace mray::fuzz {
namespace {

constexpr double kAffordableTests = 4e6;

/// A point in the plane, or just off it.
dvec3 near_plane(Dice& dice, const Surroundings& around, const Surroundings::Corners& triangle) {
    constexpr int kFirst = 8;
    constexpr int kLast = 50;
    if (dice.one_in(3)) return place_in_plane(dice, triangle);
    return place_off_plane(dice, around, triangle, kFirst, kLast);
}

ViewSpec view_at(Dice& dice, const Surroundings& around, const Surroundings::Corners& triangle,
                 const FuzzOptions& options) {
    ViewSpec view;
    view.width = view.height = options.side;
    constexpr std::array kKinds = {kRaysPrimary, kRaysShadow, kRaysAo};
    view.rays = dice.pick(kKinds);
    view.ao_count = 2;
    const dvec3 eye = near_plane(dice, around, triangle);
    view.eye = to_point(eye);
    view.target = to_point(dice.one_in(3) ? eye + dice.direction() * around.extent
                                          : special_target(dice, around));
    view.up = to_point(dice.direction());
    view.fov = dice.one_in(2) ? dice.real(1, 20) : dice.real(20, 150);
    view.light = to_point(near_plane(dice, around, triangle));
    return view;
}

bool can_use_brute(const FuzzOptions& options, std::size_t triangles) {
    return static_cast<double>(triangles) * options.side * options.side <= kAffordableTests;
}

/// A scene's name, fit for the name of a folder.
std::string file_name_of(const std::string& scene) {
    std::string name = scene;
    for (char& c : name)
        if (std::isalnum(static_cast<unsigned char>(c)) == 0) c = '-';
    return name;
}

}  // namespace

FuzzCase open_sweep(const FuzzOptions& options) {
    ClipOptions scene_options;
    scene_options.lenient = true;
    scene_options.warn = [](const Warning&) {};
    const std::unique_ptr<Clip> clip = open_scene(options.scene, scene_options);
    app::require_in_clip("--frame", options.frame, *clip);
    FuzzCase scene_case;
    scene_case.triangles = clip->topology().triangles;
    scene_case.poses.emplace_back(clip->topology().vertex_count);
    clip->positions(options.frame, scene_case.poses.front());
    scene_case.view.width = scene_case.view.height = 0;
    return scene_case;
}

int run_sweep(const FuzzOptions& options, const FuzzCase& scene_case, const Process& process) {
    const Surroundings around(scene_case.poses.front(), scene_case.triangles);
    const auto reference = can_use_brute(options, scene_case.triangles.size())
                               ? cpu::make_brute_backend({.threads = 1})
                               : cpu::make_scalar_backend({.threads = 1});
    const Variants variants = process.vulkan ? vulkan_variants() : cpu_variants();
    const auto& group = variants.groups.front();
    Referee referee(*reference);
    referee.load(std::make_unique<FuzzScene>(scene_case), group);
    Progress progress(process);
    const std::uint64_t eyes = (around.triangles.size() + options.every - 1) / options.every;
    const std::uint64_t last = options.cases > 0 ? std::min(options.cases, eyes) : eyes;
    for (std::uint64_t eye = process.index; eye < last && !is_over(options, progress);
         eye += process.count) {
        const std::uint64_t triangle = eye * options.every;
        progress.begin(triangle);
        Dice dice(case_seed(options.seed, triangle));
        const ViewSpec view = view_at(dice, around, around.triangles[triangle], options);
        ++progress.tally.cases;
        std::vector<Finding> findings;
        try {
            findings = referee.compare_images(view, progress.tally);
        } catch (const Error& error) {
            if (error.kind() != ErrorKind::kBadInput) throw;
            ++progress.tally.refused;
        }
        if (findings.empty()) continue;
        ++progress.tally.failed_cases;
        FuzzCase fuzz_case = scene_case;
        fuzz_case.view = view;
        const std::string name = fmt::format("sweep-{}-{}-{}-{}", file_name_of(options.scene),
                                             process.name(), options.seed, triangle);
        report_failure({options.out, name, process.vulkan}, fuzz_case, findings.front(), referee);
        referee.load(std::make_unique<FuzzScene>(scene_case), group);
    }
    return progress.finish();
}

}  // namespace mray::fuzz
