// product_error, difference_error and difference_of_products (common/interop/hit_rule.h) on floats
// of few digits, for all of them. The text is the code's (rule_functions.h).
//
//   bounds       product_error and difference_error are exact; difference_of_products has the sign
//                of a b - c d, 0 included, is off by at most 2 u of it, u = 2^-digits, and
//                exchanging the products negates it
//   inputs       all mantissas and 0; for products exponents do not matter; two operands of a
//                difference, and two products, up to 2^(digits + 4) apart, of either sign
//   by hand      Farther apart, the smaller one cannot be seen but in ties, as at digits + 4. That
//                24 digits behave as 4 to 12 do: T. J. Dekker 1971 and D. E. Knuth for the
//                errors, the monotony of rounding (docs/design/arithmetic.md) for signs, and
//                difference_of_products.g, which bounds the relative error at 24 digits.
//   used by      exact_edges, project, weighted_hit; project.g, depth.g
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <vector>

#include "lab/proofs/rule_functions.h"

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
namespace {

/// 0 and all floats in [1, 2).
template <int kDigits>
std::vector<SmallFloat<kDigits>> mantissas() {
    std::vector<SmallFloat<kDigits>> all = {SmallFloat<kDigits>(0)};
    for (int i = 1 << (kDigits - 1); i < 1 << kDigits; ++i)
        all.emplace_back(std::ldexp(i, 1 - kDigits));
    return all;
}

bool report(const char* what, int digits, std::size_t cases, std::size_t wrong) {
    std::printf("%s, %d digits: %zu cases, %zu wrong\n", what, digits, cases, wrong);
    return wrong == 0 && cases > 0;
}

template <int kDigits>
bool product_errors_are_exact() {
    const auto all = mantissas<kDigits>();
    std::size_t wrong = 0;
    for (const auto a : all) {
        for (const auto b : all) {
            const auto p = a * b;
            wrong += product_error(a, b, p).value != a.value * b.value - p.value;
        }
    }
    return report("product_error", kDigits, all.size() * all.size(), wrong);
}

/// Calls visit(scale) for the powers of two up to 2^apart and their reciprocals, of either sign.
template <class Visit>
void for_each_scale(int apart, Visit visit) {
    for (int k = -apart; k <= apart; ++k)
        for (const double scale : {std::ldexp(1.0, k), -std::ldexp(1.0, k)}) visit(scale);
}

/// Calls is_wrong(a, b) for all pairs up to 2^(digits + 4) apart, of either sign.
template <int kDigits, class IsWrong>
bool holds_for_pairs(const char* what, IsWrong is_wrong) {
    const auto all = mantissas<kDigits>();
    std::size_t wrong = 0;
    std::size_t cases = 0;
    for_each_scale(kDigits + 4, [&](double scale) {
        for (const auto a : all)
            for (const auto b : all) wrong += is_wrong(a, SmallFloat<kDigits>(b.value * scale));
        cases += all.size() * all.size();
    });
    return report(what, kDigits, cases, wrong);
}

template <int kDigits>
bool difference_errors_are_exact() {
    using Float = SmallFloat<kDigits>;
    return holds_for_pairs<kDigits>("difference_error", [](Float a, Float b) {
        const Float d = a - b;
        return difference_error(a, b, d).value != a.value - b.value - d.value;
    });
}

template <int kDigits>
bool is_wrong_for(SmallFloat<kDigits> a, SmallFloat<kDigits> b, SmallFloat<kDigits> c,
                  SmallFloat<kDigits> d) {
    const double exact = a.value * b.value - c.value * d.value;
    const double result = difference_of_products(a, b, c, d).value;
    const double mirrored = difference_of_products(c, d, a, b).value;
    const double error = std::ldexp(std::fabs(result - exact), kDigits);
    return (result > 0) != (exact > 0) || (result < 0) != (exact < 0) || mirrored != -result ||
           error > 2 * std::fabs(exact);
}

/// All factors; the left product times 2^k for |k| <= apart, of either sign. a <= b and c <= d are
/// enough where product_error is exact and so symmetric.
template <int kDigits>
bool products_have_signs(int apart) {
    const auto all = mantissas<kDigits>();
    std::size_t cases = 0;
    std::size_t wrong = 0;
    for_each_scale(apart, [&](double scale) {
        for (std::size_t i = 0; i < all.size(); ++i) {
            const SmallFloat<kDigits> a(all[i].value * scale);
            for (std::size_t j = i; j < all.size(); ++j)
                for (std::size_t n = 0; n < all.size(); ++n)
                    for (std::size_t m = n; m < all.size(); ++m, ++cases)
                        wrong += is_wrong_for<kDigits>(a, all[j], all[n], all[m]);
        }
    });
    return report("difference_of_products", kDigits, cases, wrong);
}

/// The comparison of weighted_hit.
template <int kDigits>
bool small_ranges_are_beyond_zero() {
    using Float = SmallFloat<kDigits>;
    return holds_for_pairs<kDigits>("range < size", [](Float a, Float b) {
        const double nearest = std::fmin(a.value, b.value);
        const double farthest = std::fmax(a.value, b.value);
        const double range = (Float(farthest) - Float(nearest)).value;
        const double size = std::fmax(std::fabs(nearest), std::fabs(farthest));
        return range < size && !(nearest > 0 || farthest < 0);
    });
}

}  // namespace
}  // namespace mray::proofs

int main() {
    using namespace mray::proofs;
    const std::vector<bool> hold = {
        product_errors_are_exact<4>(),     product_errors_are_exact<6>(),
        product_errors_are_exact<8>(),     product_errors_are_exact<12>(),
        difference_errors_are_exact<4>(),  difference_errors_are_exact<5>(),
        difference_errors_are_exact<8>(),  small_ranges_are_beyond_zero<4>(),
        small_ranges_are_beyond_zero<8>(), products_have_signs<4>(8),
        products_have_signs<6>(10),        products_have_signs<7>(4)};
    return std::ranges::count(hold, false) == 0 ? 0 : 1;
}
