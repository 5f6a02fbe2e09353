#include "app/report/crosscheck/variants.h"

#include <algorithm>

namespace mray::app {

std::size_t Variant::differing() const {
    return static_cast<std::size_t>(
        std::ranges::count_if(rows, [](const CheckRow* row) { return !row->equal(); }));
}

double Variant::trace_ms() const {
    double sum = 0;
    for (const CheckRow* row : rows) sum += row->trace_ms;
    return sum;
}

std::vector<Variant> variants_of(const CheckReport& report) {
    std::vector<Variant> variants;
    for (const CheckRow& row : report.rows) {
        const auto found = std::ranges::find(variants, row.variant(), &Variant::name);
        Variant& variant =
            found != variants.end() ? *found : variants.emplace_back(Variant{row.variant(), {}});
        variant.rows.push_back(&row);
    }
    return variants;
}

}  // namespace mray::app
