// Exact integers of 192 bits in two's complement, for the signs of determinants whose floats do not
// suffice. Rare: they are written for shortness, not for speed.
#ifndef COMMON_INTEROP_EXACT_INTEGER_H
#define COMMON_INTEROP_EXACT_INTEGER_H

#include "common/interop/platform.h"

SHARED_BEGIN

SHARED_CONST uint kIntegerWords = 6u;

/// The lowest word first.
struct ExactInteger {
    uint word[6];
};

/// x * 2^40, for |x| < 2^22 on the coordinate grid (multiples of 2^-40).
SHARED ExactInteger exact_coordinate(float x) {
    uint bits = floatBitsToUint(x);
    uint exponent = (bits >> 23u) & 255u;
    // x = mantissa * 2^(exponent - 150), so x * 2^40 = mantissa * 2^(exponent - 110).
    uint mantissa = (bits & 0x7FFFFFu) | 0x800000u;
    uint low = 0u;
    uint high = 0u;
    if (exponent >= 110u) {
        uint shift = exponent - 110u;
        if (shift >= 32u) {
            high = mantissa << (shift - 32u);
        } else {
            low = mantissa << shift;
            high = shift == 0u ? 0u : mantissa >> (32u - shift);
        }
    } else if (exponent > 86u) {
        low = mantissa >> (110u - exponent);
    }
    bool is_negative = (bits >> 31u) != 0u;
    if (is_negative) {
        low = ~low + 1u;
        high = ~high + (low == 0u ? 1u : 0u);
    }
    ExactInteger n;
    n.word[0] = low;
    n.word[1] = high;
    uint sign = (high >> 31u) != 0u ? 0xFFFFFFFFu : 0u;
    for (uint i = 2u; i < kIntegerWords; ++i) n.word[i] = sign;
    return n;
}

/// a - b.
SHARED ExactInteger exact_difference(ExactInteger a, ExactInteger b) {
    ExactInteger n;
    uint borrow = 0u;
    for (uint i = 0u; i < kIntegerWords; ++i) {
        uint once = a.word[i] - b.word[i];
        uint twice = once - borrow;
        borrow = (a.word[i] < b.word[i] || once < borrow) ? 1u : 0u;
        n.word[i] = twice;
    }
    return n;
}

/// a + b.
SHARED ExactInteger exact_sum(ExactInteger a, ExactInteger b) {
    ExactInteger n;
    uint carry = 0u;
    for (uint i = 0u; i < kIntegerWords; ++i) {
        uint once = a.word[i] + b.word[i];
        uint twice = once + carry;
        carry = (once < a.word[i] || twice < once) ? 1u : 0u;
        n.word[i] = twice;
    }
    return n;
}

/// a * b modulo 2^192, which is a * b where that fits.
SHARED ExactInteger exact_product(ExactInteger a, ExactInteger b) {
    ExactInteger n;
    for (uint i = 0u; i < kIntegerWords; ++i) n.word[i] = 0u;
    for (uint i = 0u; i < kIntegerWords; ++i) {
        uint carry = 0u;
        for (uint k = 0u; i + k < kIntegerWords; ++k) {
            uint high;
            uint low;
            multiply_extended(a.word[i], b.word[k], high, low);
            // high * 2^32 + low + carry + word is less than 2^64.
            uint sum = low + carry;
            high += sum < carry ? 1u : 0u;
            uint word = n.word[i + k] + sum;
            high += word < sum ? 1u : 0u;
            n.word[i + k] = word;
            carry = high;
        }
    }
    return n;
}

/// -1, 0 or 1.
SHARED int exact_sign(ExactInteger n) {
    if ((n.word[kIntegerWords - 1u] >> 31u) != 0u) return -1;
    uint any = 0u;
    for (uint i = 0u; i < kIntegerWords; ++i) any |= n.word[i];
    return any != 0u ? 1 : 0;
}

SHARED_END

#endif  // COMMON_INTEROP_EXACT_INTEGER_H
