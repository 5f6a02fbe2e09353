#include "embree/fallback.h"

#include <dlfcn.h>

#include <array>
#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <type_traits>

#include "embree/device.h"

namespace mray::embree {
namespace {

constexpr const char* kVariable = "MORPHRAY_EMBREE_FALLBACK";

// The library's own calls stay inside it. Sanitizers take no library that is bound so.
#ifdef MORPHRAY_SANITIZED
constexpr int kBinding = RTLD_NOW | RTLD_LOCAL;
#else
constexpr int kBinding = RTLD_NOW | RTLD_LOCAL | RTLD_DEEPBIND;
#endif

std::atomic<const Fallback*> loaded = nullptr;

[[noreturn]] void fail_loading(const std::string& reason) {
    throw Failure{RTC_ERROR_INVALID_ARGUMENT, std::string(kVariable) + ": " + reason};
}

}  // namespace

Fallback::Fallback(const char* file) : path(file) {
    void* const library = dlopen(file, kBinding);
    if (library == nullptr) fail_loading(dlerror());
    const auto find = [&](const char* name, auto& function) {
        function =
            reinterpret_cast<std::remove_reference_t<decltype(function)>>(dlsym(library, name));
        if (function == nullptr)
            fail_loading(path + " is not the library of Embree " RTC_VERSION_STRING ": it has no " +
                         name);
    };
#define MORPHRAY_FIND(name) find(#name, name);
    MORPHRAY_FALLBACK_FUNCTIONS(MORPHRAY_FIND)
#undef MORPHRAY_FIND
    if (rtcNewDevice == &::rtcNewDevice) fail_loading(path + " is morphray's own library");
}

const Fallback* load_fallback() {
    const char* const path = std::getenv(kVariable);
    if (path == nullptr || *path == '\0') return nullptr;
    static const Fallback library(path);
    loaded.store(&library, std::memory_order_release);
    return &library;
}

const Fallback* loaded_fallback() { return loaded.load(std::memory_order_acquire); }

void announce_unsupported(const std::string& reason, const Fallback* library) {
    static std::array<std::atomic<bool>, 2> is_said = {};
    if (is_said[library == nullptr ? 0 : 1].exchange(true)) return;
    const std::string who = library == nullptr
                                ? std::string("no ray of such scenes hits, unless ") + kVariable +
                                      " names Embree's own library"
                                : library->path + " answers such scenes";
    std::fprintf(stderr, "morphray: %s: %s\n", reason.c_str(), who.c_str());
}

}  // namespace mray::embree
