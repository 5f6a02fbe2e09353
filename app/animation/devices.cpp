#include "app/animation/devices.h"

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>

namespace mray::app {
namespace {

using namespace std::chrono_literals;

/// More than the test's own time limit for a dispatch.
constexpr auto kTimeLimit = 60s;
/// The name of a process that tests the device of its one argument.
constexpr char kChild[] = "morphray-device-check";

bool may_start_child = false;

/// Starts this program to test one device, without output. Returns nothing if that fails.
std::optional<pid_t> start_child(const std::string& device) {
    std::string name = kChild, argument = device;
    char* arguments[] = {name.data(), argument.data(), nullptr};
    posix_spawn_file_actions_t files;
    posix_spawn_file_actions_init(&files);
    for (const int fd : {STDOUT_FILENO, STDERR_FILENO})
        posix_spawn_file_actions_addopen(&files, fd, "/dev/null", O_WRONLY, 0);
    pid_t child = 0;
    const int result = ::posix_spawn(&child, "/proc/self/exe", &files, nullptr, arguments, environ);
    posix_spawn_file_actions_destroy(&files);
    return result == 0 ? std::optional(child) : std::nullopt;
}

/// Waits for a child. Returns how it ended if that was not by itself.
std::string wait_for(pid_t child) {
    const auto end = std::chrono::steady_clock::now() + kTimeLimit;
    int status = 0;
    while (::waitpid(child, &status, WNOHANG) == 0) {
        if (std::chrono::steady_clock::now() > end) {
            // A process in a driver may outlive this, and is left alone.
            ::kill(child, SIGKILL);
            return fmt::format("it did not answer within {} s", kTimeLimit.count());
        }
        std::this_thread::sleep_for(10ms);
    }
    return WIFSIGNALED(status) ? fmt::format("it ended its process by signal {}", WTERMSIG(status))
                               : "";
}

/// A Vulkan device must have passed its self-test, which is made now if no result is kept.
morphray::Device open_chosen(BackendChoice choice, const BackendOptions& options) {
    const morphray::CpuOptions cpu = {.threads = options.threads, .simd = options.simd};
    if (choice == BackendChoice::kVulkan) {
        const morphray::DeviceCheck check = call_library([&] {
            const std::optional<morphray::DeviceCheck> kept =
                morphray::kept_device_check(options.device);
            return kept ? *kept : check_device(options.device);
        });
        if (!check.passed) throw Error(kind_of(check.code), check.problem);
    }
    return call_library([&] {
        if (choice == BackendChoice::kVulkan)
            return morphray::Device::vulkan(
                {.device = options.device, .validate = options.validate});
        if (choice == BackendChoice::kBrute) return morphray::Device::brute_force(cpu);
        return morphray::Device::cpu(cpu);
    });
}

bool asks_for_vulkan(const BackendOptions& options) {
    return !options.device.empty() || options.validate;
}

bool is_lack_of_vulkan(const Error& error) {
    return error.kind() == ErrorKind::kUnavailable || error.kind() == ErrorKind::kLimit ||
           error.kind() == ErrorKind::kDeviceLost;
}

/// Whether the only usable Vulkan devices run on the CPU, where the CPU backend is faster.
bool has_only_software_devices() {
    std::vector<morphray::VulkanDeviceInfo> usable;
    try {
        usable = vulkan_devices();
    } catch (const Error& error) {
        // try_vulkan() warns of the reason.
        if (!is_lack_of_vulkan(error)) throw;
    }
    std::erase_if(usable, [](const auto& device) { return !device.unusable.empty(); });
    return !usable.empty() &&
           std::ranges::all_of(usable, [](const auto& device) { return device.type == "cpu"; });
}

/// Nothing, after a warning, if Vulkan is not available and the options do not ask for it.
std::optional<morphray::Device> try_vulkan(const BackendOptions& options,
                                           const Messages& messages) {
    try {
        return open_chosen(BackendChoice::kVulkan, options);
    } catch (const Error& error) {
        if (asks_for_vulkan(options) || !is_lack_of_vulkan(error)) throw;
        messages.warn({{}, fmt::format("{}; using the CPU instead", error.what())});
        return std::nullopt;
    }
}

}  // namespace

std::vector<morphray::VulkanDeviceInfo> vulkan_devices() {
    return call_library([] { return morphray::vulkan_devices(); });
}

morphray::Device open_device(const BackendOptions& options, const Messages& messages) {
    const auto open = [&] {
        if (options.choice != BackendChoice::kAuto) return open_chosen(options.choice, options);
        if (!asks_for_vulkan(options) && has_only_software_devices())
            messages.note("no GPU; --backend vulkan takes the device that runs on the CPU");
        else if (std::optional<morphray::Device> vulkan = try_vulkan(options, messages))
            return *vulkan;
        return open_chosen(BackendChoice::kCpu, options);
    };
    const morphray::Device device = open();
    messages.note("tracing on " + device.name() + ": " + device.description());
    return device;
}

std::vector<morphray::Device> open_devices(const BackendOptions& options,
                                           const Messages& messages) {
    if (options.choice != BackendChoice::kAuto) return {open_chosen(options.choice, options)};
    const std::optional<morphray::Device> vulkan = try_vulkan(options, messages);
    std::vector<morphray::Device> devices = {open_chosen(BackendChoice::kCpu, options)};
    if (vulkan) devices.push_back(*vulkan);
    return devices;
}

BuildConfig build_config(const BackendOptions& options) {
    return {.threads = options.threads, .watch = Watch(&interrupt_flag())};
}

bool run_check_child(int argc, char** argv) {
    may_start_child = argc > 0 && argv[0] != std::string_view(kChild);
    if (may_start_child || argc != 2) return false;
    check_device(argv[1]);
    return true;
}

morphray::DeviceCheck check_device(const std::string& device) {
    return call_library([&] {
        const std::optional<pid_t> child = may_start_child ? start_child(device) : std::nullopt;
        if (!child) return morphray::check_vulkan_device(device);
        const std::string end = wait_for(*child);
        if (!end.empty()) return morphray::keep_lost_device(device, end);
        const std::optional<morphray::DeviceCheck> kept = morphray::kept_device_check(device);
        // Without a folder to keep it in, the result is this process's own.
        return kept ? *kept : morphray::check_vulkan_device(device);
    });
}

}  // namespace mray::app
