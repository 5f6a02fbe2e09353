#include "scenes/gltf/file/glb.h"

#include <fmt/format.h>

#include <bit>
#include <cstdint>
#include <cstring>

#include "common/base/errors.h"

namespace mray::gltf {
namespace {

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

}  // namespace

bool is_glb(std::string_view bytes) { return bytes.starts_with(kMagic); }

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

}  // namespace mray::gltf
