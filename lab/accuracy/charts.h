// The charts of `morphray chart`: tables of what methods measure, and figures of them.
#pragma once

#include <utility>

#include "lab/accuracy/chart_methods.h"
#include "report/plot.h"
#include "report/table.h"

namespace mray::lab {

struct Chart {
    /// The name of the CSV file without its ending.
    std::string name;
    Table table;
    /// By the name of its files without an ending.
    std::vector<std::pair<std::string, plot::Figure>> figures;
};

struct ChartContext {
    const Effort& effort;
    std::vector<ChartDevice> devices;
    /// The text below every figure: machine, instruction set, threads, devices, versions, command.
    std::string footer;
    /// Called for each part of the work that is done; count_steps() of them in all.
    std::function<void()> done;
};

/// How many steps all charts of these scenes take.
std::size_t count_steps(const Effort& effort, std::span<const ChartInput> inputs);

/// Speed against wrong answers, and against the error of t, for each kind of rays: "accuracy" and
/// "errors", both ending in `suffix`.
Chart accuracy_chart(const ChartContext& context, const ChartInput& input,
                     const std::string& suffix);
/// Camera rays, and rays at vertices and edges, over the frames of an animation, by our packets
/// over a tree that is refitted, restructured or rebuilt, and by the packets of 2007 over their
/// own, refitted or rebuilt: speed and time of each frame, and speed against wrong answers. `input`
/// has at least two frames.
Chart deformation_chart(const ChartContext& context, const ChartInput& input,
                        const std::string& suffix);
/// Failure scenes against methods: wrong answers ("failures"), errors of t ("failures_t"), and the
/// time of a ray over that on an ordinary scene ("failures_time"). `more` are added to the
/// program's own scenes.
Chart failure_chart(const ChartContext& context, const std::vector<ChartInput>& more);

}  // namespace mray::lab
