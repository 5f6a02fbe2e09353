// The vectors of all SIMD code: floats and unsigned integers of at most 16 lanes, so that the 16
// boxes of a node or the 16 triangles of a leaf are kVectors of them. Compiled once for each
// target. Highway's own operators serve + - * / < <= > >= == & | ^ on vectors; this file adds
// operators of masks, and short names. Functions for few places keep their Highway names (hn::).
#if defined(MORPHRAY_COMMON_SIMD_VECTORS_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MORPHRAY_COMMON_SIMD_VECTORS_INL_H
#undef MORPHRAY_COMMON_SIMD_VECTORS_INL_H
#else
#define MORPHRAY_COMMON_SIMD_VECTORS_INL_H
#endif

#include <hwy/cache_control.h>
#include <hwy/highway.h>

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <iterator>
#include <type_traits>

HWY_BEFORE_NAMESPACE();
namespace mray::simd {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

inline constexpr std::uint32_t kMaxLanes = 16;
inline constexpr std::size_t kCacheLine = 64;

using FloatTag = hn::CappedTag<float, kMaxLanes>;
using UintTag = hn::RebindToUnsigned<FloatTag>;
using IntTag = hn::RebindToSigned<FloatTag>;
using ByteTag = hn::Repartition<std::uint8_t, FloatTag>;
using FloatVec = hn::Vec<FloatTag>;
using UintVec = hn::Vec<UintTag>;
using IntVec = hn::Vec<IntTag>;
/// A bool for each lane of a FloatVec. UintMask and IntMask belong to the other vectors.
using Mask = hn::Mask<FloatTag>;
using UintMask = hn::Mask<UintTag>;
using IntMask = hn::Mask<IntTag>;

inline constexpr FloatTag kFloats;
inline constexpr UintTag kUints;
inline constexpr IntTag kInts;
inline constexpr ByteTag kBytes;
inline constexpr auto kLanes = static_cast<std::uint32_t>(hn::MaxLanes(FloatTag()));
inline constexpr std::uint32_t kVectors = kMaxLanes / kLanes;
inline constexpr std::uint32_t kLaneBits = (1u << kLanes) - 1;

// ---- Memory. load() and store() take addresses that are aligned to the size of a vector.

HWY_INLINE FloatVec load(const float* from) { return hn::Load(kFloats, from); }
HWY_INLINE UintVec load(const std::uint32_t* from) { return hn::Load(kUints, from); }
HWY_INLINE IntVec load(const std::int32_t* from) { return hn::Load(kInts, from); }
HWY_INLINE FloatVec load_unaligned(const float* from) { return hn::LoadU(kFloats, from); }
HWY_INLINE UintVec load_unaligned(const std::uint32_t* from) { return hn::LoadU(kUints, from); }
HWY_INLINE void store(FloatVec v, float* to) { hn::Store(v, kFloats, to); }
HWY_INLINE void store(UintVec v, std::uint32_t* to) { hn::Store(v, kUints, to); }
HWY_INLINE void store(IntVec v, std::int32_t* to) { hn::Store(v, kInts, to); }
HWY_INLINE void store_unaligned(FloatVec v, float* to) { hn::StoreU(v, kFloats, to); }
HWY_INLINE void store_unaligned(UintVec v, std::uint32_t* to) { hn::StoreU(v, kUints, to); }

/// Prefetches the cache lines of `size` bytes, which need not exist.
HWY_INLINE void prefetch(const void* from, std::size_t size) {
    const auto first = reinterpret_cast<std::uintptr_t>(from);
    for (std::size_t i = 0; i < size; i += kCacheLine)
        hwy::Prefetch(reinterpret_cast<const char*>(first + i));
}

HWY_INLINE FloatVec splat(float x) { return hn::Set(kFloats, x); }
HWY_INLINE UintVec splat(std::uint32_t x) { return hn::Set(kUints, x); }
HWY_INLINE IntVec splat(std::int32_t x) { return hn::Set(kInts, x); }
HWY_INLINE FloatVec zero() { return hn::Zero(kFloats); }

// ---- Arithmetic, rounded after each operation

HWY_INLINE FloatVec operator-(FloatVec v) { return hn::Neg(v); }

/// Minimum and maximum where neither NaN nor the sign of a zero decides anything.
HWY_INLINE FloatVec min(FloatVec a, FloatVec b) { return hn::Min(a, b); }
HWY_INLINE FloatVec max(FloatVec a, FloatVec b) { return hn::Max(a, b); }
HWY_INLINE UintVec min(UintVec a, UintVec b) { return hn::Min(a, b); }
HWY_INLINE UintVec max(UintVec a, UintVec b) { return hn::Max(a, b); }
HWY_INLINE FloatVec abs(FloatVec v) { return hn::Abs(v); }
HWY_INLINE FloatVec min3(FloatVec a, FloatVec b, FloatVec c) { return min(a, min(b, c)); }
HWY_INLINE FloatVec max3(FloatVec a, FloatVec b, FloatVec c) { return max(a, max(b, c)); }
HWY_INLINE FloatVec sum3(FloatVec a, FloatVec b, FloatVec c) { return a + b + c; }

// A number stands for a vector of it.
HWY_INLINE FloatVec operator+(float a, FloatVec b) { return splat(a) + b; }
HWY_INLINE FloatVec operator+(FloatVec a, float b) { return a + splat(b); }
HWY_INLINE FloatVec operator-(float a, FloatVec b) { return splat(a) - b; }
HWY_INLINE FloatVec operator-(FloatVec a, float b) { return a - splat(b); }
HWY_INLINE FloatVec operator*(float a, FloatVec b) { return splat(a) * b; }
HWY_INLINE FloatVec operator*(FloatVec a, float b) { return a * splat(b); }
HWY_INLINE Mask operator<(FloatVec a, float b) { return a < splat(b); }
HWY_INLINE Mask operator<=(FloatVec a, float b) { return a <= splat(b); }
HWY_INLINE Mask operator>(FloatVec a, float b) { return a > splat(b); }
HWY_INLINE Mask operator>=(FloatVec a, float b) { return a >= splat(b); }
HWY_INLINE Mask operator==(FloatVec a, float b) { return a == splat(b); }
HWY_INLINE UintVec operator+(UintVec a, std::uint32_t b) { return a + splat(b); }
HWY_INLINE UintVec operator-(std::uint32_t a, UintVec b) { return splat(a) - b; }
HWY_INLINE UintVec operator*(UintVec a, std::uint32_t b) { return a * splat(b); }
HWY_INLINE UintVec operator&(UintVec a, std::uint32_t b) { return a & splat(b); }
HWY_INLINE UintVec operator|(UintVec a, std::uint32_t b) { return a | splat(b); }
HWY_INLINE UintMask operator>(UintVec a, std::uint32_t b) { return a > splat(b); }
HWY_INLINE UintMask operator==(UintVec a, std::uint32_t b) { return a == splat(b); }

template <int kBits>
HWY_INLINE UintVec shift_left(UintVec v) {
    return hn::ShiftLeft<kBits>(v);
}
template <int kBits>
HWY_INLINE UintVec shift_right(UintVec v) {
    return hn::ShiftRight<kBits>(v);
}

/// Compilers shift by a constant in one operation.
HWY_INLINE UintVec operator<<(UintVec v, std::uint32_t bits) {
    return hn::ShiftLeftSame(v, static_cast<int>(bits));
}
HWY_INLINE UintVec operator>>(UintVec v, std::uint32_t bits) {
    return hn::ShiftRightSame(v, static_cast<int>(bits));
}

// ---- Arithmetic of bounds: fused where the target can, so the last bit depends on the target. A
// bound must allow for both; no result may be computed by these.

HWY_INLINE FloatVec mul_add(FloatVec a, FloatVec b, FloatVec c) { return hn::MulAdd(a, b, c); }
HWY_INLINE FloatVec mul_sub(FloatVec a, FloatVec b, FloatVec c) { return hn::MulSub(a, b, c); }
/// c - a * b.
HWY_INLINE FloatVec neg_mul_add(FloatVec a, FloatVec b, FloatVec c) {
    return hn::NegMulAdd(a, b, c);
}

// ---- Bits

template <class Vec>
HWY_INLINE FloatVec as_float(Vec v) {
    return hn::BitCast(kFloats, v);
}
template <class Vec>
HWY_INLINE UintVec as_uint(Vec v) {
    return hn::BitCast(kUints, v);
}
template <class Vec>
HWY_INLINE IntVec as_int(Vec v) {
    return hn::BitCast(kInts, v);
}

// ---- Masks

HWY_INLINE Mask operator&(Mask a, Mask b) { return hn::And(a, b); }
HWY_INLINE Mask operator|(Mask a, Mask b) { return hn::Or(a, b); }
HWY_INLINE Mask operator!(Mask m) { return hn::Not(m); }
HWY_INLINE UintMask operator&(UintMask a, UintMask b) { return hn::And(a, b); }
HWY_INLINE UintMask operator|(UintMask a, UintMask b) { return hn::Or(a, b); }
HWY_INLINE UintMask operator!(UintMask m) { return hn::Not(m); }
/// !a & b in one operation.
HWY_INLINE Mask and_not(Mask a, Mask b) { return hn::AndNot(a, b); }

HWY_INLINE FloatVec select(Mask m, FloatVec a, FloatVec b) { return hn::IfThenElse(m, a, b); }
HWY_INLINE UintVec select(UintMask m, UintVec a, UintVec b) { return hn::IfThenElse(m, a, b); }
HWY_INLINE FloatVec select(Mask m, FloatVec a, float b) { return select(m, a, splat(b)); }
HWY_INLINE FloatVec select(Mask m, float a, FloatVec b) { return select(m, splat(a), b); }
HWY_INLINE FloatVec zero_unless(Mask m, FloatVec v) { return hn::IfThenElseZero(m, v); }
HWY_INLINE UintVec zero_unless(UintMask m, UintVec v) { return hn::IfThenElseZero(m, v); }

HWY_INLINE Mask float_mask(UintMask m) { return hn::RebindMask(kFloats, m); }
HWY_INLINE Mask float_mask(IntMask m) { return hn::RebindMask(kFloats, m); }
HWY_INLINE UintMask uint_mask(Mask m) { return hn::RebindMask(kUints, m); }

HWY_INLINE bool none(Mask m) { return hn::AllFalse(kFloats, m); }
HWY_INLINE bool none(UintMask m) { return hn::AllFalse(kUints, m); }
HWY_INLINE bool all(Mask m) { return hn::AllTrue(kFloats, m); }
HWY_INLINE std::size_t count(Mask m) { return hn::CountTrue(kFloats, m); }

/// Lane i as bit i; other bits are 0.
HWY_INLINE std::uint32_t bits_of(Mask m) {
    // No more bytes than the mask has: a wider read would wait for the narrow write.
    using Bits = std::conditional_t<(kLanes > 8), std::uint16_t, std::uint8_t>;
    std::uint8_t bytes[8];
    hn::StoreMaskBits(kFloats, m, bytes);
    Bits bits;
    std::memcpy(&bits, bytes, sizeof bits);
    return bits;
}
HWY_INLINE std::uint32_t bits_of(UintMask m) { return bits_of(float_mask(m)); }

/// The numbers below 16 that test() selects, as bits. test(l) returns a mask of as many numbers as
/// there are lanes, from l on.
template <class Test>
HWY_INLINE std::uint32_t bits_of_sixteen(Test test) {
    std::uint32_t bits = 0;
    for (std::size_t l = 0; l < kMaxLanes; l += kLanes) bits |= bits_of(test(l)) << l;
    return bits;
}

/// The number of the lowest bit of a number that is not 0.
HWY_INLINE std::uint32_t first_bit(std::uint32_t bits) {
    return static_cast<std::uint32_t>(__builtin_ctz(bits));
}
HWY_INLINE std::uint32_t first_bit(std::uint64_t bits) {
    return static_cast<std::uint32_t>(__builtin_ctzll(bits));
}

/// The numbers of the bits that are set, from the lowest on: for (std::uint32_t i : BitsOf(bits)).
template <class Bits>
class BitsOf {
public:
    HWY_INLINE explicit BitsOf(Bits bits) : rest_(bits) {}

