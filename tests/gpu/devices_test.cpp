// The list of devices, the choice of one, and the messages if none can be used.
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <optional>

#include "common/base/errors.h"
#include "gpu/shared_device.h"
#include "gpu/vulkan/device.h"
#include "tests/gpu/faulty_loader.h"

namespace mray::test {
namespace {

using testing::TempDir;

std::string error_text(const std::function<void()>& action) {
    try {
        action();
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::kUnavailable) << error.what();
        return error.what();
    }
    ADD_FAILURE() << "no error";
    return "";
}

bool contains(const std::string& text, const std::string& part) {
    return text.find(part) != std::string::npos;
}

gpu::DeviceInfo info(std::uint32_t index, const char* name, const char* type,
                     const char* unusable = "") {
    gpu::DeviceInfo d;
    d.index = index;
    d.name = name;
    d.type = type;
    d.uuid = std::string(32, '0');
    d.uuid.back() = static_cast<char>('1' + index);
    d.unusable = unusable;
    return d;
}

const std::vector<gpu::DeviceInfo> kDevices = {
    info(0, "llvmpipe (256 bits)", "cpu"),
    info(1, "Example Arc 1", "integrated"),
    info(2, "Example Force 2", "discrete"),
    info(3, "Example Force 3", "discrete", "it has no compute queue"),
};

TEST(DeviceChoice, PrefersDiscreteThenIntegratedThenVirtualThenCpu) {
    EXPECT_EQ(gpu::choose_device(kDevices, ""), 2u);
    EXPECT_EQ(gpu::choose_device(std::span(kDevices).first(2), ""), 1u);
    EXPECT_EQ(gpu::choose_device(std::span(kDevices).first(1), ""), 0u);
}

TEST(DeviceChoice, TakesAnIndexAPartOfANameOrAUuid) {
    EXPECT_EQ(gpu::choose_device(kDevices, "0"), 0u);
    EXPECT_EQ(gpu::choose_device(kDevices, "LLVMPIPE"), 0u);
    EXPECT_EQ(gpu::choose_device(kDevices, "force 2"), 2u);
    EXPECT_EQ(gpu::choose_device(kDevices, "00000000-0000-0000-0000-000000000002"), 1u);
}

TEST(DeviceChoice, NamesTheDevicesWhenNoneOrSeveralFit) {
    for (const char* wanted : {"9", "99999999999999999999999", "banana", "example",
                               "00000000000000000000000000000009"}) {
        const std::string text = error_text([&] { gpu::choose_device(kDevices, wanted); });
        EXPECT_TRUE(contains(text, wanted)) << text;
        EXPECT_TRUE(contains(text, "1: Example Arc 1, 2: Example Force 2")) << text;
    }
    EXPECT_TRUE(
        contains(error_text([] { gpu::choose_device(kDevices, "example"); }), "more than one"));
}

TEST(DeviceChoice, SaysWhyADeviceCannotBeUsed) {
    EXPECT_TRUE(
        contains(error_text([] { gpu::choose_device(kDevices, "3"); }), "it has no compute queue"));
    EXPECT_TRUE(contains(error_text([] { gpu::choose_device(std::span(kDevices).last(1), ""); }),
                         "no usable device: Example Force 3: it has no compute queue"));
}

TEST(DeviceList, HasAUsableDeviceWithEverythingFilledIn) {
    const std::vector<gpu::DeviceInfo> devices = gpu::list_devices();
    ASSERT_FALSE(devices.empty());
    const gpu::DeviceInfo& first = devices[gpu::choose_device(devices, "")];
    EXPECT_EQ(first.uuid.size(), 32u);
    EXPECT_FALSE(first.name.empty());
    EXPECT_FALSE(first.driver.empty());
    EXPECT_GE(first.api_major * 100 + first.api_minor, 101u);
    EXPECT_GT(first.memory_bytes, 0u);
    EXPECT_GT(first.subgroup_size, 0u);
}

std::string reason(Faults faults) {
    const FaultyLoader loader(faults);
    return gpu::list_devices(loader.get()).front().unusable;
}

TEST(DeviceList, GivesTheReasonWhyADeviceIsUnusable) {
    Faults old;
    old.edit_properties = [](auto& p) { p.apiVersion = VK_API_VERSION_1_0; };
    EXPECT_TRUE(contains(reason(old), "only Vulkan 1.0"));
    Faults no_compute;
    no_compute.edit_queue_family = [](auto& f) { f.queueFlags = VK_QUEUE_TRANSFER_BIT; };
    EXPECT_TRUE(contains(reason(no_compute), "no compute queue"));
    Faults rounding;
    rounding.edit_float_controls = [](auto& f) { f.shaderRoundingModeRTEFloat32 = VK_FALSE; };
    EXPECT_TRUE(contains(reason(rounding), "round"));
    Faults zeros;
    zeros.edit_float_controls = [](auto& f) { f.shaderSignedZeroInfNanPreserveFloat32 = VK_FALSE; };
    EXPECT_TRUE(contains(reason(zeros), "signed zeros"));
}

TEST(DeviceList, SaysThatThereIsNoDevice) {
    Faults faults;
    faults.hide_devices = true;
    const FaultyLoader loader(faults);
    EXPECT_TRUE(contains(error_text([&] { gpu::list_devices(loader.get()); }), "no device"));
}

/// Sets an environment variable during its lifetime.
class Environment {
public:
    Environment(const char* name, const std::string& value) : name_(name) {
        if (const char* old = std::getenv(name)) old_ = old;
        setenv(name, value.c_str(), 1);
    }
    ~Environment() {
        if (old_) {
            setenv(name_, old_->c_str(), 1);
        } else {
            unsetenv(name_);
        }
    }
    Environment(const Environment&) = delete;
    Environment& operator=(const Environment&) = delete;

private:
    const char* name_;
    std::optional<std::string> old_;
};

std::string written(const char* name, const std::string& text) {
    const std::string path = TempDir() + name;
    std::ofstream(path) << text;
    return path;
}

/// Lists devices by an instance of its own; that of the process may be older than its environment.
void list_anew() {
    Faults none;
    const FaultyLoader loader(none);
    gpu::list_devices(loader.get());
}

TEST(Installation, WithoutADriverSaysSo) {
    const Environment none("VK_ICD_FILENAMES", TempDir() + "no_such_manifest.json");
    EXPECT_TRUE(contains(error_text(list_anew), "no driver"));
}

TEST(Installation, WithAMalformedManifestSaysThatItCannotBeRead) {
    const Environment broken("VK_ICD_FILENAMES", written("malformed.json", "{ \"file_format"));
    const std::string text = error_text(list_anew);
    // The loader of Debian 12 says that there is such a driver, that of Debian 13 leaves it out.
    EXPECT_TRUE(contains(text, "a driver on this machine is broken") ||
                contains(text, "no driver on this machine"))
        << text;
    EXPECT_TRUE(contains(text, "manifest can")) << text;
    EXPECT_TRUE(contains(text, "VK_ICD_FILENAMES")) << text;
}

TEST(Installation, WithADriverThatIsNoLibrarySaysThatThereIsNone) {
    const std::string library = written("libnonsense.so", "nonsense");
    const std::string manifest = R"({"file_format_version": "1.0.0", "ICD": {"library_path": ")" +
                                 library + R"(", "api_version": "1.3.0"}})";
    const Environment broken("VK_ICD_FILENAMES", written("nonsense.json", manifest));
    const std::string text = error_text(list_anew);
    EXPECT_TRUE(contains(text, "no driver")) << text;
    EXPECT_TRUE(contains(text, "the library that it names missing")) << text;
}

