#include "scenes/gltf/gltf_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <charconv>
#include <cstring>
#include <iterator>
#include <limits>
#include <tuple>
#include <type_traits>

#include "common/base/input_file.h"
#include "common/text/text.h"
#include "scenes/mesh/mesh_file.h"

namespace mray::gltf {
namespace {

constexpr std::string_view kMagic = "glTF";
constexpr std::size_t kHeadSize = 12;
constexpr std::size_t kChunkHeadSize = 8;
constexpr std::uint32_t kVersion = 2;
constexpr std::uint32_t kJsonChunk = 0x4E4F534A;
constexpr std::uint32_t kBinaryChunk = 0x004E4942;

/// Parts of the bytes of a GLB file; `binary` has no data if there is no such chunk.
struct Glb {
    std::string_view json, binary;
};

[[noreturn]] void refuse(const std::string& file, std::size_t byte, const std::string& what) {
    throw Error(ErrorKind::kBadInput, "{}: byte {}: {}", file, byte, what);
}

std::uint32_t word_at(std::string_view bytes, std::size_t offset) {
    static_assert(std::endian::native == std::endian::little);
    std::uint32_t word = 0;
    std::memcpy(&word, bytes.data() + offset, sizeof word);
    return word;
}

/// Finds the chunks of a GLB file (version 2). Chunks of unknown types are skipped.
Glb split_glb(std::string_view bytes, const std::string& file) {
    constexpr const char* kCut = "ends within a head; is it complete?";
    if (bytes.size() < kHeadSize) refuse(file, bytes.size(), kCut);
    const std::uint32_t version = word_at(bytes, 4);
    if (version != kVersion)
        refuse(file, 4, fmt::format("has version {}; only {} is known", version, kVersion));
    const std::uint32_t length = word_at(bytes, 8);
    if (length != bytes.size()) {
        refuse(file, 8,
               fmt::format("has {} bytes, but its head tells of {}; is it complete?", bytes.size(),
                           length));
    }
    Glb glb;
    std::size_t chunk = 0;
    std::size_t at = kHeadSize;
    do {
        if (bytes.size() - at < kChunkHeadSize) refuse(file, at, kCut);
        const std::uint32_t size = word_at(bytes, at);
        const std::uint32_t type = word_at(bytes, at + 4);
        const std::string_view rest = bytes.substr(at + kChunkHeadSize);
        if (size > rest.size())
            refuse(file, at, fmt::format("a chunk of {} bytes, but {} follow", size, rest.size()));
        if (chunk == 0 && type != kJsonChunk) refuse(file, at + 4, "the first chunk is not JSON");
        if (chunk == 0) glb.json = rest.substr(0, size);
        if (chunk == 1 && type == kBinaryChunk) glb.binary = rest.substr(0, size);
        at += kChunkHeadSize + size;
        ++chunk;
    } while (at < bytes.size());
    return glb;
}

// Triangles and their places do not depend on extensions whose names begin so.
constexpr std::string_view kFamiliesLeftOut[] = {"KHR_lights_",    "EXT_lights_",  "KHR_materials_",
                                                 "EXT_materials_", "KHR_texture_", "EXT_texture_"};

// Extensions that change shapes, but need not be required.
constexpr std::string_view kShapesLeftOut[] = {
    "KHR_animation_pointer", "KHR_draco_mesh_compression", "EXT_meshopt_compression",
    "KHR_meshopt_compression", "KHR_node_visibility"};

/// Refuses a URI because of the error that is being handled.
[[noreturn]] void refuse_uri(const JsonAt& uri, const Error& error) {
    if (error.kind() != ErrorKind::kBadInput) throw;
    uri.fail(as_warning(error, uri.file()).text);
}

std::string percent_decoded(const JsonAt& uri, std::size_t first = 0) {
    const std::string_view text = uri.text();
    std::string decoded;
    for (std::size_t i = first;;) {
        const std::size_t percent = text.find('%', i);
        decoded += text.substr(i, percent - i);
        if (percent == std::string_view::npos) return decoded;
        const std::string_view digits = text.substr(percent + 1, 2);
        std::uint8_t byte = 0;
        const char* const end = digits.data() + digits.size();
        if (digits.size() < 2 || std::from_chars(digits.data(), end, byte, 16).ptr != end)
            uri.fail("has a % without two hexadecimal digits");
        decoded += static_cast<char>(byte);
        i = percent + 3;
    }
}

constexpr std::uint64_t kMaxElements = 0xFFFFFFFEu;

struct Component;

/// A part of a buffer view. Empty bytes stand for zeros.
struct PackedArray {
    std::string_view bytes;
    std::size_t stride = 0;
    const Component* component = nullptr;
};

template <class Number>
using ReadArray = void (*)(const PackedArray& array, std::size_t width, bool normalized,
                           std::vector<Number>& out);

/// A type of components, and how arrays of it are read.
struct Component {
    /// Its number in the file.
    std::uint64_t id;
    std::size_t size;
    bool is_float, is_unsigned;
    std::tuple<ReadArray<float>, ReadArray<std::uint32_t>> read;
};

template <class T, class Number>
void read_array(const PackedArray& array, std::size_t width, bool normalized,
                std::vector<Number>& out) {
    for (std::size_t i = 0; i * width < out.size(); ++i) {
        const char* const element = array.bytes.data() + i * array.stride;
        for (std::size_t k = 0; k < width; ++k) {
            T value;
            std::memcpy(&value, element + k * sizeof value, sizeof value);
            Number& number = out[i * width + k];
            number = static_cast<Number>(value);
            if constexpr (std::is_same_v<Number, float> && std::is_integral_v<T>)
                if (normalized)
                    number =
                        std::max(number / static_cast<float>(std::numeric_limits<T>::max()), -1.0f);
        }
    }
}

template <class T>
constexpr Component component_with(std::uint64_t id) {
    return {id,
            sizeof(T),
            std::is_floating_point_v<T>,
            std::is_unsigned_v<T>,
            {read_array<T, float>, read_array<T, std::uint32_t>}};
}

constexpr Component kComponents[] = {
    component_with<std::int8_t>(5120),   component_with<std::uint8_t>(5121),
    component_with<std::int16_t>(5122),  component_with<std::uint16_t>(5123),
    component_with<std::uint32_t>(5125), component_with<float>(5126)};

/// An accessor whose members have been checked against each other, its buffer view and its buffer.
struct Accessor {
    JsonAt at;
    std::size_t count = 0;
    std::size_t width = 1;
    bool normalized = false;
    PackedArray base = {};
    /// Elements that replace those of `base`, and their indices.
    std::size_t sparse_count = 0;
    PackedArray sparse_indices = {};
    PackedArray sparse_values = {};
};

constexpr std::pair<std::string_view, std::size_t> kTypes[] = {
    {"SCALAR", 1}, {"VEC2", 2}, {"VEC3", 3}, {"VEC4", 4}, {"MAT2", 4}, {"MAT3", 9}, {"MAT4", 16}};

const Component& component_of(const JsonAt& at) {
    const auto* const found = std::ranges::find(kComponents, at.count(), &Component::id);
    if (found == std::end(kComponents))
        at.fail("is {}; must be 5120, 5121, 5122, 5123, 5125 or 5126", at.count());
    return *found;
}

std::size_t width_of(const JsonAt& at) {
    for (const auto& [name, width] : kTypes)
        if (at.text() == name) return width;
    at.fail("is {}; must be SCALAR, VEC2, VEC3, VEC4, MAT2, MAT3 or MAT4", quote(at.text()));
}

template <class Number>
void read(const PackedArray& array, std::size_t width, bool normalized, std::vector<Number>& out) {
    std::get<ReadArray<Number>>(array.component->read)(array, width, normalized, out);
}

/// The elements of the buffer view that `owner` refers to.
PackedArray packed(const GltfFile& file, const JsonAt& owner, const Component& component,
                   std::size_t width, std::size_t count, bool may_have_stride) {
    const View view = file.view(owner.at("bufferView"));
    const std::uint64_t offset = owner.count_or("byteOffset", 0);
    const std::size_t element = width * component.size;
    std::uint64_t stride = element;
    if (const std::optional<JsonAt> given = view.at.find("byteStride"); given && may_have_stride) {
        stride = given->count();
        if (stride < element || stride > 252)
            given->fail("is {}; elements have {} bytes", stride, element);
    }
    // count < 2^32 and stride <= 252, so that nothing overflows.
    const std::uint64_t needed = stride * (count - 1) + element;
    if (needed > view.bytes.size() || offset > view.bytes.size() - needed) {
        owner.fail("bytes {} to {} are not in {}, which has {}", offset, offset + needed,
                   view.at.path(), view.bytes.size());
    }
    return {view.bytes.substr(offset, needed), stride, &component};
}

void open_sparse(const GltfFile& file, const JsonAt& sparse, Accessor& accessor) {
    const std::uint64_t count = sparse.at("count").count();
    if (count == 0 || count > accessor.count)
        sparse.at("count").fail("is {}; must be from 1 to {}", count, accessor.count);
    accessor.sparse_count = count;
    const JsonAt indices = sparse.at("indices");
    const Component& index_component = component_of(indices.at("componentType"));
    if (!index_component.is_unsigned)
        indices.at("componentType").fail("must be 5121, 5123 or 5125 here");
    accessor.sparse_indices = packed(file, indices, index_component, 1, count, false);
    accessor.sparse_values =
        packed(file, sparse.at("values"), *accessor.base.component, accessor.width, count, false);
}

template <class Number>
std::vector<Number> read_all(const Accessor& accessor) {
    const std::size_t width = accessor.width;
    std::vector<Number> values(accessor.count * width);
    if (!accessor.base.bytes.empty()) read(accessor.base, width, accessor.normalized, values);
    if (accessor.sparse_count == 0) return values;
    std::vector<std::uint32_t> indices(accessor.sparse_count);
    read(accessor.sparse_indices, 1, false, indices);
    std::vector<Number> sparse(accessor.sparse_count * width);
    read(accessor.sparse_values, width, accessor.normalized, sparse);
    for (std::size_t i = 0; i < indices.size(); ++i) {
        if (indices[i] >= accessor.count || (i > 0 && indices[i] <= indices[i - 1])) {
            accessor.at.at("sparse").at("indices").fail(
                "index {} is {}; they must increase and stay below {}", i, indices[i],
                accessor.count);
        }
        std::copy_n(&sparse[i * width], width, &values[indices[i] * width]);
    }
    return values;
}

/// An accessor of elements of `width` numbers, of `vertex_count` elements unless that is 0.
Accessor open_accessor(const GltfFile& file, const JsonAt& reference, std::size_t width,
                       std::size_t vertex_count) {
    const std::size_t index = reference.index_below(file.count("accessors"), "accessors");
    Accessor accessor{.at = file.element("accessors", index)};
    const JsonAt& at = accessor.at;
    const std::uint64_t count = at.at("count").count();
    if (count == 0 || count > kMaxElements)
        at.at("count").fail("is {}; must be from 1 to {}", count, kMaxElements);
    accessor.count = count;
    accessor.width = width_of(at.at("type"));
    const Component& component = component_of(at.at("componentType"));
    accessor.base.component = &component;
    if (const auto normalized = at.find("normalized")) accessor.normalized = normalized->boolean();
    if (at.find("bufferView")) {
        accessor.base = packed(file, at, component, accessor.width, accessor.count, true);
    } else if (count > file.buffer_bytes()) {
        at.at("count").fail(
            "is {}, but the accessor has no bufferView, and all buffers have {} bytes", count,
            file.buffer_bytes());
    }
    if (const auto sparse = at.find("sparse")) open_sparse(file, *sparse, accessor);
    if (accessor.width != width) {
        const auto* const type =
            std::ranges::find(kTypes, width, &std::pair<std::string_view, std::size_t>::second);
        at.at("type").fail("must be {} here", type->first);
    }
    if (vertex_count != 0 && count != vertex_count)
        at.at("count").fail("is {}, but the positions of its primitive are {}", count,
                            vertex_count);
    return accessor;
}

}  // namespace

std::optional<JsonAt> extension_of(const JsonAt& at, std::string_view name) {
    const auto extensions = at.find("extensions");
    return extensions ? extensions->find(std::string(name)) : std::nullopt;
}

std::optional<std::string> data_of_uri(const JsonAt& uri) {
    const std::string_view text = uri.text();
    if (lower_case(std::string(text.substr(0, 5))) != "data:") return std::nullopt;
    constexpr std::string_view kBase64 = ";base64";
    const std::size_t comma = text.find(',');
    if (comma == std::string_view::npos || !text.substr(0, comma).ends_with(kBase64))
        uri.fail("is a data: URI that is not in base 64");
    std::optional<std::string> bytes = from_base64(percent_decoded(uri, comma + 1));
    if (!bytes) uri.fail("has characters that are not base 64, or is cut");
    return bytes;
}

std::filesystem::path file_of_uri(const JsonAt& uri, const std::filesystem::path& scene_file) {
    const std::string name = percent_decoded(uri);
    if (name.find("://") != std::string::npos) {
        uri.fail("{} is not followed; put the file beside the scene and give its name only",
                 quote(name));
    }
    try {
        return side_file(scene_file, name);
    } catch (const Error& error) {
        refuse_uri(uri, error);
    }
}

GltfFile::GltfFile(const std::filesystem::path& path, const WarnFunction& warn)
    : path_(path), name_(escape(path)) {
    bytes_ = read_input_file(path);
    Glb glb = {bytes_, {}};
    if (bytes_.starts_with(kMagic)) glb = split_glb(bytes_, name_);
    json_ = parse_json(glb.json, name_);
    require_version();
    require_known_extensions(warn);
    buffer_bytes_ = glb.binary.size();
    const std::size_t buffer_count = count("buffers");
    for (std::size_t i = 0; i < buffer_count; ++i)
        buffers_.push_back(
            read_buffer(element("buffers", i), i == 0 ? glb.binary : std::string_view()));
    if (glb.binary.data() == nullptr) bytes_ = {};
}

std::size_t GltfFile::count(const char* key) const {
    const std::optional<JsonAt> list = root().find(key);
    return list ? list->size() : 0;
}

JsonAt GltfFile::element(const char* key, std::size_t index) const { return root().at(key)[index]; }

View GltfFile::view(const JsonAt& reference) const {
    const JsonAt at =
        element("bufferViews", reference.index_below(count("bufferViews"), "buffer views"));
    const Buffer& buffer = buffers_[at.at("buffer").index_below(buffers_.size(), "buffers")];
    const std::uint64_t offset = at.count_or("byteOffset", 0);
    const std::uint64_t length = at.at("byteLength").count();
    if (length > buffer.bytes.size() || offset > buffer.bytes.size() - length) {
        at.at("byteLength")
            .fail("bytes {} to {} are not in the buffer, which has {}", offset, offset + length,
                  buffer.bytes.size());
    }
    return {at, buffer, buffer.bytes.substr(offset, length), offset};
}

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
    version.fail("is {}; only glTF 2.0 is read, convert the file", quote(text));
}

