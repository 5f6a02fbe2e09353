#include "clips/index/clip_index.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <vector>

#include "tests/support/index_bytes.h"
#include "tests/support/thrown_error.h"

namespace mray {
namespace {

using namespace test;

constexpr float kInfinity = std::numeric_limits<float>::infinity();

bool equal(const ClipIndex& a, const ClipIndex& b) {
    const auto same_file = [](const IndexedFile& x, const IndexedFile& y) {
        return x.name == y.name && x.size == y.size && x.modified_ns == y.modified_ns &&
               x.hash == y.hash;
    };
    return a.topology_hash == b.topology_hash && a.vertex_count == b.vertex_count &&
           a.lenient == b.lenient && a.allow_empty == b.allow_empty &&
           std::equal(a.files.begin(), a.files.end(), b.files.begin(), b.files.end(), same_file) &&
           a.facts.bounds == b.facts.bounds && a.facts.damaged == b.facts.damaged &&
           a.facts.odd == b.facts.odd;
}

std::string error_of_bytes(const std::vector<std::byte>& bytes) {
    return message_of([&] { decode_index(bytes); });
}

/// The bytes with `value` in place of what was at `at`, and the checksum made right again.
template <class T>
std::vector<std::byte> with(std::vector<std::byte> bytes, std::size_t at, T value) {
    std::memcpy(bytes.data() + at, &value, sizeof value);
    set_checksum(bytes);
    return bytes;
}

// Where the numbers of three_frames() are.
constexpr std::size_t kVersionAt = 8;
constexpr std::size_t kFlagsAt = 12;
constexpr std::size_t kFileCountAt = 28;
constexpr std::size_t kNameSizeAt = 36;
constexpr std::size_t kNameAt = 38;
constexpr std::size_t kFileBytes = 2 + 7 + 24;
constexpr std::size_t kBoundsCountAt = kFileCountAt + 8 + 3 * kFileBytes;
constexpr std::size_t kBoundsAt = kBoundsCountAt + 8;
constexpr std::size_t kDamagedCountAt = kBoundsAt + 3 * 24;
constexpr std::size_t kDamagedAt = kDamagedCountAt + 8;
constexpr std::size_t kOddCountAt = kDamagedAt + 8;

TEST(ClipIndex, IsReadAsItWasWritten) {
    const ClipIndex index = three_frames();
    const std::vector<std::byte> bytes = encode_index(index);
    EXPECT_EQ(bytes.size(), kOddCountAt + 8 + 8);
    EXPECT_TRUE(equal(decode_index(bytes), index));
    ClipIndex lenient = index;
    lenient.lenient = lenient.allow_empty = true;
    lenient.facts.damaged = {};
    lenient.facts.bounds[1] = lenient.facts.bounds[0];
    lenient.facts.odd = {0, 2};
    EXPECT_TRUE(equal(decode_index(encode_index(lenient)), lenient));
}

TEST(ClipIndex, IsRefusedWhenItIsCutAtAnyByte) {
    const std::vector<std::byte> bytes = encode_index(three_frames());
    for (std::size_t size = 0; size < bytes.size(); ++size) {
        const std::vector<std::byte> cut(bytes.begin(),
                                         bytes.begin() + static_cast<std::ptrdiff_t>(size));
        EXPECT_NE(error_of_bytes(cut), "") << size;
        // Even with a checksum of what is left.
        if (size < 16) continue;
        std::vector<std::byte> summed = cut;
        set_checksum(summed);
        EXPECT_NE(error_of_bytes(summed), "") << size;
    }
}

TEST(ClipIndex, IsRefusedWhenAnyBitIsAnother) {
    const std::vector<std::byte> bytes = encode_index(three_frames());
    for (std::size_t i = 0; i < 8 * bytes.size(); ++i) {
        std::vector<std::byte> changed = bytes;
        changed[i / 8] ^= std::byte(1u << (i % 8));
        EXPECT_NE(error_of_bytes(changed), "") << i;
    }
}

TEST(ClipIndex, IsRefusedWhenBytesFollow) {
    std::vector<std::byte> bytes = encode_index(three_frames());
    bytes.insert(bytes.end() - 8, std::byte{0});
    set_checksum(bytes);
    EXPECT_EQ(error_of_bytes(bytes), "is damaged");
}

TEST(ClipIndex, SaysThatAFileIsNone) {
    EXPECT_EQ(error_of_bytes({}), "is not an index");
    EXPECT_EQ(error_of_bytes(with(encode_index(three_frames()), 0, 'X')), "is not an index");
}

TEST(ClipIndex, OfAnotherVersionIsNamed) {
    for (const std::uint32_t version : {0u, 2u, 0xFFFFFFFFu}) {
        EXPECT_EQ(error_of_bytes(with(encode_index(three_frames()), kVersionAt, version)),
                  fmt::format("has version {}; only 1 is known", version));
    }
}

TEST(ClipIndex, WithAnUnknownFlagIsDamaged) {
    for (const std::uint32_t flags : {4u, 0x80000000u, 0xFFFFFFFFu})
        EXPECT_EQ(error_of_bytes(with(encode_index(three_frames()), kFlagsAt, flags)),
                  "is damaged");
}

TEST(ClipIndex, WithAnyWrongCountIsDamaged) {
    const std::vector<std::byte> bytes = encode_index(three_frames());
    for (const std::size_t at : {kFileCountAt, kBoundsCountAt, kDamagedCountAt, kOddCountAt}) {
        std::uint64_t right = 0;
        std::memcpy(&right, bytes.data() + at, sizeof right);
        for (const std::uint64_t count :
             {std::uint64_t{0}, std::uint64_t{1}, std::uint64_t{2}, std::uint64_t{4},
              std::uint64_t{1} << 32, std::uint64_t{1} << 62, ~std::uint64_t{0} / 24,
              ~std::uint64_t{0}}) {
            if (count == right) continue;
            // The bytes then are an index of a frame with a warning.
            if (at == kDamagedCountAt && count == 0) continue;
            EXPECT_EQ(error_of_bytes(with(bytes, at, count)), "is damaged") << at << " " << count;
        }
    }
}

TEST(ClipIndex, WithANameThatIsTooLongIsDamaged) {
    for (const std::uint16_t size : {std::uint16_t{0}, std::uint16_t{0xFFFF}})
        EXPECT_EQ(error_of_bytes(with(encode_index(three_frames()), kNameSizeAt, size)),
                  "is damaged");
}

TEST(ClipIndex, WithANameThatLeavesTheFolderIsDamaged) {
    EXPECT_EQ(error_of_bytes(with(encode_index(three_frames()), kNameAt, '/')), "is damaged");
}

TEST(ClipIndex, WithBoundsThatAreNotFiniteIsDamaged) {
    for (const float bad : {std::nanf(""), kInfinity, -kInfinity}) {
        for (std::size_t i = 0; i < 6; ++i) {
            EXPECT_EQ(error_of_bytes(with(encode_index(three_frames()), kBoundsAt + 4 * i, bad)),
                      "is damaged")
                << i;
        }
    }
}

TEST(ClipIndex, WithInvertedBoundsIsDamaged) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
        EXPECT_EQ(error_of_bytes(with(encode_index(three_frames()), kBoundsAt + 4 * axis, 1000.0f)),
                  "is damaged");
    }
}

