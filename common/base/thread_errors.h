// Exceptions of threads that cannot be started.
#pragma once

#include <exception>
#include <string_view>
#include <system_error>

namespace mray {

/// Whether the system has no more threads: std::thread throws a system_error, oneTBB a
/// runtime_error that names the call.
inline bool is_lack_of_threads(const std::exception& error) {
    if (const auto* const system = dynamic_cast<const std::system_error*>(&error))
        return system->code() == std::errc::resource_unavailable_try_again;
    return std::string_view(error.what()).starts_with("pthread_create");
}

}  // namespace mray