void GltfFile::require_known_extensions(const WarnFunction& warn) const {
    for (const std::string_view name : kShapesLeftOut) {
        if (!warn || !uses_extension(name)) continue;
        warn({name_, fmt::format("{} changes shapes, but is not read; write the file without it",
                                 quote(name))});
    }
    const std::optional<JsonAt> required = root().find("extensionsRequired");
    WarningCount left_out;
    for (std::size_t i = 0; required && i < required->size(); ++i) {
        const JsonAt extension = (*required)[i];
        const std::string_view name = extension.text();
        if (name == kQuantization || name == kTextureTransform || name == kInstancing) continue;
        if (std::ranges::none_of(kFamiliesLeftOut,
                                 [&](auto family) { return name.starts_with(family); })) {
            extension.fail("the extension {} is required, but not known; write the file without it",
                           quote(name));
        }
        left_out.add(name_, "{}: {} is required, but not read; left out", extension.path(),
                     quote(name));
    }
    left_out.tell(warn);
}

Buffer GltfFile::read_buffer(const JsonAt& buffer, std::string_view binary_chunk) {
    const JsonAt byte_length = buffer.at("byteLength");
    const std::uint64_t length = byte_length.count();
    const std::optional<JsonAt> uri = buffer.find("uri");
    Buffer content;
    if (!uri) {
        if (binary_chunk.data() == nullptr)
            buffer.fail("has no uri, and the file has no binary chunk for it");
        content = {binary_chunk, path_,
                   static_cast<std::uint64_t>(binary_chunk.data() - bytes_.data())};
    } else if (std::optional<std::string> data = data_of_uri(*uri)) {
        buffer_bytes_ += data->size();
        content.data = std::make_shared<const std::string>(std::move(*data));
        content.bytes = *content.data;
    } else {
        content.file = file_of_uri(*uri, path_);
        const auto [file, is_new] = files_.try_emplace(content.file);
        try {
            if (is_new) file->second = read_input_file(content.file);
        } catch (const Error& error) {
            refuse_uri(*uri, error);
        }
        if (is_new) buffer_bytes_ += file->second.size();
        content.bytes = file->second;
    }
    if (length > content.bytes.size()) {
        byte_length.fail("is {}, but there are {} bytes; is the file complete?", length,
                         content.bytes.size());
    }
    content.bytes = content.bytes.substr(0, length);
    return content;
}

