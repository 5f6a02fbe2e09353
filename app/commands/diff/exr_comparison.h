// The comparison of two OpenEXR images.
#pragma once

#include <functional>

#include "app/files/exr_reader.h"
#include "app/report/exr_diff_report.h"
#include "tools/image/compare.h"

namespace mray::app {

/// Compares all pixels of two images of one size (asserted) as bits, a few rows at a time.
/// `check` is called before each group of rows. With `image`, the second image in grey with
/// each differing pixel in the colour of its kind goes there. Throws as ExrReader does.
ExrComparison compare_exr(ExrReader& expected, ExrReader& actual,
                          const std::function<void()>& check, Image* image = nullptr);

}  // namespace mray::app
