// Shell commands, and arguments as text for a shell.
#pragma once

#include <fmt/format.h>
#include <sys/wait.h>

#include <cstdio>
#include <span>
#include <string>

namespace mray {

struct ShellResult {
    /// The command's exit status; -1 if it did not start or was ended by a signal.
    int status = -1;
    std::string text;
};

inline ShellResult run_shell(const std::string& command) {
    ShellResult result;
    std::FILE* const pipe = popen(command.c_str(), "r");
    if (pipe == nullptr) return result;
    char buffer[65536];
    for (std::size_t n; (n = std::fread(buffer, 1, sizeof buffer, pipe)) > 0;)
        result.text.append(buffer, n);
    const int status = pclose(pipe);
    result.status = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
    return result;
}

/// The argument as it is, or in single quotes if the shell would interpret it.
inline std::string shell_quoted(const std::string& argument) {
    constexpr const char* kPlain =
        "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-+=./:,@%";
    if (!argument.empty() && argument.find_first_not_of(kPlain) == std::string::npos)
        return argument;
    std::string quoted = "'";
    for (const char c : argument) quoted += c == '\'' ? "'\\''" : std::string(1, c);
    return quoted + "'";
}

inline std::string shell_line(std::span<const std::string> arguments) {
    std::string line;
    for (const std::string& argument : arguments) {
        if (!line.empty()) line += ' ';
        line += shell_quoted(argument);
    }
    return line;
}

}  // namespace mray