TEST(Installation, WithoutAddressSpaceForADriverSaysThatMemoryIsShort) {
    const Environment none("VK_ICD_FILENAMES", TempDir() + "no_such_manifest.json");
    rlimit before;
    ASSERT_EQ(getrlimit(RLIMIT_AS, &before), 0);
    std::size_t pages = 0;
    std::ifstream("/proc/self/statm") >> pages;
    rlimit tight = before;
    tight.rlim_cur = pages * static_cast<std::size_t>(getpagesize()) + (std::size_t{64} << 20);
    ASSERT_EQ(setrlimit(RLIMIT_AS, &tight), 0);
    std::optional<Error> error;
    try {
        list_anew();
    } catch (const Error& thrown) {
        error = thrown;
    }
    setrlimit(RLIMIT_AS, &before);
    ASSERT_TRUE(error.has_value());
    EXPECT_EQ(error->kind(), ErrorKind::kLimit) << error->what();
    EXPECT_TRUE(contains(error->what(), "ulimit -v")) << error->what();
}

TEST(Installation, WithoutTheLayerSaysThatValidationIsNotInstalled) {
    const Environment none("VK_LAYER_PATH", TempDir() + "no_such_folder");
    EXPECT_TRUE(
        contains(error_text([] { gpu::make_vulkan_backend({.device = "", .validate = true}); }),
                 "VK_LAYER_KHRONOS_validation is not installed"));
}

}  // namespace
}  // namespace mray::test
