// Based on: F. J. Damerau. A technique for computer detection and correction of spelling errors.
// CACM 7(3), 1964, in the restricted form (optimal string alignment).
#include "common/text/nearest_name.h"

#include <algorithm>
#include <vector>

namespace mray {
namespace {

// No name is as long; it bounds the work.
constexpr std::size_t kLongest = 64;

}  // namespace

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
    text = text.substr(0, kLongest);
    const auto nearest = std::min_element(
        names.begin(), names.end(), [text](const std::string& a, const std::string& b) {
            return edit_distance(text, a) < edit_distance(text, b);
        });
    return nearest == names.end() ? std::string() : *nearest;
}

std::string similar_name(std::string_view text, std::span<const std::string> names) {
    if (text.size() > kLongest || names.empty()) return {};
    const std::string nearest = nearest_name(text, names);
    const std::size_t most = std::max<std::size_t>(1, text.size() / 2);
    return edit_distance(text, nearest) <= most ? nearest : std::string();
}

std::string suggestion(std::string_view text, std::span<const std::string> names) {
    const std::string similar = similar_name(text, names);
    return similar.empty() ? similar : "; did you mean " + similar + "?";
}

}  // namespace mray
