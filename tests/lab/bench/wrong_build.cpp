// The build in the file MORPHRAY_BUILD, with one wrong answer in each work; or, if
// MORPHRAY_INTERFACE is set, with another number of the interface.
#include <dlfcn.h>

#include <cstdlib>
#include <vector>

#include "lab/bench/two_builds/build_functions.h"

namespace {

using mray::bench::BuildFunctions;
using mray::bench::BuiltWork;

const BuildFunctions& right_build() {
    void* const object = dlopen(std::getenv("MORPHRAY_BUILD"), RTLD_NOW | RTLD_LOCAL);
    if (object == nullptr) std::abort();
    void* const symbol = dlsym(object, mray::bench::kBuildSymbol);
    return *reinterpret_cast<const BuildFunctions* (*)()>(symbol)();
}

const unsigned char* wrong_answers(BuiltWork* work, std::size_t* answer_size, std::size_t* count) {
    static std::vector<unsigned char> bytes;
    const unsigned char* const right = right_build().answers(work, answer_size, count);
    bytes.assign(right, right + *answer_size * *count);
    bytes.back() ^= 1;
    return bytes.data();
}

}  // namespace

extern "C" __attribute__((visibility("default"))) const BuildFunctions* morphray_build_functions() {
    static BuildFunctions functions = right_build();
    functions.answers = wrong_answers;
    if (std::getenv("MORPHRAY_INTERFACE") != nullptr) ++functions.interface;
    return &functions;
}
