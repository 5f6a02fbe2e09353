// morphray devices: lists the Vulkan devices.
#include <fmt/format.h>

#include "app/backends/backends.h"
#include "app/cli/help/help_formatter.h"
#include "app/commands/commands.h"
#include "app/report/scene_report.h"
#include "tools/text/table.h"

namespace mray::app {
namespace {

constexpr std::size_t kColumns = 100;

}  // namespace

ExitCode run_devices(const Options& options, const Messages& messages) {
    check_reports({options.json});
    const std::vector<morphray::VulkanDeviceInfo> devices = vulkan_devices();
    if (!options.json.empty()) write_report(options.json, to_json(devices));
    if (takes_stdout({options.json})) return ExitCode::kOk;
    Table table({"index", "name", "type", "vulkan", "MiB", "subgroup", "usable"});
    for (const morphray::VulkanDeviceInfo& device : devices) {
        table.add({fmt::format("{}", device.index), device.name, device.type,
                   fmt::format("{}.{}", device.api_major, device.api_minor),
                   fmt::format("{}", device.memory_bytes >> 20),
                   fmt::format("{}", device.subgroup_size),
                   device.unusable.empty() ? "yes" : "no"});
    }
    std::string text = table.text();
    for (const morphray::VulkanDeviceInfo& device : devices) {
        text += fmt::format("\ndevice {}\n  driver  {}\n  uuid    {}\n", device.index,
                            device.driver, device.uuid);
        if (!device.unusable.empty())
            text += wrapped("  not usable: " + device.unusable, 4, kColumns) + '\n';
    }
    messages.print(text);
    return ExitCode::kOk;
}

}  // namespace mray::app
