#include "scenes/gltf/gltf_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <charconv>
#include <cstring>
#include <iterator>
#include <limits>
#include <type_traits>

#include "common/base/input_file.h"
#include "common/text/text.h"
#include "scenes/mesh/mesh_file.h"

namespace mray::gltf {
namespace {

constexpr std::string_view kMagic = "glTF";
constexpr std::uint32_t kVersion = 2;
constexpr std::uint32_t kJsonChunk = 0x4E4F534A;
constexpr std::uint32_t kBinaryChunk = 0x004E4942;

/// Parts of the bytes of a GLB file; `binary` has no data if there is no such chunk.
struct Glb {
    std::string_view json, binary;
};

/// Finds the chunks of a GLB file (version 2). Those after the second are left out.
Glb split_glb(std::string_view bytes, const std::string& file) {
    const auto refuse = [&](std::size_t byte, const std::string& what) {
        throw Error(ErrorKind::kBadInput, "{}: byte {}: {}", file, byte, what);
    };
    const auto word_at = [&](std::size_t at) {
        static_assert(std::endian::native == std::endian::little);
        std::uint32_t word = 0;
        if (bytes.size() < at + sizeof word)
            refuse(bytes.size(), "ends within a head; is it complete?");
        std::memcpy(&word, bytes.data() + at, sizeof word);
        return word;
    };
    const auto chunk_at = [&](std::size_t at) {
        const std::uint32_t size = word_at(at);
        const std::string_view rest = bytes.substr(at + 8);
        if (size > rest.size())
            refuse(at, fmt::format("a chunk of {} bytes, but {} follow", size, rest.size()));
        return rest.substr(0, size);
    };
    if (word_at(4) != kVersion)
        refuse(4, fmt::format("has version {}; only {} is known", word_at(4), kVersion));
    if (word_at(8) != bytes.size()) {
        refuse(8, fmt::format("has {} bytes, but its head tells of {}; is it complete?",
                              bytes.size(), word_at(8)));
    }
    if (word_at(16) != kJsonChunk) refuse(16, "the first chunk is not JSON");
    Glb glb = {chunk_at(12), {}};
    const std::size_t second = 20 + glb.json.size();
    if (second < bytes.size() && word_at(second + 4) == kBinaryChunk) glb.binary = chunk_at(second);
    return glb;
}

// Triangles and their places do not depend on extensions whose names begin so.
constexpr std::string_view kFamiliesLeftOut[] = {"KHR_lights_",    "EXT_lights_",  "KHR_materials_",
                                                 "EXT_materials_", "KHR_texture_", "EXT_texture_"};

// Extensions that change shapes, but need not be required.
constexpr std::string_view kShapesLeftOut[] = {
    "EXT_mesh_gpu_instancing", "KHR_animation_pointer",   "KHR_draco_mesh_compression",
    "EXT_meshopt_compression", "KHR_meshopt_compression", "KHR_node_visibility"};

/// Returns work(), whose Error(kBadInput) becomes one about a URI.
template <class Work>
auto at_uri(const JsonAt& uri, const Work& work) {
    try {
        return work();
    } catch (const Error& error) {
        if (error.kind() != ErrorKind::kBadInput) throw;
        uri.fail("{}", as_warning(error, uri.file()).text);
    }
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

/// A type of components, all of which are exact in a double.
struct Component {
    /// Its number in the file.
    std::uint64_t id;
    std::size_t size;
    bool is_float;
    bool is_unsigned;
    /// What 1 is stored as if it is normalized.
    float largest;
    double (*value)(const char* bytes);
};

template <class Number>
constexpr Component component(std::uint64_t id) {
    constexpr auto kValue = [](const char* bytes) {
        Number number;
        std::memcpy(&number, bytes, sizeof number);
        return static_cast<double>(number);
    };
    using Limits = std::numeric_limits<Number>;
    return {id,
            sizeof(Number),
            !Limits::is_integer,
            std::is_unsigned_v<Number>,
            static_cast<float>(Limits::max()),
            kValue};
}

constexpr Component kComponents[] = {component<std::int8_t>(5120),   component<std::uint8_t>(5121),
                                     component<std::int16_t>(5122),  component<std::uint16_t>(5123),
                                     component<std::uint32_t>(5125), component<float>(5126)};

const Component& component_of(const JsonAt& at) {
    const auto* const found = std::ranges::find(kComponents, at.count(), &Component::id);
    if (found == std::end(kComponents))
        at.fail("is {}; must be 5120, 5121, 5122, 5123, 5125 or 5126", at.count());
    return *found;
}

void require_type(const JsonAt& at, std::size_t width) {
    const std::string wanted = width == 1    ? "SCALAR"
                               : width == 16 ? "MAT4"
                                             : fmt::format("VEC{}", width);
    if (at.text() != wanted) at.fail("is {}; must be {} here", quote(at.text()), wanted);
}

/// The elements of the buffer view that `owner` refers to. Normalized integers become floats.
template <class Number>
std::vector<Number> read(const GltfFile& file, const JsonAt& owner, const Component& component,
                         std::size_t width, std::size_t count, bool normalized) {
    const View view = file.view(owner.at("bufferView"));
    const std::uint64_t offset = owner.count_or("byteOffset", 0);
    const std::size_t element = width * component.size;
    std::uint64_t stride = element;
    if (const auto given = view.at.find("byteStride")) {
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
    std::vector<Number> values(count * width);
    for (std::size_t i = 0; i < values.size(); ++i) {
        const std::size_t at = offset + i / width * stride + i % width * component.size;
        values[i] = static_cast<Number>(component.value(view.bytes.data() + at));
        if constexpr (std::is_same_v<Number, float>)
            if (normalized && !component.is_float)
                values[i] = std::max(values[i] / component.largest, -1.0f);
    }
    return values;
}

/// Replaces the elements that `sparse` lists.
template <class Number>
void replace_sparse(const GltfFile& file, const JsonAt& sparse, const Component& component,
                    std::size_t width, bool normalized, std::vector<Number>& values) {
    const std::size_t element_count = values.size() / width;
    const std::uint64_t count = sparse.at("count").count();
    if (count == 0 || count > element_count)
        sparse.at("count").fail("is {}; must be from 1 to {}", count, element_count);
    const JsonAt at = sparse.at("indices");
    const Component& index_component = component_of(at.at("componentType"));
    if (!index_component.is_unsigned)
        at.at("componentType").fail("must be 5121, 5123 or 5125 here");
    const auto indices = read<std::uint32_t>(file, at, index_component, 1, count, false);
    const auto given = read<Number>(file, sparse.at("values"), component, width, count, normalized);
    for (std::size_t i = 0; i < count; ++i) {
        if (indices[i] >= element_count || (i > 0 && indices[i] <= indices[i - 1])) {
            at.fail("index {} is {}; they must increase and stay below {}", i, indices[i],
                    element_count);
        }
        std::copy_n(&given[i * width], width, &values[indices[i] * width]);
    }
}

/// The numbers of an accessor with `vertex_count` elements, unless that is 0. `needed` describes
/// the components for which is_allowed(component, normalized) is true.
template <class Number, class IsAllowed>
std::vector<Number> read_accessor(const GltfFile& file, const JsonAt& reference, std::size_t width,
                                  std::size_t vertex_count, const std::string& needed,
                                  IsAllowed is_allowed) {
    const JsonAt at =
        file.element("accessors", reference.index_below(file.count("accessors"), "accessors"));
    const JsonAt count_at = at.at("count");
    const std::uint64_t count = count_at.count();
    if (count == 0 || count > kMaxElements)
        count_at.fail("is {}; must be from 1 to {}", count, kMaxElements);
    if (vertex_count != 0 && count != vertex_count)
        count_at.fail("is {}, but the positions of its primitive are {}", count, vertex_count);
    require_type(at.at("type"), width);
    const Component& component = component_of(at.at("componentType"));
    const auto flag = at.find("normalized");
    const bool normalized = flag && flag->boolean();
    if (!is_allowed(component, normalized)) at.at("componentType").fail("must be {}", needed);
    std::vector<Number> values;
    if (at.find("bufferView")) {
        values = read<Number>(file, at, component, width, count, normalized);
    } else if (count > file.buffer_bytes()) {
        count_at.fail("is {}, but the accessor has no bufferView, and all buffers have {} bytes",
                      count, file.buffer_bytes());
    }
    values.resize(count * width);
    if (const auto sparse = at.find("sparse"))
        replace_sparse(file, *sparse, component, width, normalized, values);
    return values;
}

}  // namespace

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
    return at_uri(uri, [&] { return side_file(scene_file, name); });
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

void GltfFile::require_version() const {
    const JsonAt version = root().at("asset").at("version");
    if (!version.text().starts_with("2."))
        version.fail("is {}; only glTF 2.0 is read, convert the file", quote(version.text()));
}

void GltfFile::require_known_extensions(const WarnFunction& warn) const {
    const std::optional<JsonAt> used = root().find("extensionsUsed");
    for (std::size_t i = 0; used && i < used->size(); ++i) {
        const std::string_view name = (*used)[i].text();
        if (!warn || std::ranges::find(kShapesLeftOut, name) == std::end(kShapesLeftOut)) continue;
        warn({name_, fmt::format("{} changes shapes, but is not read; write the file without it",
                                 quote(name))});
    }
    const std::optional<JsonAt> required = root().find("extensionsRequired");
    WarningCount left_out;
    for (std::size_t i = 0; required && i < required->size(); ++i) {
        const JsonAt extension = (*required)[i];
        const std::string_view name = extension.text();
        if (name == "KHR_mesh_quantization" || name == kTextureTransform) continue;
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
        if (is_new) {
            file->second = at_uri(*uri, [&] { return read_input_file(content.file); });
            buffer_bytes_ += file->second.size();
        }
        content.bytes = file->second;
    }
    if (length > content.bytes.size()) {
        byte_length.fail("is {}, but there are {} bytes; is the file complete?", length,
                         content.bytes.size());
    }
    content.bytes = content.bytes.substr(0, length);
    return content;
}

std::vector<float> floats(const GltfFile& file, const JsonAt& reference, std::size_t width,
                          std::size_t vertex_count) {
    return read_accessor<float>(
        file, reference, width, vertex_count, "5126 (float) or an integer of 8 or 16 bits here",
        [](const Component& component, bool) { return component.is_float || component.size < 4; });
}

std::vector<std::uint32_t> integers(const GltfFile& file, const JsonAt& reference,
                                    std::size_t width, std::size_t vertex_count) {
    const bool allow_32_bits = width == 1;
    return read_accessor<std::uint32_t>(
        file, reference, width, vertex_count,
        allow_32_bits ? "5121 or 5123 or 5125 here, and not normalized"
                      : "5121 or 5123 here, and not normalized",
        [&](const Component& component, bool normalized) {
            return component.is_unsigned && (component.size < 4 || allow_32_bits) && !normalized;
        });
}

}  // namespace mray::gltf
