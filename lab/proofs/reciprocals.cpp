// The relative errors of rcp and rsqrt (common/interop/arithmetic.h), by trying every float.
//
//   bounds       |rcp(x) - 1/x| <= kRcpUlp ulp(1/x), 2^-126 <= |x| < 2^102
//                |rsqrt(x) - 1/sqrt(x)| <= kRsqrtUlp ulp(1/sqrt(x)), 2^-100 <= x <= 2^100
//                255 sqrt(c) rounds as encode_channel(c), kRootMargin off the middle, 0 <= c <= 1
//   constants    kRcpUlp, kRsqrtUlp (lab/proofs/bounds.h), used by depth.g, boxes.g and
//                surface_offset.g; kRootMargin (cpu/simd/rounding_bounds.h)
//   domain       rcp's last correction is y e2 with y > 2^-102 and e2 a multiple of 2^-24: no
//                denormal. Beyond 2^102 it may be one, and devices may differ. Arguments reach 2^93
//                (the divisor of weighted_hit)
//   method       every mantissa of one binade (rcp) or two (rsqrt) against the exact inverse; every
//                other binade (every second, for rsqrt) has the same mantissas bit for bit;
//                every c from 2^-20 on, below which both round to 0
//
// Without arguments: whether the bounds hold. With "tight": whether both fail 0.005 below.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <string_view>

#include "common/interop/arithmetic.h"
#include "common/interop/shading.h"
#include "cpu/simd/rounding_bounds.h"
#include "lab/proofs/bounds.h"

namespace mray::proofs {
namespace {

constexpr std::uint32_t kOne = 0x3F800000u;
constexpr std::uint32_t kMantissas = 1u << 23;

/// 2^k as a float, -126 <= k <= 127.
float power_of_two(int k) { return uintBitsToFloat(static_cast<std::uint32_t>(127 + k) << 23); }

/// In ulp of 1/x. y x has 48 bits, and so has its difference from 1: doubles hold both exactly, and
/// (y x - 1) / x rounds by 2^-52 of itself.
double worst_rcp() {
    double worst = 0;
    for (std::uint32_t mantissa = 0; mantissa < kMantissas; ++mantissa) {
        const float x = uintBitsToFloat(kOne | mantissa);
        const double error = (static_cast<double>(rcp(x)) * x - 1.0) / x;
        const double ulp = mantissa == 0 ? 0x1p-23 : 0x1p-24;  // of 1/x, in [1/2, 1]
        worst = std::fmax(worst, std::fabs(error) / ulp);
    }
    return worst;
}

/// In ulp of 1/sqrt(x). That comes from long doubles, which are off by some 2^-63 of it.
double worst_rsqrt() {
    long double worst = 0;
    for (std::uint32_t bits = kOne; bits < kOne + 2 * kMantissas; ++bits) {
        const float x = uintBitsToFloat(bits);
        const long double exact = 1.0L / std::sqrt(static_cast<long double>(x));
        const long double ulp = bits == kOne ? 0x1p-23L : 0x1p-24L;  // in [1/2, 1]
        worst = std::fmax(worst, std::fabs(rsqrt(x) - exact) / ulp);
    }
    return static_cast<double>(worst);
}

/// Whether f(x 2^(power k)) is first(x) 2^-k for every x of `power` binades and every k of a range.
template <class Function, class First>
bool scales(Function f, First first, int power, int least, int most) {
    std::uint32_t different = 0;
    for (int k = least; k <= most; ++k) {
        const float up = power_of_two(power * k);
        const float down = power_of_two(-k);
        for (std::uint32_t i = 0; i < static_cast<std::uint32_t>(power) * kMantissas; ++i) {
            const float x = uintBitsToFloat(kOne + i);
            different |= floatBitsToUint(f(x * up)) ^ floatBitsToUint(first(x) * down);
        }
    }
    return different == 0;
}

/// Whether colours_of() of cpu/image/pixel_shader.cpp rounds every channel as encode_channel().
bool roots_round(float margin) {
    for (std::uint32_t bits = floatBitsToUint(0x1p-20f); bits <= kOne; ++bits) {
        const float c = uintBitsToFloat(bits);
        const float scaled = std::sqrt(c) * 255.0f;
        const float rounded = (scaled + 0x1p23f) - 0x1p23f;
        const bool is_certain = std::fabs(scaled - rounded) < 0.5f - margin;
        if (is_certain && encode_channel(c) != static_cast<std::uint32_t>(rounded)) return false;
    }
    return true;
}

bool check(const char* what, bool holds) {
    std::printf("%s: %s\n", holds ? "holds" : "fails", what);
    return holds;
}

}  // namespace
}  // namespace mray::proofs

int main(int argc, char** argv) {
    using namespace mray;
    using namespace mray::proofs;
    const double rcp_ulp = worst_rcp();
    const double rsqrt_ulp = worst_rsqrt();
    std::printf("rcp: %.6f ulp, rsqrt: %.6f ulp\n", rcp_ulp, rsqrt_ulp);
    if (argc > 1 && std::string_view(argv[1]) == "tight") {
        constexpr double kSpare = 0.005;
        const bool any_holds =
            rcp_ulp <= kRcpUlp - kSpare || rsqrt_ulp <= kRsqrtUlp - kSpare || roots_round(0);
        return any_holds ? 1 : 0;
    }
    const auto negative = [](float x) { return -rcp(-x); };
    const bool all_hold[] = {
        check("rcp", rcp_ulp <= kRcpUlp), check("rsqrt", rsqrt_ulp <= kRsqrtUlp),
        check("rcp has the same mantissas in every binade",
              scales(rcp, rcp, 1, -126, 101) && scales(negative, rcp, 1, -126, 101)),
        check("rsqrt has in every second binade", scales(rsqrt, rsqrt, 2, -50, 49)),
        check("square roots round channels", roots_round(cpu::kRootMargin))};
    return std::ranges::count(all_hold, false) == 0 ? 0 : 1;
}
