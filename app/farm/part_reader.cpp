#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <optional>

#include "app/farm/part.h"
#include "app/files/json_file.h"

namespace mray::app {
namespace {

constexpr const char* kCommand = "morphray render --shard";
// A part has objects in arrays in objects in an array; a frame some twenty values.
constexpr int kMaxDepth = 6;
constexpr std::size_t kMaxValues = 2'000'000;
constexpr std::size_t kMaxText = 65536;

[[noreturn]] void refuse(const std::string& what) { throw std::invalid_argument(what); }

/// Ends the parse of a file that has more in it than a part may have, before it takes memory.
void require_within_limits(const JsonProgress& parsed) {
    if (parsed.depth > kMaxDepth) refuse("is nested too deeply");
    if (parsed.values > kMaxValues) refuse("has more than two million values");
    if (parsed.text_bytes > kMaxText) refuse("has a text of more than 64 KiB");
}

JsonAt member(const JsonAt& json, const char* name) {
    const std::optional<JsonAt> found = json.is_object() ? json.find(name) : std::nullopt;
    if (!found) refuse(fmt::format("lacks the member {}", name));
    return *found;
}

std::string text_of(const JsonAt& json, const char* name) {
    const JsonAt value = member(json, name);
    if (!value.is_text()) refuse(fmt::format("{} is not a text", name));
    return std::string(value.text());
}

double number_of(const JsonAt& value, const char* name) {
    if (!value.is_number()) refuse(fmt::format("{} is not a number", name));
    const double number = value.number();
    if (!std::isfinite(number)) refuse(fmt::format("{} is not a finite number", name));
    return number;
}

std::uint64_t count_of(const JsonAt& json, const char* name, std::uint64_t least,
                       std::uint64_t most) {
    const std::optional<std::uint64_t> count = member(json, name).unsigned_integer();
    if (!count) refuse(fmt::format("{} is not a whole number", name));
    if (*count < least || *count > most)
        refuse(fmt::format("{} is not from {} to {}", name, least, most));
    return *count;
}

std::uint64_t hash_of(const JsonAt& json, const char* name) {
    const std::string text = text_of(json, name);
    constexpr std::size_t kDigits = 16;
    if (text.size() != kDigits || text.find_first_not_of("0123456789abcdef") != text.npos)
        refuse(fmt::format("{} is not a hash of 16 digits", name));
    return std::stoull(text, nullptr, 16);
}

std::vector<double> frames_of(const JsonAt& json, const char* name) {
    const JsonAt values = member(json, name);
    if (!values.is_array()) refuse(fmt::format("{} is not a list", name));
    std::vector<double> frames;
    for (std::size_t i = 0; i < values.size(); ++i) {
        frames.push_back(number_of(values[i], name));
        if (i > 0 && !(frames[i - 1] < frames[i])) refuse(fmt::format("{} is not in order", name));
    }
    return frames;
}

/// The name of a file in the folder of the part or below.
std::string file_of(const JsonAt& json, bool may_be_outside) {
    const std::string text = text_of(json, "file");
    const std::filesystem::path path(text);
    bool is_outside = path.empty() || path.is_absolute() || text.find('\0') != text.npos;
    for (const auto& name : path) is_outside |= name == ".." && !may_be_outside;
    if (is_outside) refuse("file is not in the folder of the part");
    return text;
}

PartImage image_of(const JsonAt& json) {
    PartImage image;
    image.frame = number_of(member(json, "frame"), "frame");
    image.file = file_of(json, false);
    image.scene_hash = hash_of(json, "scene_hash");
    image.hits_hash = hash_of(json, "hits_hash");
    image.image_hash = hash_of(json, "image_hash");
    const JsonAt outputs = member(json, "outputs");
    if (!outputs.is_array()) refuse("outputs is not a list");
    for (std::size_t i = 0; i < outputs.size(); ++i)
        image.outputs.push_back({file_of(outputs[i], true), hash_of(outputs[i], "hash")});
    const JsonAt kept = member(json, "kept");
    if (!kept.is_boolean()) refuse("kept is neither true nor false");
    image.is_kept = kept.boolean();
    image.host = text_of(json, "host");
    image.backend = text_of(json, "backend");
    image.device = text_of(json, "device");
    image.total_ms = number_of(member(json, "total_ms"), "total_ms");
    return image;
}

std::vector<PartImage> images_of(const JsonAt& json, const char* name) {
    const JsonAt values = member(json, name);
    if (!values.is_array()) refuse(fmt::format("{} is not a list", name));
    std::vector<PartImage> images;
    for (std::size_t i = 0; i < values.size(); ++i) images.push_back(image_of(values[i]));
    return images;
}

PartState state_of(const JsonAt& json) {
    const std::string text = text_of(json, "state");
    for (const PartState state : {PartState::kRunning, PartState::kDone, PartState::kPartial,
                                  PartState::kInterrupted, PartState::kFailed}) {
        if (text == name_of(state)) return state;
    }
    refuse("state has an unknown name");
}

Part part_of(const JsonAt& json) {
    if (!json.is_object()) refuse("is not an object");
    if (text_of(json, "schema") != "morphray/1") refuse("has another schema than morphray/1");
    constexpr std::uint64_t kAny = std::numeric_limits<std::uint64_t>::max();
    constexpr std::uint64_t kMaxSide = 65536;
    Part part;
    part.shard.count = static_cast<std::uint32_t>(count_of(json, "parts", 1, kMaxShards));
    part.shard.index = static_cast<std::uint32_t>(count_of(json, "part", 1, part.shard.count));
    PartRender& render = part.render;
    render.software = text_of(json, "software");
    render.source = text_of(json, "source");
    render.scene = text_of(json, "scene");
    render.triangles = count_of(json, "triangles", 0, kAny);
    render.vertices = count_of(json, "vertices", 0, kAny);
    render.width = static_cast<std::uint32_t>(count_of(json, "width", 1, kMaxSide));
    render.height = static_cast<std::uint32_t>(count_of(json, "height", 1, kMaxSide));
    render.scene_hash = hash_of(json, "scene_hash");
    render.verify_every = static_cast<std::uint32_t>(count_of(json, "verify_every", 0, 1'000'000));
    render.frames = frames_of(json, "all_frames");
    part.state = state_of(json);
    if (!member(json, "exit_code").is_null())
        part.exit_code = static_cast<int>(count_of(json, "exit_code", 0, 255));
    part.reason = text_of(json, "reason");
    part.host = text_of(json, "host");
    part.backend = text_of(json, "backend");
    part.device = text_of(json, "device");
    part.images = images_of(json, "frames");
    part.checks = images_of(json, "checks");
    part.frames_left = frames_of(json, "frames_left");
    part.checks_left = frames_of(json, "checks_left");
    return part;
}

}  // namespace

Part read_part(const std::filesystem::path& file) {
    const std::string text = read_input_file(file, kMaxPartBytes);
    try {
        const JsonTree tree = parse_json(text, require_within_limits);
        Part part = part_of(JsonAt(tree, file.native()));
        part.folder = file.parent_path();
        return part;
    } catch (const JsonSyntaxError& error) {
        refuse_json(line_of(file.native(), text, error.byte()), error.what(), kCommand);
    } catch (const JsonValueError&) {
        refuse_json(shown(file), "has a value that cannot be read", kCommand);
    } catch (const std::invalid_argument& error) {
        refuse_json(shown(file), error.what(), kCommand);
    }
}

}  // namespace mray::app
