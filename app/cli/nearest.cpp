// Based on: F. J. Damerau. A technique for computer detection and correction of spelling errors.
// CACM 7(3), 1964, in the restricted form (optimal string alignment).
#include "app/cli/nearest.h"

#include <algorithm>
#include <vector>

namespace morphray::app {

std::size_t edit_distance(std::string_view a, std::string_view b) {
    std::vector<std::size_t> before_last(b.size() + 1), last(b.size() + 1), row(b.size() + 1);
    for (std::size_t j = 0; j <= b.size(); ++j) row[j] = j;
    for (std::size_t i = 1; i <= a.size(); ++i) {
        before_last.swap(last);
        last.swap(row);
        row[0] = i;
        for (std::size_t j = 1; j <= b.size(); ++j) {
            const bool same = a[i - 1] == b[j - 1];
            row[j] = std::min({last[j] + 1, row[j - 1] + 1, last[j - 1] + (same ? 0u : 1u)});
            if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1]) {
                row[j] = std::min(row[j], before_last[j - 2] + 1);
            }
        }
    }
    return row[b.size()];
}

std::string nearest_name(std::string_view text, std::span<const std::string> names) {
    // Nobody types a whole screen of a name; what is longer is not near any.
    if (text.size() > 64) return {};
    std::string best;
    std::size_t best_distance = std::max<std::size_t>(1, text.size() / 2) + 1;
    for (const std::string& name : names) {
        const std::size_t distance = edit_distance(text, name);
        if (distance < best_distance) {
            best_distance = distance;
            best = name;
        }
    }
    return best;
}

}  // namespace morphray::app
