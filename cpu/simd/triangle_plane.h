// refine_hit (common/interop/hit_rule.h) in doubles, for rays from one origin that go through a
// triangle. Where the errors of both leave no bit open the results are the same; elsewhere the
// rule is asked. Checked: lab/proofs/place.g.
#pragma once

#include <algorithm>
#include <cmath>

#include "common/interop/hit_rule.h"

namespace mray::cpu {

/// A triangle as rays from one origin see it: with n, u and v for these vectors and d a direction,
///     t = height / n.d,   weights u.d / n.d and v.d / n.d.
/// With R = |1 / n.d| and r = t_part + t_by_slant R, t is off by r of itself, and the weights by
/// weight_part + weight_by_slant R + t (weight_by_t + weight_by_rest r): both here and in pairs.
struct TrianglePlane {
    double n[3], u[3], v[3], height;
    double t_part, t_by_slant;
    double weight_part, weight_by_slant, weight_by_t, weight_by_rest;

    /// The part of t from which on its error is not known.
    static constexpr double kUnknown = 0x1p-25;

    TrianglePlane() = default;
    TrianglePlane(vec3 org, vec3 a, vec3 b, vec3 c);

    /// Sets t, u and v as refine_hit does for a rough hit whose edge functions are not 0; false
    /// where it has to. is_through: the ray is known to go through the triangle.
    bool place(vec3 dir, bool is_through, TriangleHit& hit) const;
};

inline TrianglePlane::TrianglePlane(vec3 org, vec3 a, vec3 b, vec3 c) {
    constexpr double kPairs = 0x1.1p-42;  // the rule's pairs, and doubles
    double e1[3], e2[3], s[3], size[3];
    double reach = 0, longest = 0;
    for (int k = 0; k < 3; ++k) {
        e1[k] = static_cast<double>(b[k]) - a[k];
        e2[k] = static_cast<double>(c[k]) - a[k];
        s[k] = static_cast<double>(a[k]) - org[k];
        reach = std::max(reach, std::fabs(s[k]));
        longest = std::max(longest, std::fabs(e1[k]) + std::fabs(e2[k]));
    }
    const auto cross = [](const double* p, const double* q, double* out) {
        for (int k = 0; k < 3; ++k) {
            const int i = (k + 1) % 3, j = (k + 2) % 3;
            out[k] = p[i] * q[j] - p[j] * q[i];
        }
    };
    cross(e1, e2, n);
    cross(e2, s, u);
    cross(s, e1, v);
    height = n[0] * s[0] + n[1] * s[1] + n[2] * s[2];
    double of_height = 0, of_slant = 0, widest = 0, of_widest = 0;
    for (int k = 0; k < 3; ++k) {
        const int i = (k + 1) % 3, j = (k + 2) % 3;
        size[k] = std::fabs(e1[i] * e2[j]) + std::fabs(e1[j] * e2[i]);
        of_height += size[k] * std::fabs(s[k]);
        of_slant += 2 * size[k];
        if (std::fabs(n[k]) > widest) {
            widest = std::fabs(n[k]);
            of_widest = size[k];
        }
    }
    if (height == 0 || widest == 0) {
        t_part = kUnknown;
        t_by_slant = weight_part = weight_by_slant = weight_by_t = weight_by_rest = 0;
        return;
    }
    t_part = kPairs * (of_height / std::fabs(height) + 1);
    t_by_slant = kPairs * of_slant;
    const double across = 2 * longest / widest;
    weight_by_rest = 2 * across;
    weight_by_t = 0x1p-43 * across;
    weight_part =
        across * (0x1p-44 * (reach + 4 * longest) + 0x1p-60) + kPairs * (of_widest / widest + 1);
    weight_by_slant = 0x1p-46 * (longest * reach + of_slant);
}

inline bool TrianglePlane::place(vec3 dir, bool is_through, TriangleHit& hit) const {
    const auto dot = [&](const double* p) { return p[0] * dir.x + p[1] * dir.y + p[2] * dir.z; };
    const double along = dot(n);
    if (t_part >= kUnknown || along == 0) return false;
    const double inverse = 1 / along;
    const double t = height * inverse, wb = dot(u) * inverse, wc = dot(v) * inverse;
    const double slant = std::fabs(inverse), rest = t_part + t_by_slant * slant;
    const double t_error = rest * t;
    const double error =
        weight_part + weight_by_slant * slant + t * (weight_by_t + weight_by_rest * rest);
    const auto float_of = [](double x) { return static_cast<float>(x); };
    const auto weight_of = [](double x) { return grid_weight(static_cast<float>(x)); };
    hit.t = float_of(t - t_error);
    hit.u = weight_of(wb - error);
    hit.v = weight_of(wc - error);
    is_through = is_through || (wb > error && wc > error && wb + wc < 1 - 3 * error);
    const bool is_known = is_through && t > kTiny && rest < kUnknown &&
                          hit.t == float_of(t + t_error) && hit.u == weight_of(wb + error) &&
                          hit.v == weight_of(wc + error);
    // Both may have been rounded up.
    hit.v = std::min(hit.v, 1 - hit.u);
    return is_known;
}

}  // namespace mray::cpu
