#include "app/base/process_memory.h"

#include <fstream>
#include <sstream>
#include <string>

namespace mray::app {
namespace {

/// The bytes that a line "key: KILOBYTES kB" of the file tells.
std::uint64_t bytes_of(const char* file, const std::string& key) {
    std::ifstream in(file);
    for (std::string line; std::getline(in, line);) {
        std::istringstream words(line);
        std::string word;
        std::uint64_t value = 0;
        if (words >> word >> value && word == key) return 1024 * value;
    }
    return 0;
}

}  // namespace

std::uint64_t peak_memory_bytes() { return bytes_of("/proc/self/status", "VmHWM:"); }

}  // namespace mray::app