    HWY_INLINE BitsOf begin() const { return *this; }
    HWY_INLINE std::default_sentinel_t end() const { return {}; }
    HWY_INLINE bool operator!=(std::default_sentinel_t) const { return rest_ != 0; }
    HWY_INLINE std::uint32_t operator*() const { return first_bit(rest_); }
    HWY_INLINE void operator++() { rest_ &= rest_ - 1; }

private:
    Bits rest_;
};

/// The mask whose bits these are.
HWY_INLINE Mask mask_of(std::uint32_t bits) {
    const std::uint8_t bytes[8] = {static_cast<std::uint8_t>(bits),
                                   static_cast<std::uint8_t>(bits >> 8)};
    return hn::LoadMaskBits(kFloats, bytes);
}

// ---- Lanes

/// Looks up values[index] for each lane, out of 16 values; indices are below 16.
class LaneLookup {
public:
    HWY_INLINE explicit LaneLookup(UintVec index) : index_(index) {}

    /// values: 16 floats at an address that is aligned to the size of a vector.
    HWY_INLINE FloatVec operator()(const float* values) const {
        FloatVec vectors[kVectors];
        for (std::size_t v = 0; v < kVectors; ++v) vectors[v] = load(values + v * kLanes);
        return (*this)(vectors, values);
    }
    /// `vectors` hold `values` in kVectors registers.
    HWY_INLINE FloatVec operator()(const FloatVec* vectors, const float* values) const {
        if constexpr (kVectors == 1) {
            return hn::TableLookupLanes(vectors[0], hn::IndicesFromVec(kFloats, index_));
        } else if constexpr (kVectors == 2) {
            return in_two(vectors[0], vectors[1]);
        } else {
            return hn::GatherIndex(kFloats, values, as_int(index_));
        }
    }

private:
    HWY_INLINE FloatVec in_two(FloatVec low, FloatVec high) const {
        const auto place = hn::IndicesFromVec(kFloats, index_ & splat(kLanes - 1));
        // Bit 3 of an index says which vector has the value.
        const FloatVec in_high = as_float(shift_left<28>(index_));
        return hn::IfNegativeThenElse(in_high, hn::TableLookupLanes(high, place),
                                      hn::TableLookupLanes(low, place));
    }

