#include "lab/bench/machine.h"

#include <fmt/format.h>

#include <fstream>
#include <set>
#include <sstream>
#include <thread>

#include "common/text/number_text.h"
#include "common/text/text_parts.h"

namespace mray::bench {
namespace {

struct Cpu {
    std::string model_name;
    std::string family;
    std::string model;
    std::set<std::string> flags;
};

// The first processor of /proc/cpuinfo.
Cpu read_cpu() {
    Cpu cpu;
    std::ifstream file("/proc/cpuinfo");
    for (std::string line; std::getline(file, line) && !line.empty();) {
        const std::size_t colon = line.find(':');
        if (colon == std::string::npos || colon + 2 > line.size()) continue;
        const std::string key = line.substr(0, line.find_last_not_of(" \t:", colon) + 1);
        const std::string value = line.substr(colon + 2);
        if (key == "model name") cpu.model_name = value;
        if (key == "cpu family") cpu.family = value;
        if (key == "model") cpu.model = value;
        std::istringstream words(value);
        for (std::string word; key == "flags" && words >> word;) cpu.flags.insert(word);
    }
    return cpu;
}

// Model names of virtual machines may say no more than "AMD EPYC".
std::string microarchitecture(const Cpu& cpu) {
    if (!cpu.model_name.starts_with("AMD")) return "";
    if (cpu.family == "26") return "zen5";
    if (cpu.family != "25") return "";
    const std::int64_t model = parse_integer(cpu.model).value_or(0);
    return (model >= 0x10 && model < 0x20) || model >= 0x60 ? "zen4" : "zen3";
}

// Lower case, one dash for each run of anything else.
std::string slug(const std::string& text) {
    std::string result;
    for (const char c : lower_case(text)) {
        if ((c >= 'a' && c <= 'z') || (c >= '0' && c <= '9')) {
            result.push_back(c);
        } else if (!result.empty() && result.back() != '-') {
            result.push_back('-');
        }
    }
    while (result.ends_with('-')) result.pop_back();
    return result;
}

}  // namespace

std::string machine_name() {
    const Cpu cpu = read_cpu();
    const std::string name = cpu.model_name.empty() ? "unknown" : cpu.model_name;
    const std::string family = cpu.family.empty() ? "" : "family" + cpu.family;
    const std::string model = cpu.model.empty() ? "" : "model" + cpu.model;
    return slug(fmt::format("{} {} {} {} {}c", name, microarchitecture(cpu), family, model,
                            std::thread::hardware_concurrency()));
}

std::string machine_isa() {
    const Cpu cpu = read_cpu();
    if (cpu.flags.contains("avx512f")) return "AVX-512";
    if (cpu.flags.contains("avx2")) return "AVX2";
    return cpu.flags.contains("sse4_1") ? "SSE4.1" : "";
}

}  // namespace mray::bench
