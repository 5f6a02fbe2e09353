// morphray devices: lists the Vulkan devices.
#include <fmt/format.h>

#include "app/backends/backends.h"
#include "app/commands/commands.h"
#include "app/report/scene_report.h"
#include "tools/text/table.h"

namespace mray::app {

ExitCode run_devices(const Options& options, const Messages& messages) {
    check_reports({options.json});
    const std::vector<morphray::VulkanDeviceInfo> devices = vulkan_devices();
    if (!options.json.empty()) write_report(options.json, to_json(devices));
    if (takes_stdout({options.json})) return ExitCode::kOk;
    Table table({"index", "name", "type", "vulkan", "driver", "MiB", "subgroup", "uuid", "usable"});
    for (const morphray::VulkanDeviceInfo& device : devices) {
        table.add({fmt::format("{}", device.index), device.name, device.type,
                   fmt::format("{}.{}", device.api_major, device.api_minor), device.driver,
                   fmt::format("{}", device.memory_bytes >> 20),
                   fmt::format("{}", device.subgroup_size), device.uuid,
                   device.unusable.empty() ? "yes" : "no: " + device.unusable});
    }
    messages.print(table.text());
    return ExitCode::kOk;
}

}  // namespace mray::app
