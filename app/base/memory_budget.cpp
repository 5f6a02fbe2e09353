#include "app/base/memory_budget.h"

#include <fmt/format.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <limits>
#include <optional>
#include <sstream>
#include <thread>

#include "common/base/errors.h"
#include "common/interop/bvh_layout.h"
#include "common/text/message_text.h"

namespace mray::app {
namespace {

constexpr std::uint64_t kNoLimit = std::numeric_limits<std::uint64_t>::max();

// Measured as slopes of the most memory held over 400,000 to 1,200,000 triangles, of cloths (half
// as many vertices as triangles) and of separate triangles (three times as many).

constexpr std::uint64_t kTopologyBytesPerTriangle = 12;
// Positions in world space and in scene space.
constexpr std::uint64_t kPositionBytesPerVertex = 24;
// The caller's positions, and those that a tree is built over.
constexpr std::uint64_t kPosedBytesPerVertex = 32;
// A leaf has at most 16 triangles and at most 16 vertices, and about 10.5 of what fills it first.
constexpr std::uint64_t kLeavesPer = 2;
constexpr std::uint64_t kLeavesOf = 21;
// A leaf with its vertex numbers (388 B), and a node (452 B) for about 11.5 of them.
constexpr std::uint64_t kTreeBytesPerLeaf = 427;
// References, twice, and their order; the second references become leaves.
constexpr std::uint64_t kBuildBytesPerTriangle = 68;
constexpr std::uint64_t kReusedBytesPerTriangle = 32;
// Nodes of the binary tree, and costs of their collapse.
constexpr std::uint64_t kBuildBytesPerLeaf = 520;
constexpr std::uint64_t kBackendBytesPerVertex = 16;
// A frame (16 + 4 + 4).
constexpr std::uint64_t kBytesPerPixel = 24;
// Code, libraries, thread stacks.
constexpr std::uint64_t kFixedBytes = std::uint64_t{24} << 20;
// Mesa's lavapipe with compiled kernels; drivers of GPUs take about as much.
constexpr std::uint64_t kDeviceBytes = std::uint64_t{128} << 20;

// Address space that Mesa's lavapipe maps for an instance and a device; it crashes with less.
constexpr std::uint64_t kDriverAddressBytes = std::uint64_t{768} << 20;

std::uint64_t saturating_add(std::uint64_t a, std::uint64_t b) {
    return a > kNoLimit - b ? kNoLimit : a + b;
}

std::uint64_t saturating_multiply(std::uint64_t a, std::uint64_t b) {
    return b != 0 && a > kNoLimit / b ? kNoLimit : a * b;
}

/// A sum of products that saturates.
struct Sum {
    std::uint64_t bytes = 0;
    void add(std::uint64_t count, std::uint64_t size) {
        bytes = saturating_add(bytes, saturating_multiply(count, size));
    }
};

/// --memory-limit. It belongs to the process, as the limits of the system do.
std::optional<std::uint64_t> chosen_limit;
constexpr const char* kMemoryLimit = "--memory-limit";

std::optional<std::uint64_t> read_value(const std::string& file) {
    std::ifstream in(file);
    std::uint64_t value = 0;
    if (in >> value) return value;  // "max" means no limit
    return std::nullopt;
}

std::optional<std::uint64_t> read_keyed(const std::string& file, const std::string& key) {
    std::ifstream in(file);
    for (std::string line; std::getline(in, line);) {
        std::istringstream words(line);
        std::string word;
        std::uint64_t value = 0;
        if (words >> word >> value && word == key) return value;
    }
    return std::nullopt;
}

void tighten(MemoryLimit& limit, std::uint64_t available, const char* source) {
    if (available < limit.available_bytes) limit = {available, source};
}

// Fields of /proc/self/statm, in pages.
enum StatmField { kStatmSize = 0, kStatmData = 5 };

std::uint64_t used_bytes(StatmField field) {
    std::ifstream in("/proc/self/statm");
    std::uint64_t pages = 0;
    for (int i = 0; i <= field; ++i) in >> pages;
    return in ? pages * static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE)) : 0;
}

void apply_process_limit(MemoryLimit& limit, decltype(RLIMIT_AS) resource, StatmField used,
                         const char* source) {
    rlimit value = {};
    if (getrlimit(resource, &value) != 0 || value.rlim_cur == RLIM_INFINITY) return;
    const std::uint64_t taken = used_bytes(used);
    tighten(limit, value.rlim_cur > taken ? value.rlim_cur - taken : 0, source);
}

void apply_group(MemoryLimit& limit, const std::string& folder, const char* limit_file,
                 const char* usage_file, const char* cache_key) {
    const std::optional<std::uint64_t> most = read_value(folder + limit_file);
    if (!most) return;
    // The kernel counts cached file pages as used but gives them back under pressure.
    const std::uint64_t cache = read_keyed(folder + "memory.stat", cache_key).value_or(0);
    const std::uint64_t used = read_value(folder + usage_file).value_or(0);
    const std::uint64_t held = used > cache ? used - cache : 0;
    tighten(limit, *most > held ? *most - held : 0, "the control group's memory limit");
}

// Applies the limits of every group from the process's own up to the root. Inside a container the
// listed path may not exist; the root of the mounted hierarchy is then its own group.
void apply_control_groups(MemoryLimit& limit) {
    std::ifstream in("/proc/self/cgroup");
    for (std::string line; std::getline(in, line);) {
        const bool unified = line.starts_with("0::");
        const std::size_t colon = line.find(':', line.find(':') + 1);
        if (colon == std::string::npos) continue;
        if (!unified && line.find(":memory:") == std::string::npos) continue;
        std::string path = line.substr(colon + 1);
        for (;;) {
            if (unified) {
                apply_group(limit, "/sys/fs/cgroup" + path + "/", "memory.max", "memory.current",
                            "inactive_file");
            } else {
                apply_group(limit, "/sys/fs/cgroup/memory" + path + "/", "memory.limit_in_bytes",
                            "memory.usage_in_bytes", "total_inactive_file");
            }
            if (path.empty() || path == "/") break;
            path.erase(path.rfind('/'));
        }
    }
}

