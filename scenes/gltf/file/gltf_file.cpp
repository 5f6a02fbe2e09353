#include "scenes/gltf/file/gltf_file.h"

#include <fmt/format.h>

#include <utility>

#include "common/base/input_file.h"
#include "common/text/message_text.h"
#include "scenes/gltf/file/extensions.h"
#include "scenes/gltf/file/glb.h"
#include "scenes/gltf/file/uri.h"
#include "scenes/warning_count.h"

namespace mray::gltf {
namespace {

// Bytes of content that each byte of a buffer allows.
constexpr std::uint64_t kBudgetPerByte = 16;

/// Whether a buffer has what readers want that cannot decompress its views.
bool is_fallback(const JsonAt& buffer) {
    const auto meshopt = extension_of(buffer, kMeshopt);
    const auto fallback = meshopt ? meshopt->find("fallback") : std::nullopt;
    return fallback && fallback->boolean();
}

}  // namespace

GltfFile::GltfFile(const std::filesystem::path& path, ContentBudget& budget,
                   const WarnFunction& warn)
    : path_(path), name_(shown(path)) {
    bytes_ = read_input_file(path);
    std::string_view binary;
    if (is_glb(bytes_)) {
        const Glb glb = split_glb(bytes_, name_);
        json_ = parse_json(glb.json, name_, budget);
        binary = glb.binary;
        buffer_bytes_ = binary.size();
    } else {
        json_ = parse_json(bytes_, name_, budget);
        bytes_ = {};
    }
    require_version();
    require_known_extensions(warn);
    read_buffers(binary, binary.data() == nullptr
                             ? 0
                             : static_cast<std::uint64_t>(binary.data() - bytes_.data()));
    budget.add(kBudgetPerByte * buffer_bytes_);
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
    version.fail(fmt::format("is {}; only glTF 2.0 is read, convert the file", in_quotes(text)));
}

void GltfFile::require_known_extensions(const WarnFunction& warn) const {
    const std::optional<JsonAt> required = root().find("extensionsRequired");
    WarningCount left_out;
    for (std::size_t i = 0; required && i < required->size(); ++i) {
        const JsonAt extension = (*required)[i];
        const ExtensionUse use = use_of_extension(extension.text());
        if (use == ExtensionUse::kUnknown) {
            extension.fail(
                fmt::format("the extension {} is required, but not known; write the file "
                            "without it",
                            in_quotes(extension.text())));
        }
        if (use == ExtensionUse::kRead) continue;
        left_out.add([&] {
            return Warning{name_, fmt::format("{}: {} is required, but not read; left out",
                                              extension.path(), in_quotes(extension.text()))};
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
        if (content.is_placeholder) {
            buffers_.push_back(std::move(content));
            continue;
        }
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
    if (is_fallback(buffer) || (!uri && !has_chunk && uses_extension(kMeshopt)))
        return {.bytes = {}, .is_placeholder = true};
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
