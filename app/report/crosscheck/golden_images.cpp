#include "app/report/crosscheck/golden_images.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <optional>
#include <stdexcept>

#include "app/files/json_file.h"
#include "app/report/crosscheck/crosscheck_json.h"
#include "app/report/json_parts.h"
#include "common/report/shell_text.h"
#include "common/text/message_text.h"
#include "common/text/number_text.h"

namespace mray::app {
namespace {

constexpr const char* kCommand = "crosscheck --bless";
constexpr std::uint64_t kMostBytes = 1 << 26;
constexpr std::uint64_t kMostRecordedSide = 65536;

/// The options that decide which image of a scene is traced; how the tree is built does not.
std::string view_text(const Options& given, const std::string& scene) {
    Options options = given;
    options.scene = scene;
    const std::vector<std::string> viewed = scene_view_arguments(options);
    std::vector<std::string> line;
    for (std::size_t i = 0; i + 1 < viewed.size(); i += 2)
        if (viewed[i] != "--build") line.insert(line.end(), {viewed[i], viewed[i + 1]});
    if (options.lenient) line.emplace_back("--lenient");
    return shell_line(line);
}

Json json_of(const ReferenceImage& image) {
    return {{"frame", image.frame},
            {"rays", image.rays},
            {"hits", image.hits},
            {"hits_hash", hash_text(image.hits_hash)},
            {"image_hash", hash_text(image.image_hash)}};
}

std::uint64_t hash_of(const JsonAt& json) {
    const std::string text(json.text());
    if (text.size() != 16 || text.find_first_not_of("0123456789abcdef") != std::string::npos)
        throw std::invalid_argument("has a hash that is not 16 hexadecimal digits");
    return std::stoull(text, nullptr, 16);
}

std::uint64_t count_of(const JsonAt& json, std::uint64_t most) {
    const std::optional<std::uint64_t> count = json.unsigned_integer();
    if (!count || *count > most) throw std::invalid_argument("has a number that is not a count");
    return *count;
}

ReferenceImage image_of(const JsonAt& json) {
    ReferenceImage image;
    image.frame = json.at("frame").number();
    image.rays = json.at("rays").text();
    image.hits = count_of(json.at("hits"), std::numeric_limits<std::uint64_t>::max());
    image.hits_hash = hash_of(json.at("hits_hash"));
    image.image_hash = hash_of(json.at("image_hash"));
    return image;
}

GoldenScene scene_of(const JsonAt& json) {
    GoldenScene scene;
    scene.scene = json.at("scene").text();
    scene.width = static_cast<std::uint32_t>(count_of(json.at("width"), kMostRecordedSide));
    scene.height = static_cast<std::uint32_t>(count_of(json.at("height"), kMostRecordedSide));
    scene.view = json.at("options").text();
    const JsonAt images = json.at("images");
    for (std::size_t i = 0; i < images.size(); ++i) scene.images.push_back(image_of(images[i]));
    return scene;
}

std::string difference_of(const ReferenceImage& actual, const ReferenceImage& expected) {
    std::string text;
    const auto add = [&text](const char* what, const std::string& is, const std::string& was) {
        if (is != was)
            text += fmt::format("{}{} {} instead of {}", text.empty() ? "" : ", ", what, is, was);
    };
    add("hits", fmt::format("{}", actual.hits), fmt::format("{}", expected.hits));
    add("hits hash", hash_text(actual.hits_hash), hash_text(expected.hits_hash));
    add("image hash", hash_text(actual.image_hash), hash_text(expected.image_hash));
    return text;
}

}  // namespace

ExpectedRow GoldenImages::compare(const Options& options, const ReferenceImage& image) const {
    ExpectedRow row{image.frame, image.rays, ""};
    const std::string view = view_text(options, options.scene);
    const auto scene = std::ranges::find_if(scenes, [&](const GoldenScene& s) {
        return s.scene == options.scene && s.width == options.view.width &&
               s.height == options.view.height && s.view == view;
    });
    if (scene == scenes.end()) {
        row.problem =
            fmt::format("{} has no image of {} of {}x{}{}", shown(file), shown(options.scene),
                        options.view.width, options.view.height,
                        view.empty() ? " without options of the view" : " with " + shown(view));
        return row;
    }
    const auto expected = std::ranges::find_if(scene->images, [&](const ReferenceImage& i) {
        return i.frame == image.frame && i.rays == image.rays;
    });
    row.problem = expected == scene->images.end() ? shown(file) + " has no such image"
                                                  : difference_of(image, *expected);
    return row;
}

std::string golden_text(const Options& options, const CheckRun& run) {
    Json json = head_of(kCommand);
    json["environment"] = environment_json(run.environment);
    json["scenes"] = Json::array();
    for (const CheckReport& report : run.scenes) {
        Json images = Json::array();
        for (const ReferenceImage& image : report.references) images.push_back(json_of(image));
        json["scenes"].push_back({{"scene", report.spec},
                                  {"triangles", report.head.triangles},
                                  {"vertices", report.head.vertices},
                                  {"width", report.head.width},
                                  {"height", report.head.height},
                                  {"options", view_text(options, report.spec)},
                                  {"images", images}});
    }
    return json_text(json);
}

GoldenImages read_golden(const std::string& file) {
    return read_json_file(file, kMostBytes, kCommand, [&](const JsonAt& json) {
        if (!is_report_of(kCommand, json)) throw std::invalid_argument("is another report");
        GoldenImages golden{file, {}};
        const JsonAt scenes = json.at("scenes");
        for (std::size_t i = 0; i < scenes.size(); ++i)
            golden.scenes.push_back(scene_of(scenes[i]));
        return golden;
    });
}

}  // namespace mray::app
