#include "bench/options.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "bench/works/trace_work.h"
#include "common/base/errors.h"
#include "common/base/number_text.h"

namespace morphray::bench {
namespace {

[[noreturn]] void refuse(const std::string& option, const std::string& value,
                         const std::string& expected) {
    throw Error(ErrorKind::kBadArgument, fmt::format("{}{}{}: expected {}", option,
                                                     value.empty() ? "" : " ", value, expected));
}

std::vector<std::string> split_list(const std::string& text) {
    std::vector<std::string> parts(1);
    for (const char c : text) {
        if (c == ',') {
            parts.emplace_back();
        } else {
            parts.back().push_back(c);
        }
    }
    return parts;
}

int parse_count(const std::string& option, const std::string& text, int max) {
    const auto value = parse_integer(text);
    if (!value || *value < 1 || *value > max) {
        refuse(option, text, fmt::format("a whole number from 1 to {}", max));
    }
    return static_cast<int>(*value);
}

Point parse_point(const std::string& option, const std::string& text) {
    const std::vector<std::string> parts = split_list(text);
    Point point{};
    for (std::size_t i = 0; i < 3; ++i) {
        const auto value = i < parts.size() ? parse_finite_double(parts[i]) : std::nullopt;
        if (!value || parts.size() != 3) refuse(option, text, "X,Y,Z");
        point[i] = *value;
    }
    return point;
}

std::vector<std::string> parse_works(const std::string& option, const std::string& text) {
    std::vector<std::string> works = split_list(text);
    for (const std::string& work : works) {
        if (std::find(std::begin(kWorks), std::end(kWorks), work) == std::end(kWorks)) {
            refuse(option, text, fmt::format("some of {}", fmt::join(kWorks, ",")));
        }
    }
    return works;
}

std::vector<int> parse_threads(const std::string& option, const std::string& text) {
    std::vector<int> threads;
    for (const std::string& part : split_list(text)) {
        threads.push_back(parse_count(option, part, 1024));
    }
    return threads;
}

std::vector<SimdTarget> parse_targets(const std::string& text) {
    std::vector<SimdTarget> supported = supported_simd_targets();
    if (text == "all") return supported;
    std::vector<SimdTarget> asked;
    for (const std::string& name : split_list(text)) asked.push_back(find_simd_target(name));
    std::vector<SimdTarget> targets;
    for (const SimdTarget& target : supported) {
        if (std::find(asked.begin(), asked.end(), target) != asked.end()) targets.push_back(target);
    }
    return targets;
}

std::uint32_t parse_size(const std::string& option, const std::string& text) {
    const int size = parse_count(option, text, 16384);
    if (size % kTileSize != 0) refuse(option, text, fmt::format("a multiple of {}", kTileSize));
    return static_cast<std::uint32_t>(size);
}

ViewKind parse_view(const std::string& option, const std::string& text) {
    for (const ViewKind kind : {ViewKind::kFill, ViewKind::kWhole}) {
        if (text == name_of(kind)) return kind;
    }
    refuse(option, text, "fill or whole");
}

double parse_fov(const std::string& option, const std::string& text) {
    const auto value = parse_finite_double(text);
    if (!value || *value <= 0 || *value >= 180) refuse(option, text, "degrees above 0, below 180");
    return *value;
}

/// An option with a value.
struct Setting {
    const char* option;
    void (*set)(BenchOptions& options, const std::string& option, const std::string& value);
};

using Options = BenchOptions&;
using Text = const std::string&;
constexpr Setting kSettings[] = {
    {"--json", [](Options o, Text, Text value) { o.json = value; }},
    {"--csv", [](Options o, Text, Text value) { o.csv = value; }},
    {"--threads",
     [](Options o, Text option, Text value) { o.threads = parse_threads(option, value); }},
    {"--repeat",
     [](Options o, Text option, Text value) { o.repeat = parse_count(option, value, 10000); }},
    {"--work", [](Options o, Text option, Text value) { o.works = parse_works(option, value); }},
    {"--simd", [](Options o, Text, Text value) { o.targets = parse_targets(value); }},
    {"--embree", [](Options o, Text, Text value) { o.embree = value; }},
    {"--size", [](Options o, Text option,
                  Text value) { o.view.width = o.view.height = parse_size(option, value); }},
    {"--ao-samples",
     [](Options o, Text option, Text value) {
         o.view.ao_count = static_cast<std::uint32_t>(parse_count(option, value, 256));
     }},
    {"--view", [](Options o, Text option, Text value) { o.view_kind = parse_view(option, value); }},
    {"--eye", [](Options o, Text option, Text value) { o.view.eye = parse_point(option, value); }},
    {"--target",
     [](Options o, Text option, Text value) { o.view.target = parse_point(option, value); }},
    {"--fov", [](Options o, Text option, Text value) { o.view.fov = parse_fov(option, value); }},
    {"--light",
     [](Options o, Text option, Text value) { o.view.light = parse_point(option, value); }},
};

const Setting& find_setting(const std::string& option) {
    const auto found = std::find_if(std::begin(kSettings), std::end(kSettings),
                                    [&](const Setting& s) { return option == s.option; });
    if (found == std::end(kSettings)) {
        throw Error(ErrorKind::kBadArgument, fmt::format("{}: no such option; see --help", option));
    }
    return *found;
}

}  // namespace

bool BenchOptions::wants(const std::string& work) const {
    return std::find(works.begin(), works.end(), work) != works.end();
}

BenchOptions parse_options(std::span<const std::string> arguments) {
    BenchOptions options;
    bool own_scenes_only = false;
    std::optional<std::string> view;
    std::vector<std::string> scenes;
    for (std::size_t i = 0; i < arguments.size(); ++i) {
        const std::string& option = arguments[i];
        if (!option.starts_with("-")) {
            scenes.push_back(option);
        } else if (option == "-h" || option == "--help") {
            options.help = true;
        } else if (option == "--only") {
            own_scenes_only = true;
        } else {
            const Setting& setting = find_setting(option);
            if (++i == arguments.size()) refuse(option, "", "a value");
            setting.set(options, option, arguments[i]);
            if (option == "--view") view = arguments[i];
        }
    }
    if (options.view.eye || options.view.target) {
        if (view) refuse("--view", *view, "no --eye and no --target besides");
        options.view_kind = ViewKind::kGiven;
    }
    if (own_scenes_only) options.scenes.clear();
    options.scenes.insert(options.scenes.end(), scenes.begin(), scenes.end());
    if (options.scenes.empty()) refuse("--only", "", "a SCENE");
    return options;
}

std::string usage() {
    const BenchOptions defaults;
    return fmt::format(
        "usage: bench/run [OPTIONS] [SCENE...]\n"
        "Measures morphray side by side with Embree 3.13, on {},\n"
        "and each SCENE given (an .obj file, a folder or pattern of them, "
        "builtin:NAME[:TRIANGLES]).\n"
        "  --json FILE, --csv FILE   reports besides the table\n"
        "  --threads N,...           how many threads (1,2)\n"
        "  --repeat N                rounds, of which medians are taken ({})\n"
        "  --work WORK,...           {}\n"
        "                            ({})\n"
        "  --simd TARGET,...|all     instruction sets of our tracers (best); scalar adds the "
        "reference\n"
        "  --embree CONFIG           device settings for Embree, such as isa=avx2\n"
        "  --only                    the SCENEs given alone, not the built-in ones\n"
        "  --size N                  images of NxN pixels, a multiple of {} ({})\n"
        "  --ao-samples N            ambient-occlusion rays a pixel ({})\n"
        "  --view fill|whole         what fills the image: the scene, or all of the clip with "
        "what "
        "is around it (fill)\n"
        "  --eye, --target X,Y,Z     a view of your own instead, of every scene\n"
        "  --fov DEGREES             field of view; with --view fill, before it is narrowed (45)\n"
        "  --light X,Y,Z\n",
        fmt::join(defaults.scenes, ", "), defaults.repeat, fmt::join(kWorks, ","),
        fmt::join(defaults.works, ","), kTileSize, defaults.view.width, defaults.view.ao_count);
}

}  // namespace morphray::bench
