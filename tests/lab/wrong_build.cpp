// The build in the file MORPHRAY_BUILD, with one wrong answer in each work; or, if
// MORPHRAY_INTERFACE is set, with another number of the interface.
#include <dlfcn.h>

#include <cstdlib>

#include "lab/bench/two_builds/build_functions.h"

namespace {

using namespace mray::lab;

const BuildFunctions& right_build() {
    void* const object = dlopen(std::getenv("MORPHRAY_BUILD"), RTLD_NOW | RTLD_LOCAL);
    if (object == nullptr) std::abort();
    void* const symbol = dlsym(object, kBuildSymbol);
    return *reinterpret_cast<const BuildFunctions* (*)()>(symbol)();
}

BuiltTracer open(const std::string& scene, const std::string& work, const std::string& tracer,
                 const std::string& simd) {
    BuiltTracer wrong = right_build().open(scene, work, tracer, simd);
    wrong.answers = [right = wrong.answers] {
        std::vector<unsigned char> bytes = right();
        bytes.back() ^= 1;
        return bytes;
    };
    return wrong;
}

}  // namespace

extern "C" __attribute__((visibility("default"))) const BuildFunctions* morphray_build_functions() {
    static BuildFunctions functions = {right_build().interface, right_build().version, open};
    if (std::getenv("MORPHRAY_INTERFACE") != nullptr) ++functions.interface;
    return &functions;
}
