#include "app/backends/backends.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstdlib>
#include <optional>
#include <thread>
#include <vector>

#include "app/terminal/failure.h"
#include "common/base/errors.h"

namespace mray::app {
namespace {

using namespace std::chrono_literals;

/// More than the test's own time limit for a dispatch.
constexpr auto kTimeLimit = 60s;
constexpr char kChild[] = "MORPHRAY_DEVICE_CHECK_CHILD";

bool may_start_child = false;

/// Starts `morphray devices --check` for one device, without output. Returns nothing if that fails.
std::optional<pid_t> start_child(const std::string& device) {
    std::string program = "morphray", command = "devices", option = "--check";
    char* arguments[] = {program.data(), command.data(), option.data(), nullptr};
    std::string mark = std::string(kChild) + '=' + device;
    std::vector<char*> environment;
    for (char** variable = environ; *variable != nullptr; ++variable)
        environment.push_back(*variable);
    environment.push_back(mark.data());
    environment.push_back(nullptr);
    posix_spawn_file_actions_t files;
    posix_spawn_file_actions_init(&files);
    for (const int fd : {STDOUT_FILENO, STDERR_FILENO})
        posix_spawn_file_actions_addopen(&files, fd, "/dev/null", O_WRONLY, 0);
    pid_t child = 0;
    const int result =
        ::posix_spawn(&child, "/proc/self/exe", &files, nullptr, arguments, environment.data());
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

}  // namespace

void allow_check_in_child() { may_start_child = true; }

bool is_check_child() { return std::getenv(kChild) != nullptr; }

morphray::DeviceCheck check_device(const std::string& device) {
    return call_library([&] {
        if (is_check_child()) return morphray::check_vulkan_device(std::getenv(kChild));
        const std::optional<pid_t> child = may_start_child ? start_child(device) : std::nullopt;
        if (!child) return morphray::check_vulkan_device(device);
        const std::string end = wait_for(*child);
        if (!end.empty()) return morphray::keep_lost_device(device, end);
        const std::optional<morphray::DeviceCheck> kept = morphray::kept_device_check(device);
        // Without a folder to keep it in, the result is this process's own.
        return kept ? *kept : morphray::check_vulkan_device(device);
    });
}

void require_sound_device(const std::string& device) {
    const morphray::DeviceCheck check = call_library([&] {
        const std::optional<morphray::DeviceCheck> kept = morphray::kept_device_check(device);
        return kept ? *kept : check_device(device);
    });
    if (check.passed) return;
    throw Error(check.code == morphray::ErrorCode::device_lost ? ErrorKind::kDeviceLost
                                                               : ErrorKind::kUnavailable,
                check.problem);
}

}  // namespace mray::app
