// The result of `trace`.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "app/base/options.h"
#include "app/report/report_head.h"
#include "morphray/geometry.hpp"

namespace mray::app {

/// Gathers the hits of rays as text, JSON or records of numpy.
class RayHits {
public:
    /// `has_all`: rays have any number of hits, which text and JSON count; otherwise at most one.
    RayHits(AnswerForm form, bool has_all) : form_(form), has_all_(has_all) {}

    /// Adds the next ray. Its hits' t are those of a ray whose direction was divided by
    /// 2^exponent; `left_out` hits more are not among them.
    void add(std::span<const morphray::Hit> hits, int exponent, std::uint64_t left_out = 0);

    std::uint64_t ray_count() const { return ray_count_; }
    /// The hits that are left out, and the rays that lack some.
    std::uint64_t left_out() const { return left_out_; }
    std::uint64_t cut_rays() const { return cut_rays_; }

    /// Returns the whole file. The head, the frame and the crossing are for JSON.
    std::string file(const ReportHead& head, double frame, morphray::Crossing crossing) const;

private:
    AnswerForm form_;
    bool has_all_;
    /// Lines, rows or bytes.
    std::string text_;
    std::uint64_t ray_count_ = 0;
    std::uint64_t left_out_ = 0;
    std::uint64_t cut_rays_ = 0;
};

}  // namespace mray::app
