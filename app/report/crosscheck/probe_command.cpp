#include "app/report/crosscheck/probe_command.h"

#include <fmt/format.h>

#include <vector>

#include "common/report/shell_text.h"

namespace mray::app {

std::string probe_command(const Options& options, const CheckRow& row, const PixelDifference& pixel,
                          double build_at, bool reference) {
    std::vector<std::string> line = {"morphray", "probe", options.scene};
    const auto add = [&line](const char* name, const std::string& value) {
        line.insert(line.end(), {name, value});
    };
    add("--frame", fmt::format("{}", row.frame));
    add("--pixel", fmt::format("{},{}", pixel.x, pixel.y));
    add("--size", fmt::format("{}x{}", options.view.width, options.view.height));
    add("--rays", row.rays);
    // Pairs of a name and a value; probe refuses those that have no effect on these rays.
    const std::vector<std::string> viewed = scene_view_arguments(options);
    for (std::size_t i = 0; i + 1 < viewed.size(); i += 2) {
        const std::string& name = viewed[i];
        if (name.starts_with("--ao-") && row.rays != "ao") continue;
        if (name == "--light" && row.rays != "shadow") continue;
        add(name.c_str(), viewed[i + 1]);
    }
    if (options.allow_empty) line.push_back("--allow-empty");
    if (options.lenient) line.push_back("--lenient");
    const std::string& backend = reference ? row.reference : row.backend;
    add("--backend", backend);
    if (backend == "cpu") add("--simd", reference || row.simd.empty() ? "off" : row.simd);
    add("--update", reference ? "rebuild" : row.update);
    if (!reference && row.update == "refit") {
        add("--refit-on", row.refit_on);
        add("--build-at", fmt::format("{}", build_at));
    }
    const std::string& device = row.device.empty() ? options.backend.device : row.device;
    const bool on_device = row.backend == "vulkan" || row.refit_on == "vulkan";
    if (!reference && on_device && !device.empty()) add("--device", device);
    return shell_line(line);
}

}  // namespace mray::app
