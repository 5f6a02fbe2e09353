#include "scenes/gltf/gltf_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <iterator>
#include <utility>

#include "common/base/errors.h"
#include "common/base/input_file.h"
#include "common/text/base64.h"
#include "common/text/text_parts.h"
#include "scenes/warning_count.h"

namespace mray::gltf {
namespace {

/// Parts of the bytes of a GLB file; `binary` has no data if there is no such chunk.
struct Glb {
    std::string_view json;
    std::string_view binary;
};

constexpr std::string_view kMagic = "glTF";
constexpr std::size_t kHeadSize = 12;
constexpr std::size_t kChunkHeadSize = 8;
constexpr std::uint32_t kVersion = 2;
constexpr std::uint32_t kJsonChunk = 0x4E4F534A;
constexpr std::uint32_t kBinaryChunk = 0x004E4942;

[[noreturn]] void refuse(const std::string& file, const std::string& what) {
    throw Error(ErrorKind::kBadInput, fmt::format("{}: {}", file, what));
}

std::uint32_t word_at(std::string_view bytes, std::size_t offset) {
    static_assert(std::endian::native == std::endian::little);
    std::uint32_t word = 0;
    std::memcpy(&word, bytes.data() + offset, sizeof word);
    return word;
}

/// Finds the chunks of a GLB file (version 2), of which those of unknown types are skipped.
Glb split_glb(std::string_view bytes, const std::string& file) {
    if (bytes.size() < kHeadSize) refuse(file, "ends within its head; is it complete?");
    const std::uint32_t version = word_at(bytes, 4);
    if (version != kVersion)
        refuse(file, fmt::format("byte 4: has version {}; only {} is known", version, kVersion));
    const std::uint32_t length = word_at(bytes, 8);
    if (length != bytes.size()) {
        refuse(file, fmt::format("byte 8: has {} bytes, but its head tells of {}; is it complete?",
                                 bytes.size(), length));
    }
    Glb glb;
    std::size_t chunk = 0;
    for (std::size_t at = kHeadSize; at < bytes.size(); ++chunk) {
        if (bytes.size() - at < kChunkHeadSize)
            refuse(file, fmt::format("byte {}: ends within the head of a chunk", at));
        const std::uint32_t size = word_at(bytes, at);
        const std::uint32_t type = word_at(bytes, at + 4);
        const std::size_t begin = at + kChunkHeadSize;
        if (size > bytes.size() - begin) {
            refuse(file, fmt::format("byte {}: a chunk of {} bytes, but {} follow", at, size,
                                     bytes.size() - begin));
        }
        if (chunk == 0 && type != kJsonChunk)
            refuse(file, fmt::format("byte {}: the first chunk is not JSON", at + 4));
        if (chunk == 0) glb.json = bytes.substr(begin, size);
        if (chunk == 1 && type == kBinaryChunk) glb.binary = bytes.substr(begin, size);
        at = begin + size;
    }
    if (chunk == 0) refuse(file, "byte 12: has no chunk of JSON");
    return glb;
}

constexpr std::string_view kFamiliesLeftOut[] = {"KHR_lights_",    "EXT_lights_",  "KHR_materials_",
                                                 "EXT_materials_", "KHR_texture_", "EXT_texture_"};

/// Whether triangles and their places do not depend on an extension, by its name alone.
bool may_be_left_out(std::string_view name) {
    return std::any_of(std::begin(kFamiliesLeftOut), std::end(kFamiliesLeftOut),
                       [&](std::string_view family) { return name.starts_with(family); });
}

bool is_letter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); }

/// The scheme of a URI, without its colon; empty if it has none.
std::string_view scheme_of(std::string_view uri) {
    const std::size_t colon = uri.find_first_of(":/?#");
    if (colon == std::string_view::npos || uri[colon] != ':' || colon == 0 || !is_letter(uri[0]))
        return {};
    return uri.substr(0, colon);
}

bool is_data(std::string_view uri) {
    const std::string_view scheme = scheme_of(uri);
    constexpr std::string_view kData = "data";
    return std::equal(scheme.begin(), scheme.end(), kData.begin(), kData.end(),
                      [](char a, char b) { return (a | 0x20) == b; });
}

std::optional<int> hex_digit(char c) {
    if (c >= '0' && c <= '9') return c - '0';
    if (c >= 'a' && c <= 'f') return c - 'a' + 10;
    if (c >= 'A' && c <= 'F') return c - 'A' + 10;
    return std::nullopt;
}

/// The text from `first` on.
std::string percent_decoded(const JsonAt& uri, std::size_t first = 0) {
    const std::string_view text = uri.text();
    std::string decoded;
    for (std::size_t i = first; i < text.size(); ++i) {
        if (text[i] != '%') {
            decoded += text[i];
            continue;
        }
        const auto high = i + 2 < text.size() ? hex_digit(text[i + 1]) : std::nullopt;
        const auto low = i + 2 < text.size() ? hex_digit(text[i + 2]) : std::nullopt;
        if (!high || !low) uri.fail("has a % without two hexadecimal digits");
        decoded += static_cast<char>(*high * 16 + *low);
        i += 2;
    }
    return decoded;
}

}  // namespace

std::optional<JsonAt> extension_of(const JsonAt& at, std::string_view name) {
    const auto extensions = at.find("extensions");
    return extensions ? extensions->find(std::string(name).c_str()) : std::nullopt;
}

