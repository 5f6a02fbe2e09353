#include "tools/process/fed_command.h"

#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>

#include "common/base/file_descriptor.h"
#include "common/base/write_all.h"

extern char** environ;

namespace mray {
namespace {

/// Starts the program with `input` as its standard input; -1 if that fails.
pid_t start(const std::vector<std::string>& arguments, int input) {
    std::vector<char*> argv;
    for (const std::string& argument : arguments)
        argv.push_back(const_cast<char*>(argument.c_str()));
    argv.push_back(nullptr);
    posix_spawn_file_actions_t files;
    posix_spawn_file_actions_init(&files);
    posix_spawn_file_actions_adddup2(&files, input, STDIN_FILENO);
    posix_spawn_file_actions_addopen(&files, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
    posix_spawn_file_actions_addopen(&files, STDERR_FILENO, "/dev/null", O_WRONLY, 0);
    posix_spawnattr_t attributes;
    posix_spawnattr_init(&attributes);
    sigset_t defaults;
    sigemptyset(&defaults);
    sigaddset(&defaults, SIGPIPE);
    posix_spawnattr_setsigdefault(&attributes, &defaults);
    posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGDEF);
    pid_t process = -1;
    const int error = posix_spawnp(&process, argv[0], &files, &attributes, argv.data(), environ);
    posix_spawnattr_destroy(&attributes);
    posix_spawn_file_actions_destroy(&files);
    return error == 0 ? process : -1;
}

int wait_for(pid_t process) {
    int status = 0;
    while (::waitpid(process, &status, 0) < 0 && errno == EINTR) {
    }
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

}  // namespace

bool is_on_path(const std::string& program) {
    const char* const path = std::getenv("PATH");
    std::string rest = path == nullptr ? "" : path;
    while (!rest.empty()) {
        const std::size_t colon = rest.find(':');
        const std::string folder = rest.substr(0, colon);
        rest = colon == rest.npos ? "" : rest.substr(colon + 1);
        if (!folder.empty() && ::access((folder + '/' + program).c_str(), X_OK) == 0) return true;
    }
    return false;
}

std::optional<int> run_fed(const std::vector<std::string>& arguments,
                           const std::function<void(const Feed&)>& write) {
    int ends[2];
    if (::pipe2(ends, O_CLOEXEC) != 0) return std::nullopt;
    FileDescriptor input(ends[0]);
    FileDescriptor output(ends[1]);
    const pid_t process = start(arguments, input.fd());
    input.close();
    if (process < 0) return std::nullopt;
    try {
        write([&](std::span<const std::byte> bytes) { return write_all(output.fd(), bytes) == 0; });
    } catch (...) {
        ::kill(process, SIGKILL);
        wait_for(process);
        throw;
    }
    output.close();
    return wait_for(process);
}

}  // namespace mray
