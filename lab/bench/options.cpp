#include "lab/bench/options.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <functional>
#include <string_view>

#include "common/base/errors.h"
#include "common/text/number_text.h"
#include "common/text/text_parts.h"
#include "lab/bench/trace_work.h"

namespace mray::bench {
namespace {

[[noreturn]] void refuse(const std::string& option, std::string_view value,
                         const std::string& expected) {
    throw Error(ErrorKind::kBadArgument, fmt::format("{}{}{}: expected {}", option,
                                                     value.empty() ? "" : " ", value, expected));
}

int parse_up_to(int most, const std::string& option, std::string_view text) {
    const auto value = parse_unsigned(text);
    if (!value || *value < 1 || *value > static_cast<std::uint64_t>(most)) {
        refuse(option, text, fmt::format("a whole number from 1 to {}", most));
    }
    return static_cast<int>(*value);
}

std::vector<std::string> parse_works(const std::string& option, const std::string& text) {
    std::vector<std::string> works;
    for (const std::string_view work : split(text, ',')) {
        if (std::find(std::begin(kWorks), std::end(kWorks), work) == std::end(kWorks)) {
            refuse(option, text, fmt::format("some of {}", fmt::join(kWorks, ",")));
        }
        works.emplace_back(work);
    }
    return works;
}

std::vector<int> parse_threads(const std::string& option, const std::string& text) {
    std::vector<int> threads;
    for (const std::string_view part : split(text, ',')) {
        threads.push_back(parse_up_to(1024, option, part));
    }
    return threads;
}

std::vector<std::uint32_t> parse_samples(const std::string& option, const std::string& text) {
    std::vector<std::uint32_t> samples;
    for (const std::string_view part : split(text, ','))
        samples.push_back(static_cast<std::uint32_t>(parse_up_to(256, option, part)));
    return samples;
}

std::vector<std::string> parse_set(const std::string& option, const std::string& text) {
    std::vector<std::string> names;
    for (const SceneSet& set : scene_sets()) {
        if (text == set.name) return set.scenes;
        names.emplace_back(set.name);
    }
    refuse(option, text, fmt::format("one of {}", fmt::join(names, ", ")));
}

std::vector<SimdTarget> parse_targets(const std::string& text) {
    std::vector<SimdTarget> supported = supported_simd_targets();
    if (text == "all") return supported;
    std::vector<SimdTarget> asked;
    for (const std::string_view name : split(text, ',')) {
        asked.push_back(find_simd_target(std::string(name)));
    }
    std::vector<SimdTarget> targets;
    for (const SimdTarget& target : supported) {
        if (std::find(asked.begin(), asked.end(), target) != asked.end()) targets.push_back(target);
    }
    return targets;
}

std::uint32_t parse_size(const std::string& option, const std::string& text) {
    const int size = parse_up_to(16384, option, text);
    if (size % kTileSize != 0) refuse(option, text, fmt::format("a multiple of {}", kTileSize));
    return static_cast<std::uint32_t>(size);
}

ViewKind parse_view(const std::string& option, const std::string& text) {
    for (const ViewKind kind : {ViewKind::kFill, ViewKind::kWhole}) {
        if (text == name_of(kind)) return kind;
    }
    refuse(option, text, "fill or whole");
}

/// The options, each of which writes into one BenchOptions.
class BenchParser {
public:
    BenchParser()
        : app_(fmt::format("Measures morphray side by side with Embree on {} (or another "
                           "--set), and on each SCENE given.",
                           fmt::join(options_.scenes, ", ")),
               "lab/bench/run") {
        app_.add_option("SCENE", given_scenes_,
                        "an .obj file, a folder or pattern of them, builtin:NAME[:TRIANGLES]")
            ->type_name("");
        app_.add_flag("--only", only_given_,
                      "measure the given scenes alone, not the built-in ones");
        add("--set", "NAME", sets_help(),
            [this](auto& option, auto& value) { options_.scenes = parse_set(option, value); });
        add_outputs();
        add_works();
        add_view();
    }

    BenchOptions parse(std::span<const std::string> arguments) {
        try {
            app_.parse(std::vector<std::string>(arguments.rbegin(), arguments.rend()));
        } catch (const CLI::CallForHelp&) {
            options_.help = true;
            return options_;
        } catch (const CLI::ParseError& error) {
            explain(error, arguments);
        }
        if (only_given_) options_.scenes.clear();
        options_.scenes.insert(options_.scenes.end(), given_scenes_.begin(), given_scenes_.end());
        if (options_.scenes.empty()) refuse("--only", "", "a SCENE");
        return options_;
    }

