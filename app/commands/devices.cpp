// morphray devices: lists the Vulkan devices, and tests them.
#include <fmt/format.h>

#include <optional>

#include "app/backends/backends.h"
#include "app/cli/command_line.h"
#include "app/commands/commands.h"
#include "app/report/json_parts.h"
#include "common/report/table.h"

namespace mray::app {
namespace {

constexpr std::size_t kColumns = 100;

/// The result of each device that can be used.
std::vector<std::optional<morphray::DeviceCheck>> check_all(
    const std::vector<morphray::VulkanDeviceInfo>& devices) {
    std::vector<std::optional<morphray::DeviceCheck>> checks(devices.size());
    for (std::size_t i = 0; i < devices.size(); ++i) {
        if (devices[i].unusable.empty()) checks[i] = check_device(std::to_string(devices[i].index));
    }
    return checks;
}

/// `checks` has the result of each device that was tested.
std::string to_json(const std::vector<morphray::VulkanDeviceInfo>& devices,
                    const std::vector<std::optional<morphray::DeviceCheck>>& checks) {
    Json json = head_of("devices");
    json["devices"] = Json::array();
    for (std::size_t i = 0; i < devices.size(); ++i) {
        const morphray::VulkanDeviceInfo& device = devices[i];
        Json& part = json["devices"].emplace_back(of(device));
        part["memory_bytes"] = device.memory_bytes;
        part["subgroup_size"] = device.subgroup_size;
        part["usable"] = device.unusable.empty();
        part["unusable"] = device.unusable;
        if (!checks[i]) continue;
        part["check"] = {{"passed", checks[i]->passed}, {"problem", checks[i]->problem}};
    }
    return json_text(json);
}

ExitCode exit_code_of(const std::vector<std::optional<morphray::DeviceCheck>>& checks) {
    ExitCode code = ExitCode::kOk;
    for (const std::optional<morphray::DeviceCheck>& check : checks) {
        if (!check || check->passed) continue;
        if (check->code == morphray::ErrorCode::device_lost) return ExitCode::kDeviceLost;
        code = ExitCode::kUnavailable;
    }
    return code;
}

std::string details_of(const morphray::VulkanDeviceInfo& device,
                       const std::optional<morphray::DeviceCheck>& check) {
    std::string text = fmt::format("\ndevice {}\n  driver  {}\n  uuid    {}\n", device.index,
                                   device.driver, device.uuid);
    if (!device.unusable.empty())
        text += wrapped("  not usable: " + device.unusable, 4, kColumns) + '\n';
    if (!check) return text;
    if (check->passed) return text + "  check   passed: all bits are those of the CPU\n";
    return text + wrapped("  check   failed: " + check->problem, 4, kColumns) + '\n';
}

}  // namespace

ExitCode run_command(const DevicesOptions& options, const Messages& messages) {
    if (options.checks && is_check_child()) return exit_code_of({check_device({})});
    check_reports({options.json});
    const std::vector<morphray::VulkanDeviceInfo> devices = vulkan_devices();
    std::vector<std::optional<morphray::DeviceCheck>> checks(devices.size());
    if (options.checks) checks = check_all(devices);
    if (!options.json.empty()) write_report(options.json, to_json(devices, checks));
    if (takes_stdout({options.json})) return exit_code_of(checks);
    Table table({"index", "name", "type", "vulkan", "MiB", "subgroup", "usable"});
    for (const morphray::VulkanDeviceInfo& device : devices) {
        table.add({fmt::format("{}", device.index), device.name, device.type,
                   fmt::format("{}.{}", device.api_major, device.api_minor),
                   fmt::format("{}", device.memory_bytes >> 20),
                   fmt::format("{}", device.subgroup_size),
                   device.unusable.empty() ? "yes" : "no"});
    }
    std::string text = table.text();
    for (std::size_t i = 0; i < devices.size(); ++i) text += details_of(devices[i], checks[i]);
    messages.print(text);
    return exit_code_of(checks);
}

}  // namespace mray::app
