// The comparisons of a cross-check, grouped by variant.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "app/report/crosscheck/check_report.h"

namespace mray::app {

/// The comparisons of a backend and tree.
struct Variant {
    std::string name;
    std::vector<const CheckRow*> rows;

    std::size_t differing() const;
    double trace_ms() const;
};

/// The variants in the order of their first comparison. The report outlives them.
std::vector<Variant> variants_of(const CheckReport& report);

}  // namespace mray::app