    std::string help() const { return app_.help(); }

private:
    using Setter = std::function<void(const std::string& option, const std::string& value)>;

    /// Adds an option. If it is given several times, the last value counts.
    void add(const std::string& name, const char* type, const std::string& help, Setter set) {
        app_.add_option_function<std::string>(
                name, [name, set = std::move(set)](const std::string& value) { set(name, value); },
                help)
            ->type_name(type)
            ->take_last();
    }

    static std::string sets_help() {
        std::string text = "which built-in scenes:";
        for (const SceneSet& set : scene_sets())
            text += fmt::format("\n{}: {}", set.name, fmt::join(set.scenes, " "));
        return text;
    }

    void add_outputs() {
        BenchOptions& o = options_;
        add("--csv", "FILE", "the rows as comma-separated values",
            [&o](auto&, auto& value) { o.csv = value; });
    }

    void add_works() {
        BenchOptions& o = options_;
        add("--threads", "N,...", "how many threads (1,2)",
            [&o](auto& option, auto& value) { o.threads = parse_threads(option, value); });
        add("--repeat", "N",
            fmt::format("rounds, of which medians and least times are taken ({})", o.repeat),
            [&o](auto& option, auto& value) { o.repeat = parse_up_to(10000, option, value); });
        add("--work", "WORK,...",
            fmt::format("{} ({})", fmt::join(kWorks, ","), fmt::join(o.works, ",")),
            [&o](auto& option, auto& value) { o.works = parse_works(option, value); });
        add("--ao-samples", "N,...",
            fmt::format("rays of a pixel in the work ao, each a work of its own ({})",
                        fmt::join(o.ao_samples, ",")),
            [&o](auto& option, auto& value) {
                o.ao_samples = parse_samples(option, value);
                o.view.ao_count = o.ao_samples.front();
            });
        add("--simd", "TARGET,...|all",
            "instruction sets of morphray's tracers (best); scalar adds the reference",
            [&o](auto&, auto& value) { o.targets = parse_targets(value); });
        add("--embree", "CONFIG",
            "device settings for Embree; isa=avx2 leaves out AVX-512, which is tried as well",
            [&o](auto&, auto& value) { o.embree = value; });
    }

    void add_view() {
        ViewSpec& view = options_.view;
        add("--size", "N",
            fmt::format("images of NxN pixels, a multiple of {} ({})", kTileSize, view.width),
            [&view](auto& option, auto& value) {
                view.width = view.height = parse_size(option, value);
            });
        add("--view", "fill|whole",
            "what fills the image: the scene, or the whole clip with its surroundings (fill)",
            [this](auto& option, auto& value) { options_.view_kind = parse_view(option, value); });
    }

    [[noreturn]] void explain(const CLI::ParseError& error,
                              std::span<const std::string> arguments) const {
        for (const std::string& extra : app_.remaining()) {
            if (!extra.starts_with('-')) continue;
            throw Error(ErrorKind::kBadArgument,
                        fmt::format("{}: no such option; see --help", extra));
        }
        const std::string& last = arguments.back();
        if (app_.get_option_no_throw(last) != nullptr) refuse(last, "", "a value");
        throw Error(ErrorKind::kBadArgument, fmt::format("{}; see --help", error.what()));
    }

    BenchOptions options_;
    std::vector<std::string> given_scenes_;
    bool only_given_ = false;
    CLI::App app_;
};

}  // namespace

std::vector<SceneSet> scene_sets() {
    std::vector<SceneSet> sets = {
        {"default", {"builtin:spikes:70000", "builtin:cloth:180000", "builtin:herd:1000000"}},
        {"interiors", {"builtin:hall"}},
        {"hard", {"builtin:soup", "builtin:shuffle"}}};
    std::vector<std::string> all;
    for (const SceneSet& set : sets) all.insert(all.end(), set.scenes.begin(), set.scenes.end());
    sets.push_back({"all", std::move(all)});
    return sets;
}

bool BenchOptions::wants(const std::string& work) const {
    return std::find(works.begin(), works.end(), work) != works.end();
}

BenchOptions parse_options(std::span<const std::string> arguments) {
    return BenchParser().parse(arguments);
}

std::string usage() { return BenchParser().help(); }

}  // namespace mray::bench
