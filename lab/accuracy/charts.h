// The charts of `morphray chart`: tables of what methods measure, and figures of them.
#pragma once

#include "lab/accuracy/chart_methods.h"
#include "report/plot.h"
#include "report/table.h"

namespace mray::lab {

struct ChartFigure {
    /// The name of its files without an ending.
    std::string name;
    plot::Figure figure;
    /// Sentences for below it.
    std::vector<std::string> notes;
};

struct Chart {
    /// The name of the CSV file without its ending.
    std::string name;
    Table table;
    std::vector<ChartFigure> figures;
};

struct ChartContext {
    const Effort& effort;
    std::vector<ChartDevice> devices;
    /// Of all figures: machine, instruction set, threads, devices, versions, command.
    std::string details;
    /// Called for each part of the work that is done; count_steps() of them in all.
    std::function<void()> done;
};

/// How many steps all charts of these scenes take.
std::size_t count_steps(const Effort& effort, std::span<const ChartInput> inputs);

/// Which of these methods is the fastest, or that they are disturbed or not told apart: their
/// quartiles overlap. They begin with the fastest median.
std::string ranking(std::span<const ChartPoint> sorted);
/// What the first figure shows of camera rays, which these points are of.
std::string accuracy_title(const std::vector<ChartPoint>& points);

/// Speed against wrong answers, of some methods and of all, and against the error of t, for each
/// kind of rays: "speed_accuracy", "accuracy" and "errors", all ending in `suffix`.
Chart accuracy_chart(const ChartContext& context, const ChartInput& input,
                     const std::string& suffix);
/// Camera rays, and rays at vertices and edges, over the frames of an animation, by our packets
/// over a tree that is refitted, restructured, rebuilt or kept by the policy auto, and by the
/// packets of 2007 over their own, refitted or rebuilt: speed, time and wrong answers of each
/// frame. `input` has at least two frames.
Chart deformation_chart(const ChartContext& context, const ChartInput& input,
                        const std::string& suffix);
/// Wrong answers of methods on failure scenes: the program's own ones and `more`.
Chart failure_chart(const ChartContext& context, const std::vector<ChartInput>& more);

}  // namespace mray::lab
