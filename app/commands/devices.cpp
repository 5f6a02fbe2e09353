// morphray devices: lists the Vulkan devices, and tests them.
#include <fmt/format.h>

#include <optional>

#include "app/backends/backends.h"
#include "app/commands/commands.h"
#include "app/report/json_parts.h"
#include "common/text/text_parts.h"

namespace mray::app {
namespace {

std::vector<std::optional<morphray::DeviceCheck>> check_all(
    const std::vector<morphray::VulkanDeviceInfo>& devices) {
    std::vector<std::optional<morphray::DeviceCheck>> checks(devices.size());
    for (std::size_t i = 0; i < devices.size(); ++i) {
        if (devices[i].unusable.empty()) checks[i] = check_device(std::to_string(devices[i].index));
    }
    return checks;
}

std::string to_json(const std::vector<morphray::VulkanDeviceInfo>& devices,
                    const std::vector<std::optional<morphray::DeviceCheck>>& checks) {
    Json json = {{"command", "devices"}};
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

std::string text_of(const morphray::VulkanDeviceInfo& device,
                    const std::optional<morphray::DeviceCheck>& check) {
    std::string text = fmt::format("device {}: {}\n", device.index, device.name);
    const auto add = [&text](const char* name, const std::string& value) {
        text += "  " + wrapped(fmt::format("{}: {}", name, value), 4, kColumns - 2) + '\n';
    };
    add("type",
        fmt::format("{}, Vulkan {}.{}, {} MiB, subgroups of {}", device.type, device.api_major,
                    device.api_minor, device.memory_bytes >> 20, device.subgroup_size));
    add("driver", device.driver);
    add("uuid", device.uuid);
    add("usable", device.unusable.empty() ? "yes" : "no: " + device.unusable);
    if (check)
        add("check",
            check->passed ? "passed, all bits are those of the CPU" : "failed: " + check->problem);
    return text;
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
    std::string text;
    for (std::size_t i = 0; i < devices.size(); ++i) text += text_of(devices[i], checks[i]);
    messages.print(text);
    return exit_code_of(checks);
}

}  // namespace mray::app