std::vector<float> floats(const GltfFile& file, const JsonAt& reference, const Wanted& wanted) {
    const Accessor accessor = open_accessor(file, reference, wanted.width, wanted.vertex_count);
    const Component& component = *accessor.base.component;
    const bool is_allowed =
        component.is_float ||
        (component.size < 4 &&
         (wanted.integers == Wanted::Integers::kAny ||
          (wanted.integers == Wanted::Integers::kNormalized && accessor.normalized)));
    if (!is_allowed) {
        accessor.at.at("componentType")
            .fail("must be 5126 (float){} here",
                  wanted.integers == Wanted::Integers::kNone
                      ? ""
                      : " or an integer of 8 or 16 bits that is normalized");
    }
    return read_all<float>(accessor);
}

std::vector<std::uint32_t> integers(const GltfFile& file, const JsonAt& reference,
                                    std::size_t width, std::size_t vertex_count) {
    const Accessor accessor = open_accessor(file, reference, width, vertex_count);
    const bool allow_32_bits = width == 1;
    const Component& component = *accessor.base.component;
    if (!component.is_unsigned || (component.size == 4 && !allow_32_bits) || accessor.normalized) {
        accessor.at.at("componentType")
            .fail("must be 5121 or 5123{} here, and not normalized",
                  allow_32_bits ? " or 5125" : "");
    }
    return read_all<std::uint32_t>(accessor);
}

}  // namespace mray::gltf
