#include "tools/plot/bars.h"

namespace mray::plot {
namespace {

/// The part of a row's height that its bars take.
constexpr double kFilled = 0.76;

}  // namespace

void add_bars(Panel& panel, const std::string& name, const std::vector<Bar>& bars,
              const std::string& note) {
    const auto row = static_cast<double>(panel.y.names.size());
    panel.y.names.push_back(name);
    const double height = kFilled / static_cast<double>(bars.size());
    double top = row - kFilled / 2;
    for (const Bar& bar : bars) {
        panel.rectangles.push_back({{0, top}, {bar.length, top + height}, bar.colour});
        top += height;
    }
    // Notes take the place on the right.
    panel.legend = Legend::kAbove;
    panel.row_notes.push_back({row, note});
}

}  // namespace mray::plot
