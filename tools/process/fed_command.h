// Runs a program that reads what it is given.
#pragma once

#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace mray {

/// Whether a program of this name is on the PATH.
bool is_on_path(const std::string& program);

/// Writes the bytes to the program; false if it no longer reads.
using Feed = std::function<bool(std::span<const std::byte>)>;

/// Runs a program of the PATH with its arguments, without a shell, and waits for it. Its standard
/// input is what `write` gives to its argument; its output is not shown.
/// Returns its exit status, or -1 if a signal ended it; nothing if it cannot be started. If `write`
/// throws, ends the program and throws that.
std::optional<int> run_fed(const std::vector<std::string>& arguments,
                           const std::function<void(const Feed&)>& write);

}  // namespace mray
