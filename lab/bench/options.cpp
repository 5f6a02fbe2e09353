#include "lab/bench/options.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <map>

#include "common/base/errors.h"
#include "lab/bench/trace_work.h"

namespace mray::bench {
namespace {

const std::map<std::string, std::vector<std::string>> kSets = {
    {"default", {"builtin:spikes:70000", "builtin:cloth:180000", "builtin:herd:1000000"}},
    {"interiors", {"builtin:hall"}},
    {"hard", {"builtin:soup", "builtin:shuffle"}},
    {"all",
     {"builtin:spikes:70000", "builtin:cloth:180000", "builtin:herd:1000000", "builtin:hall",
      "builtin:soup", "builtin:shuffle"}}};
const std::vector<std::string> kWorks = {"primary", "shadow", "diffuse", "ao",   "one-ray",
                                         "refit",   "build",  "queries", "frame"};

/// The supported targets among those named, best first.
std::vector<SimdTarget> targets_named(const std::vector<std::string>& names) {
    std::vector<SimdTarget> targets = supported_simd_targets();
    if (names == std::vector<std::string>{"all"}) return targets;
    std::vector<SimdTarget> asked;
    for (const std::string& name : names) asked.push_back(find_simd_target(name));
    std::erase_if(targets, [&](const SimdTarget& target) {
        return std::find(asked.begin(), asked.end(), target) == asked.end();
    });
    return targets;
}

std::string check_size(const std::string& text) {
    const bool is_multiple = std::strtoul(text.c_str(), nullptr, 10) % kTileSize == 0;
    return is_multiple ? "" : fmt::format("{} is not a multiple of {}", text, kTileSize);
}

}  // namespace

bool BenchOptions::wants(const std::string& work) const {
    return std::find(works.begin(), works.end(), work) != works.end();
}

BenchOptions parse_options(std::span<const std::string> arguments) {
    BenchOptions o;
    std::vector<std::string> given;
    std::vector<std::string> targets = {"best"};
    std::string set = "default";
    std::string view = "fill";
    std::uint32_t size = o.view.width;
    bool is_only_given = false;
    CLI::App app("Measures morphray side by side with Embree on built-in scenes and each SCENE.",
                 "lab/bench/run");
    app.option_defaults()->always_capture_default();
    const auto list = [](CLI::Option* option) {
        return option->delimiter(',')->allow_extra_args(false);
    };
    app.add_option("SCENE", given,
                   "a mesh file, a folder or pattern of them, builtin:NAME[:TRIANGLES]");
    app.add_flag("--only", is_only_given, "measure the given scenes alone, not the built-in ones");
    app.add_option("--set", set, "which built-in scenes")->check(CLI::IsMember(&kSets));
    app.add_option("--csv", o.csv, "the rows as comma-separated values");
    list(app.add_option("--threads", o.threads, "how many threads"))->check(CLI::Range(1, 1024));
    app.add_option("--repeat", o.repeat, "rounds, of which medians and least times are taken")
        ->check(CLI::Range(1, 10000));
    list(app.add_option("--work", o.works, "what is measured"))->check(CLI::IsMember(kWorks));
    list(app.add_option("--ao-samples", o.ao_samples, "rays of a pixel in each work ao"))
        ->check(CLI::Range(1, 256));
    list(app.add_option("--simd", targets,
                        "instruction sets of our tracers, or all; scalar adds the reference"));
    app.add_option("--embree", o.embree,
                   "settings of Embree's device; isa=avx2 leaves out AVX-512");
    app.add_option("--size", size, "images of as many pixels a side")
        ->check(CLI::Range(1, 16384))
        ->check(check_size);
    app.add_option("--view", view,
                   "what fills the image: the scene, or the whole clip with its surroundings")
        ->check(CLI::IsMember({"fill", "whole"}));
    try {
        app.parse(std::vector<std::string>(arguments.rbegin(), arguments.rend()));
    } catch (const CLI::CallForHelp&) {
        o.help = app.help();
        return o;
    } catch (const CLI::ParseError& error) {
        throw Error(ErrorKind::kBadArgument, fmt::format("{}; see --help", error.what()));
    }
    if (!is_only_given) o.scenes = kSets.at(set);
    o.scenes.insert(o.scenes.end(), given.begin(), given.end());
    if (o.scenes.empty()) throw Error(ErrorKind::kBadArgument, "--only: expected a SCENE");
    o.targets = targets_named(targets);
    o.view_kind = view == "fill" ? ViewKind::kFill : ViewKind::kWhole;
    o.view.width = o.view.height = size;
    return o;
}

}  // namespace mray::bench