    UintVec index_;
};

#if HWY_TARGET != HWY_SCALAR
/// Lane i of each block of 4 is `combine` (min or max) over the same block of v[i].
template <class Combine>
HWY_INLINE FloatVec combine_four(const FloatVec v[4], Combine combine) {
    const hn::Repartition<double, FloatTag> pairs;
    const auto two = [&](FloatVec a, FloatVec b) HWY_ATTR {
        return hn::BitCast(
            pairs, combine(hn::InterleaveLower(kFloats, a, b), hn::InterleaveUpper(kFloats, a, b)));
    };
    const auto first = two(v[0], v[1]);
    const auto last = two(v[2], v[3]);
    return combine(hn::BitCast(kFloats, hn::InterleaveLower(pairs, first, last)),
                   hn::BitCast(kFloats, hn::InterleaveUpper(pairs, first, last)));
}

/// Combines the blocks of four lanes of a vector to one block by `combine` (min or max).
template <class D, class Combine>
HWY_INLINE auto reduce_blocks(D d, hn::Vec<D> v, Combine combine) {
    if constexpr (hn::MaxLanes(d) == 4) {
        return v;
    } else {
        const hn::Half<D> half;
        return reduce_blocks(half, combine(hn::LowerHalf(half, v), hn::UpperHalf(half, v)),
                             combine);
    }
}

/// Transposes blocks of four words: out[0] has the first words of the vectors, and so on.
template <class D>
HWY_INLINE void transpose_fours(D d, const hn::Vec<D> in[4], hn::Vec<D> out[4]) {
    const hn::Repartition<std::uint64_t, D> pairs;
    const auto lower = hn::BitCast(pairs, hn::InterleaveLower(d, in[0], in[1]));
    const auto next_lower = hn::BitCast(pairs, hn::InterleaveLower(d, in[2], in[3]));
    const auto upper = hn::BitCast(pairs, hn::InterleaveUpper(d, in[0], in[1]));
    const auto next_upper = hn::BitCast(pairs, hn::InterleaveUpper(d, in[2], in[3]));
    out[0] = hn::BitCast(d, hn::InterleaveLower(pairs, lower, next_lower));
    out[1] = hn::BitCast(d, hn::InterleaveUpper(pairs, lower, next_lower));
    out[2] = hn::BitCast(d, hn::InterleaveLower(pairs, upper, next_upper));
    out[3] = hn::BitCast(d, hn::InterleaveUpper(pairs, upper, next_upper));
}
#endif

/// Writes a number to aligned lanes of a mask; SSE's masked store goes around the caches.
HWY_INLINE void store_where(Mask m, std::uint32_t number, std::uint32_t* to) {
    const UintVec numbers = splat(number);
#if HWY_TARGET == HWY_AVX2
    hn::BlendedStore(numbers, uint_mask(m), kUints, to);
#else
    store(select(uint_mask(m), numbers, load(to)), to);
#endif
}

}  // namespace HWY_NAMESPACE
}  // namespace mray::simd
HWY_AFTER_NAMESPACE();

#endif  // per target
