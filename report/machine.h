// The machine, as reports of measurements name it.
#pragma once

#include <fmt/format.h>

#include <fstream>
#include <string>
#include <thread>

namespace mray {

/// The value of a key of the first processor in /proc/cpuinfo; empty if there is none.
inline std::string cpu_info(const std::string& key) {
    std::ifstream file("/proc/cpuinfo");
    for (std::string line; std::getline(file, line) && !line.empty();) {
        const std::size_t colon = line.find(": ");
        if (colon != std::string::npos && line.starts_with(key + '\t'))
            return line.substr(colon + 2);
    }
    return {};
}

/// The processor's name, family and model, and how many cores: names do not tell generations apart.
inline std::string machine_name() {
    return fmt::format("{}, family {}, model {}, {} cores", cpu_info("model name"),
                       cpu_info("cpu family"), cpu_info("model"),
                       std::thread::hardware_concurrency());
}

}  // namespace mray
