// Binary floats of few digits and any exponent, rounded to nearest even: small enough to try all.
#ifndef PROOFS_SMALL_FLOAT_H
#define PROOFS_SMALL_FLOAT_H

#include <bit>
#include <cstdint>

namespace mray::proofs {

/// A float of kDigits binary digits, held in a double. A result is right as long as the double's
/// own result is exact: sums of values not more than 2^(53 - 2 kDigits) apart, products.
template <int kDigits>
struct SmallFloat {
    double value = 0;

    SmallFloat() = default;
    explicit SmallFloat(double v) : value(v) {}

    /// Veltkamp's constant: it splits the digits into two halves, as 4097 splits 24.
    static SmallFloat splitter() { return SmallFloat((1 << ((kDigits + 1) / 2)) + 1); }

    static SmallFloat rounded(double exact) {
        constexpr int kDropped = 53 - kDigits;
        std::uint64_t bits = std::bit_cast<std::uint64_t>(exact);
        bits += (std::uint64_t{1} << (kDropped - 1)) - 1 + ((bits >> kDropped) & 1);
        bits &= ~((std::uint64_t{1} << kDropped) - 1);
        return SmallFloat(std::bit_cast<double>(bits));
    }

    friend SmallFloat operator+(SmallFloat a, SmallFloat b) { return rounded(a.value + b.value); }
    friend SmallFloat operator-(SmallFloat a, SmallFloat b) { return rounded(a.value - b.value); }
    friend SmallFloat operator*(SmallFloat a, SmallFloat b) { return rounded(a.value * b.value); }
    friend bool operator==(SmallFloat a, SmallFloat b) { return a.value == b.value; }
};

}  // namespace mray::proofs

#endif  // PROOFS_SMALL_FLOAT_H
