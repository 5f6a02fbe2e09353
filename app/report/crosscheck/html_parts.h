// Parts of the page of a cross-check.
#pragma once

#include <cstddef>
#include <set>
#include <string>

#include "app/base/options.h"
#include "app/report/crosscheck/check_report.h"

namespace mray::app {

/// The text of <style>, for light and dark screens and for phones.
extern const char* const kPageStyle;
/// The text of <script>: slider, flicker and copy buttons. The page can be read without it.
extern const char* const kPageScript;

/// Room of a page for what differs.
struct PageRoom {
    /// Comparisons that are described.
    std::size_t rows = 100;
    /// Comparisons with images, and their bytes as PNG files.
    std::size_t images = 8;
    std::size_t image_bytes = std::size_t{9} << 18;  // 3 MiB in base 64
};

/// A scene in the page; `index` makes its ids unique. The options are those of the scene.
struct ScenePart {
    const Options& options;
    const CheckReport& report;
    std::size_t index;
};

/// " (t)" if all differing pixels of an image are of this kind, which the image may not show; empty
/// if there are several kinds.
std::string single_kind(const FrameDifference& difference);

/// The id of a row's description.
std::string row_id(const ScenePart& scene, std::size_t row);

/// Describes the differences row after row. Subtracts what it uses from `room`, and adds the
/// indices of described rows to `shown`.
std::string differences_html(const ScenePart& scene, PageRoom& room, std::set<std::size_t>& shown);

/// The table of variants, frames and kinds of rays, with links to the rows that are described.
std::string matrix_html(const ScenePart& scene, const std::set<std::size_t>& shown);

}  // namespace mray::app
