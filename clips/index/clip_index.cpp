#include "clips/index/clip_index.h"

#include <fmt/format.h>

#include <cmath>
#include <utility>

#include "clips/index/byte_stream.h"
#include "common/base/errors.h"
#include "common/base/hash.h"

namespace mray {
namespace {

constexpr std::uint32_t kVersion = 1;
constexpr std::size_t kHashSize = sizeof(std::uint64_t);

enum Flag : std::uint32_t { kLenient = 1, kAllowEmpty = 2, kAllFlags = 3 };

// The least that a file, and what bounds and the number of a keyframe take.
constexpr std::size_t kFileSize = 2 + 8 + 8 + 8;
constexpr std::size_t kBoundsSize = 6 * sizeof(float);
constexpr std::size_t kNumberSize = sizeof(std::uint64_t);

[[noreturn]] void fail(const std::string& what) { throw Error(ErrorKind::kBadInput, what); }

[[noreturn]] void fail_damaged() { fail("is damaged"); }

std::uint64_t hash_of_bytes(std::span<const std::byte> bytes) {
    return Hasher().add(bytes).digest();
}

bool is_box(const KeyframeBounds& bounds) {
    if (bounds == KeyframeBounds()) return true;
    for (int axis = 0; axis < 3; ++axis) {
        if (!std::isfinite(bounds.lower[axis]) || !std::isfinite(bounds.upper[axis])) return false;
        if (!(bounds.lower[axis] <= bounds.upper[axis])) return false;
    }
    return true;
}

/// A count of things that take at least `least` bytes each.
std::size_t take_count(ByteReader& in, std::size_t least) {
    const auto count = in.take<std::uint64_t>();
    if (count > in.left() / least) fail_damaged();
    return static_cast<std::size_t>(count);
}

void take_files(ByteReader& in, ClipIndex& index) {
    index.files.resize(take_count(in, kFileSize));
    for (IndexedFile& file : index.files) {
        file.name = in.take_text();
        file.size = in.take<std::uint64_t>();
        file.modified_ns = in.take<std::int64_t>();
        file.hash = in.take<std::uint64_t>();
        if (file.name.empty() || file.name.find('/') != std::string::npos) fail_damaged();
    }
}

void take_bounds(ByteReader& in, ClipFacts& facts) {
    facts.bounds.resize(take_count(in, kBoundsSize));
    for (KeyframeBounds& bounds : facts.bounds) {
        for (float& x : bounds.lower) x = in.take<float>();
        for (float& x : bounds.upper) x = in.take<float>();
        if (!is_box(bounds)) fail_damaged();
    }
}

void add_numbers(ByteWriter& out, std::span<const std::size_t> numbers) {
    out.add(std::uint64_t{numbers.size()});
    for (const std::size_t number : numbers) out.add(std::uint64_t{number});
}

/// Ascending numbers of keyframes.
std::vector<std::size_t> take_numbers(ByteReader& in, std::size_t keyframe_count) {
    std::vector<std::size_t> numbers(take_count(in, kNumberSize));
    for (std::size_t i = 0; i < numbers.size(); ++i) {
        numbers[i] = in.take<std::uint64_t>();
        if (numbers[i] >= keyframe_count || (i > 0 && numbers[i] <= numbers[i - 1])) fail_damaged();
    }
    return numbers;
}

}  // namespace

std::vector<std::byte> encode_index(const ClipIndex& index) {
    ByteWriter out;
    for (const char c : kIndexMagic) out.add(c);
    out.add(kVersion);
    const ClipFacts& facts = index.facts;
    out.add((index.lenient ? kLenient : 0u) | (index.allow_empty ? kAllowEmpty : 0u));
    out.add(index.topology_hash);
    out.add(index.vertex_count);
    out.add(std::uint64_t{index.files.size()});
    for (const IndexedFile& file : index.files) {
        out.add_text(file.name);
        out.add(file.size);
        out.add(file.modified_ns);
        out.add(file.hash);
    }
    out.add(std::uint64_t{facts.bounds.size()});
    for (const KeyframeBounds& bounds : facts.bounds) {
        for (const float x : bounds.lower) out.add(x);
        for (const float x : bounds.upper) out.add(x);
    }
    add_numbers(out, facts.damaged);
    add_numbers(out, facts.odd);
    out.add(hash_of_bytes(out.bytes()));
    return std::move(out.bytes());
}

ClipIndex decode_index(std::span<const std::byte> bytes) {
    ByteReader in(bytes);
    for (const char c : kIndexMagic) {
        if (in.take<char>() != c) fail("is not an index");
    }
    const auto version = in.take<std::uint32_t>();
    if (in.is_valid() && version != kVersion)
        fail(fmt::format("has version {}; only {} is known", version, kVersion));
    if (!in.is_valid() || in.left() < kHashSize) fail_damaged();
    const std::span<const std::byte> hashed = bytes.first(bytes.size() - kHashSize);
    if (ByteReader(bytes.last(kHashSize)).take<std::uint64_t>() != hash_of_bytes(hashed))
        fail_damaged();
    in = ByteReader(hashed.subspan(kIndexMagic.size() + sizeof version));
    ClipIndex index;
    const auto flags = in.take<std::uint32_t>();
    if ((flags & ~kAllFlags) != 0) fail_damaged();
    index.lenient = (flags & kLenient) != 0;
    index.allow_empty = (flags & kAllowEmpty) != 0;
    index.topology_hash = in.take<std::uint64_t>();
    index.vertex_count = in.take<std::uint32_t>();
    take_files(in, index);
    take_bounds(in, index.facts);
    index.facts.damaged = take_numbers(in, index.facts.bounds.size());
    index.facts.odd = take_numbers(in, index.facts.bounds.size());
    if (!in.is_valid() || in.left() != 0 || index.files.empty()) fail_damaged();
    for (const std::size_t keyframe : index.facts.damaged) {
        if (index.facts.bounds[keyframe] != KeyframeBounds()) fail_damaged();
    }
    // Such a clip is refused when its index is made.
    if (index.facts.damaged.size() == index.facts.bounds.size()) fail_damaged();
    return index;
}

}  // namespace mray
