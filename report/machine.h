// The machine, as reports of measurements name it.
#pragma once

#include <fmt/format.h>

#include <fstream>
#include <string>
#include <thread>
#include <utility>

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

/// The processor's name, family and model, as far as the system tells them, and how many cores:
/// names do not tell generations apart.
inline std::string machine_name() {
    std::string text;
    for (const auto& [key, before] :
         {std::pair{"model name", ""}, {"cpu family", "family "}, {"model", "model "}})
        if (const std::string value = cpu_info(key); !value.empty())
            text += fmt::format("{}{}, ", before, value);
    return fmt::format("{}{} cores", text, std::thread::hardware_concurrency());
}

}  // namespace mray
