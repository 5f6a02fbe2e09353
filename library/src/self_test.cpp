#include "library/src/self_test.h"

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <vector>

#include "common/base/output_file.h"
#include "common/version.h"
#include "gpu/vulkan_backend.h"
#include "library/src/device_impl.h"
#include "library/src/digest.h"
#include "library/src/scene/errors.h"

namespace morphray::detail {
namespace {

/// Fewer than those of the digest, since a first use waits for them.
constexpr std::uint32_t kQuestions = 400;
/// Rays of the test take more steps than that, so that they are suspended.
constexpr std::uint32_t kShortBudget = 200;

/// A result belongs to a device, its driver, and a version of this library.
std::string key_of(const mray::gpu::DeviceInfo& info) {
    return info.uuid + '\n' + info.driver + '\n' + std::string(mray::kVersionDetail) + '\n';
}

/// Empty if the user has no folder.
std::filesystem::path file_of(const mray::gpu::DeviceInfo& info) {
    const std::filesystem::path file = "morphray/device-" + info.uuid;
    if (const char* const cache = std::getenv("XDG_CACHE_HOME"); cache != nullptr && *cache != 0)
        return cache / file;
    if (const char* const home = std::getenv("HOME"); home != nullptr && *home != 0)
        return std::filesystem::path(home) / ".cache" / file;
    return {};
}

void keep_check(const mray::gpu::DeviceInfo& info, const DeviceCheck& check) {
    const char* const word = check.passed                           ? "passed"
                             : check.code == ErrorCode::device_lost ? "lost"
                                                                    : "wrong";
    const std::filesystem::path file = file_of(info);
    if (file.empty()) return;
    try {
        std::filesystem::create_directories(file.parent_path());
        mray::write_file(file, key_of(info) + word + '\n' + check.problem + check.note + '\n');
    } catch (const std::exception&) {
        // Without the file the next process tests again.
    }
}

}  // namespace

std::string find_difference(const Device& tested) {
    return with_public_errors([&]() -> std::string {
        std::vector<std::uint64_t> expected;
        compute_digest(Device::cpu({.threads = 1, .simd = "off"}), kQuestions,
                       [&](const char*, std::uint64_t hash) { expected.push_back(hash); });
        auto next = expected.begin();
        try {
            compute_digest(tested, kQuestions, [&](const char* what, std::uint64_t hash) {
                if (hash != *next++) throw what;
            });
        } catch (const char* what) {
            return what;
        }
        return "";
    });
}

std::optional<DeviceCheck> kept_check(const mray::gpu::DeviceInfo& info) {
    const std::string key = key_of(info);
    std::ifstream file(file_of(info), std::ios::binary);
    std::string found(key.size(), '\0'), word, problem;
    file.read(found.data(), static_cast<std::streamsize>(found.size()));
    if (found != key) return std::nullopt;
    std::getline(file, word);
    std::getline(file, problem);
    if (word == "passed") return DeviceCheck{.passed = true, .note = problem};
    if (problem.empty() || (word != "wrong" && word != "lost")) return std::nullopt;
    return DeviceCheck{false, problem,
                       word == "wrong" ? ErrorCode::unavailable : ErrorCode::device_lost};
}

DeviceCheck keep_failure(const mray::gpu::DeviceInfo& info, ErrorCode code,
                         const std::string& what) {
    DeviceCheck check{.problem = "Vulkan: " + info.name + " (" + info.driver +
                                 ") failed its self-test: " + what +
                                 "; update the driver and run `morphray devices --check`, or use "
                                 "the CPU backend",
                      .code = code};
    keep_check(info, check);
    return check;
}

DeviceCheck run_self_test(const mray::gpu::DeviceInfo& info) {
    using enum mray::gpu::BufferKind;
    // The second one suspends rays, packs hits, and has buffers as large scenes may need them.
    const mray::gpu::Tuning tunings[] = {{},
                                         {.step_budget = kShortBudget,
                                          .buffer_kind = info.prefers_texels ? kStorage : kTexels,
                                          .force_staging = true}};
    try {
        return with_public_errors([&] {
            DeviceCheck check{.passed = true};
            for (const mray::gpu::Tuning& tuning : tunings) {
                const auto device =
                    mray::gpu::open_device({.device = std::to_string(info.index)}, tuning);
                const Device tested = DeviceImpl::make_on_device(
                    [=] { return mray::gpu::make_backend_on(device, tuning); });
                const std::string difference = find_difference(tested);
                if (difference == "denormals")
                    check.note = "denormals become 0, which changes no bit";
                else if (!difference.empty())
                    return keep_failure(info, ErrorCode::unavailable,
                                        difference + " differ from the CPU's bits");
            }
            keep_check(info, check);
            return check;
        });
    } catch (const Error& error) {
        // A traversal without end is internal. A lack of memory says nothing about the device.
        if (error.code() == ErrorCode::internal)
            return keep_failure(info, ErrorCode::unavailable, error.what());
        if (error.code() != ErrorCode::device_lost) throw;
        return keep_failure(info, ErrorCode::device_lost, error.what());
    }
}

}  // namespace morphray::detail
