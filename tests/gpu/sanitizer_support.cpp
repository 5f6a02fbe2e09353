// Linked into the device tests of sanitizer builds: keeps the driver and the layer loaded, so that
// the leak sanitizer sees what their globals hold and can name their code, and leaves out what the
// layer (1.3.239) leaks of its own with each device.
#include <dlfcn.h>

#include <initializer_list>

extern "C" const char* __lsan_default_suppressions() {
    return "leak:libVkLayer_khronos_validation.so\n";
}

namespace {

[[maybe_unused]] const bool kKeptLoaded = [] {
    for (const char* library : {"libvulkan_lvp.so", "libVkLayer_khronos_validation.so"}) {
        dlopen(library, RTLD_NOW | RTLD_LOCAL | RTLD_NODELETE);
    }
    return true;
}();

}  // namespace
