// For device tests of sanitizer builds. Keeps the driver and the layer loaded, so that the leak
// sanitizer finds memory that their globals hold and can name their code. Suppresses the leaks of
// the layer itself (1.3.239), which it has with each device.
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
