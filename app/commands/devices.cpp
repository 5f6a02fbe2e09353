// morphray devices: lists the Vulkan devices, and tests them.
#include "app/animation/devices.h"
#include "app/commands/commands.h"
#include "app/report/json_parts.h"

namespace mray::app {
namespace {

Json json_of(const morphray::VulkanDeviceInfo& device,
             const std::optional<morphray::DeviceCheck>& check) {
    Json json = of(device);
    json["memory_bytes"] = device.memory_bytes;
    json["subgroup_size"] = device.subgroup_size;
    json["usable"] = device.unusable.empty();
    json["unusable"] = device.unusable;
    if (check)
        json["check"] = {
            {"passed", check->passed}, {"problem", check->problem}, {"note", check->note}};
    return json;
}

ExitCode exit_code_of(const morphray::DeviceCheck& check) {
    if (check.passed) return ExitCode::kOk;
    return check.code == morphray::ErrorCode::device_lost ? ExitCode::kDeviceLost
                                                          : ExitCode::kUnavailable;
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
    add("rounding", device.promises_rounding
                        ? "the driver promises to round as the CPU does"
                        : "the driver promises nothing, and is tested before it is used");
    add("usable", device.unusable.empty() ? "yes" : "no: " + device.unusable);
    if (check)
        add("check", check->passed ? "passed, all bits are those of the CPU" +
                                         (check->note.empty() ? "" : "; " + check->note)
                                   : "failed: " + check->problem);
    return text;
}

}  // namespace

ExitCode run_devices(const Options& options, const Messages& messages) {
    check_reports({options.json});
    Json json = {{"command", "devices"}, {"error", ""}, {"devices", Json::array()}};
    std::string text;
    Failure failure;
    std::optional<ExitCode> worst;
    attempt(failure, messages, [&] {
        for (const morphray::VulkanDeviceInfo& device : vulkan_devices()) {
            std::optional<morphray::DeviceCheck> check;
            if (options.checks && device.unusable.empty()) {
                check = check_device(std::to_string(device.index));
                worst = std::max(worst.value_or(ExitCode::kOk), exit_code_of(*check));
            }
            json["devices"].push_back(json_of(device, check));
            text += text_of(device, check);
        }
        if (options.checks && !worst)
            throw Error(ErrorKind::kUnavailable, "Vulkan: no device can be used");
    });
    json["error"] = failure.message;
    return write_reports(std::max(worst.value_or(ExitCode::kOk), failure.code), messages,
                         {{options.json, [&] { return json_text(json); }}}, [&] { return text; });
}

}  // namespace mray::app