std::optional<std::string> data_of_uri(const JsonAt& uri) {
    const std::string_view text = uri.text();
    if (!is_data(text)) return std::nullopt;
    constexpr std::string_view kBase64 = ";base64";
    const std::size_t comma = text.find(',');
    if (comma == std::string_view::npos || !text.substr(0, comma).ends_with(kBase64))
        uri.fail("is a data: URI that is not in base 64");
    std::optional<std::string> bytes = text.find('%', comma) == std::string_view::npos
                                           ? from_base64(text.substr(comma + 1))
                                           : from_base64(percent_decoded(uri, comma + 1));
    if (!bytes) uri.fail("has characters that are not base 64, or is cut");
    return bytes;
}

std::filesystem::path file_of_uri(const JsonAt& uri, const std::filesystem::path& scene_file) {
    const std::string name = percent_decoded(uri);
    for (const std::string_view text : {uri.text(), std::string_view(name)}) {
        if (scheme_of(text).empty()) continue;
        uri.fail(
            fmt::format("{} is not followed; put the file beside the scene and give its name "
                        "only",
                        quote(text)));
    }
    try {
        return side_file(scene_file, name);
    } catch (const Error& error) {
        if (error.kind() != ErrorKind::kBadInput) throw;
        const Warning at = as_warning(error, uri.file());
        uri.fail(at.place.empty() || at.place == uri.file() ? at.text : error.what());
    }
}

GltfFile::GltfFile(const std::filesystem::path& path, const WarnFunction& warn)
    : path_(path), name_(escape(path)) {
    bytes_ = read_input_file(path);
    std::string_view binary;
    if (bytes_.starts_with(kMagic)) {
        const Glb glb = split_glb(bytes_, name_);
        json_ = parse_json(glb.json, name_);
        binary = glb.binary;
        buffer_bytes_ = binary.size();
    } else {
        json_ = parse_json(bytes_, name_);
        bytes_ = {};
    }
    require_version();
    require_known_extensions(warn);
    read_buffers(binary, binary.data() == nullptr
                             ? 0
                             : static_cast<std::uint64_t>(binary.data() - bytes_.data()));
}

std::size_t GltfFile::count(const char* key) const {
    const std::optional<JsonAt> list = root().find(key);
    return list ? list->size() : 0;
}

JsonAt GltfFile::element(const char* key, std::size_t index) const { return root().at(key)[index]; }

bool GltfFile::uses_extension(std::string_view extension) const {
    const std::optional<JsonAt> used = root().find("extensionsUsed");
    for (std::size_t i = 0; used && i < used->size(); ++i)
        if ((*used)[i].text() == extension) return true;
    return false;
}

void GltfFile::require_version() const {
    const JsonAt asset = root().at("asset");
    const JsonAt version = asset.find("minVersion") ? asset.at("minVersion") : asset.at("version");
    const std::string_view text = version.text();
    if (text == "2.0" || (!asset.find("minVersion") && text.starts_with("2."))) return;
    version.fail(fmt::format("is {}; only glTF 2.0 is read, convert the file", quote(text)));
}

void GltfFile::require_known_extensions(const WarnFunction& warn) const {
    const std::optional<JsonAt> required = root().find("extensionsRequired");
    WarningCount left_out;
    for (std::size_t i = 0; required && i < required->size(); ++i) {
        const JsonAt extension = (*required)[i];
        const std::string_view name = extension.text();
        if (name == kQuantization || name == kTextureTransform) continue;
        if (!may_be_left_out(name)) {
            extension.fail(
                fmt::format("the extension {} is required, but not known; write the file "
                            "without it",
                            quote(extension.text())));
        }
        left_out.add([&] {
            return Warning{name_, fmt::format("{}: {} is required, but not read; left out",
                                              extension.path(), quote(extension.text()))};
        });
    }
    left_out.tell(warn);
}

void GltfFile::read_buffers(std::string_view binary_chunk, std::uint64_t chunk_offset) {
    const std::size_t buffer_count = count("buffers");
    for (std::size_t i = 0; i < buffer_count; ++i) {
        const JsonAt buffer = element("buffers", i);
        const JsonAt byte_length = buffer.at("byteLength");
        const std::uint64_t length = byte_length.count();
        Buffer content = read_buffer(buffer, i, binary_chunk, chunk_offset);
        if (length > content.bytes.size()) {
            byte_length.fail(fmt::format("is {}, but there are {} bytes; is the file complete?",
                                         length, content.bytes.size()));
        }
        content.bytes = content.bytes.substr(0, length);
        buffers_.push_back(std::move(content));
    }
}

Buffer GltfFile::read_buffer(const JsonAt& buffer, std::size_t index, std::string_view binary_chunk,
                             std::uint64_t chunk_offset) {
    const std::optional<JsonAt> uri = buffer.find("uri");
    const bool has_chunk = index == 0 && binary_chunk.data() != nullptr;
    if (!uri) {
        if (!has_chunk) buffer.fail("has no uri, and the file has no binary chunk for it");
        return {binary_chunk, path_, chunk_offset};
    }
    if (std::optional<std::string> data = data_of_uri(*uri)) {
        buffer_bytes_ += data->size();
        const auto content = std::make_shared<const std::string>(std::move(*data));
        return {.bytes = *content, .data = content};
    }
    const std::filesystem::path file = file_of_uri(*uri, path_);
    auto content = files_.find(file);
    if (content == files_.end()) {
        try {
            content = files_.emplace(file, read_input_file(file)).first;
        } catch (const Error& error) {
            if (error.kind() != ErrorKind::kBadInput) throw;
            uri->fail(error.what());
        }
        buffer_bytes_ += content->second.size();
    }
    return {content->second, file};
}

}  // namespace mray::gltf