TEST(ClipIndex, WithDamageBeyondItsFramesIsDamaged) {
    for (const std::uint64_t frame : {std::uint64_t{3}, ~std::uint64_t{0}})
        EXPECT_EQ(error_of_bytes(with(encode_index(three_frames()), kDamagedAt, frame)),
                  "is damaged");
}

TEST(ClipIndex, WithBoundsOfADamagedFrameIsDamaged) {
    ClipIndex index = three_frames();
    index.facts.bounds[1] = index.facts.bounds[0];
    EXPECT_EQ(error_of_bytes(encode_index(index)), "is damaged");
}

TEST(ClipIndex, WithDamageOutOfOrderIsDamaged) {
    ClipIndex index = three_frames();
    index.facts.damaged = {1, 1};
    EXPECT_EQ(error_of_bytes(encode_index(index)), "is damaged");
    index.facts.damaged = {2, 1};
    EXPECT_EQ(error_of_bytes(encode_index(index)), "is damaged");
}

TEST(ClipIndex, WithNothingButDamageIsDamaged) {
    ClipIndex index = three_frames();
    index.facts.damaged = {0, 1, 2};
    EXPECT_EQ(error_of_bytes(encode_index(index)), "is damaged");
}

TEST(ClipIndex, WithoutFilesIsDamaged) {
    ClipIndex index = three_frames();
    index.files.clear();
    EXPECT_EQ(error_of_bytes(encode_index(index)), "is damaged");
}

}  // namespace
}  // namespace mray