std::string in_mib(std::uint64_t bytes) {
    return fmt::format("{:.0f} MiB", std::max(1.0, static_cast<double>(bytes) / 0x1p20));
}

}  // namespace

std::uint64_t estimate_bytes(const Workload& work) {
    Sum sum;
    sum.add(work.triangles, kTopologyBytesPerTriangle);
    sum.add(work.vertices, kPositionBytesPerVertex);
    const std::uint64_t leaves =
        saturating_multiply(std::max(work.triangles, work.vertices), kLeavesPer) / kLeavesOf;
    if (work.has_tree) {
        const std::uint64_t reused =
            std::min(saturating_multiply(work.triangles, kReusedBytesPerTriangle),
                     saturating_multiply(leaves, sizeof(Leaf)));
        sum.add(work.vertices, kPosedBytesPerVertex);
        sum.add(leaves, kBuildBytesPerLeaf + kTreeBytesPerLeaf - sizeof(Leaf));
        sum.add(work.triangles, kBuildBytesPerTriangle);
        sum.add(saturating_multiply(leaves, sizeof(Leaf)) - reused, 1);
    }
    sum.add(saturating_multiply(work.copies, work.triangles), kTopologyBytesPerTriangle);
    sum.add(saturating_multiply(work.copies, work.vertices), kBackendBytesPerVertex);
    sum.add(saturating_multiply(work.copies, leaves), kTreeBytesPerLeaf);
    sum.add(work.pixels, kBytesPerPixel);
    sum.add(work.devices, kDeviceBytes);
    sum.add(work.kept_bytes, 1);
    sum.add(kFixedBytes, 1);
    return sum.bytes;
}

void set_memory_limit(std::uint64_t bytes, int threads) {
    chosen_limit = bytes;
    constexpr std::uint64_t kStackBytes = std::uint64_t{8} << 20;
    const std::uint64_t stacks =
        kStackBytes * (threads > 0 ? static_cast<unsigned>(threads)
                                   : std::max(1u, std::thread::hardware_concurrency()));
    rlimit data = {};
    if (getrlimit(RLIMIT_DATA, &data) != 0) return;
    // Memory that drivers map and leave as it is.
    constexpr std::uint64_t kMappedBytes = std::uint64_t{256} << 20;
    const std::uint64_t most =
        saturating_add(saturating_add(bytes, bytes / 2), stacks + kMappedBytes);
    data.rlim_cur = std::min<rlim_t>(data.rlim_cur, std::max(most, used_bytes(kStatmData)));
    setrlimit(RLIMIT_DATA, &data);
}

MemoryLimit memory_limit() {
    MemoryLimit limit{kNoLimit, "nothing"};
    apply_process_limit(limit, RLIMIT_AS, kStatmSize, "the address space limit (ulimit -v)");
    apply_process_limit(limit, RLIMIT_DATA, kStatmData,
                        chosen_limit ? kMemoryLimit : "the data limit (ulimit -d)");
    apply_control_groups(limit);
    if (const auto kib = read_keyed("/proc/meminfo", "MemAvailable:")) {
        tighten(limit, *kib * 1024, "this machine's free memory");
    }
    if (chosen_limit) {
        const std::uint64_t taken = resident_memory_bytes();
        tighten(limit, *chosen_limit > taken ? *chosen_limit - taken : 0, kMemoryLimit);
    }
    return limit;
}

std::uint64_t peak_memory_bytes() {
    return 1024 * read_keyed("/proc/self/status", "VmHWM:").value_or(0);
}

std::uint64_t resident_memory_bytes() {
    return 1024 * read_keyed("/proc/self/status", "VmRSS:").value_or(0);
}

void require_driver_memory() {
    MemoryLimit limit{kNoLimit, "nothing"};
    apply_process_limit(limit, RLIMIT_AS, kStatmSize, "the address space limit (ulimit -v)");
    if (limit.available_bytes >= kDriverAddressBytes) return;
    throw Error(
        ErrorKind::kLimit,
        fmt::format("a Vulkan driver needs about {} of addresses, but {} leaves {}; raise "
                    "the limit or use --backend cpu",
                    in_mib(kDriverAddressBytes), limit.source, in_mib(limit.available_bytes)));
}

void require_memory(const Workload& workload, std::string_view scene) {
    const std::uint64_t bytes = estimate_bytes(workload);
    // The estimate is that of the whole process.
    if (chosen_limit) require_memory(bytes, {*chosen_limit, kMemoryLimit}, scene);
    MemoryLimit limit = memory_limit();
    if (limit.source != kMemoryLimit) require_memory(bytes, limit, scene);
}

void require_memory(std::uint64_t bytes, const MemoryLimit& limit, std::string_view scene) {
    if (bytes <= limit.available_bytes) return;
    throw Error(
        ErrorKind::kLimit,
        fmt::format("{}this needs about {} of memory, but {} leaves {}; choose a smaller scene, "
                    "a smaller image or fewer frames, or raise the limit",
                    scene.empty() ? std::string() : shown(scene) + ": ", in_mib(bytes),
                    limit.source, in_mib(limit.available_bytes)));
}

}  // namespace mray::app
