// The build in the file MORPHRAY_BUILD, with one wrong answer in each work; or, if
// MORPHRAY_INTERFACE is set, with another number of the interface.
#include <dlfcn.h>

#include <cstdlib>

#include "lab/bench/two_builds/build_functions.h"

namespace {

using namespace mray::bench;

const BuildFunctions& right_build() {
    void* const object = dlopen(std::getenv("MORPHRAY_BUILD"), RTLD_NOW | RTLD_LOCAL);
    if (object == nullptr) std::abort();
    void* const symbol = dlsym(object, kBuildSymbol);
    return *reinterpret_cast<const BuildFunctions* (*)()>(symbol)();
}

class WrongWork final : public BuiltWork {
public:
    explicit WrongWork(std::unique_ptr<BuiltWork> right) : right_(std::move(right)) {}

    std::size_t rays() const override { return right_->rays(); }
    std::size_t parts() const override { return right_->parts(); }
    void trace_part(std::size_t part) override { right_->trace_part(part); }
    std::size_t answer_size() const override { return right_->answer_size(); }
    std::vector<unsigned char> answers() const override {
        std::vector<unsigned char> bytes = right_->answers();
        bytes.back() ^= 1;
        return bytes;
    }

private:
    std::unique_ptr<BuiltWork> right_;
};

std::unique_ptr<BuiltWork> open(const std::string& scene, const std::string& work,
                                const std::string& tracer, const std::string& simd) {
    std::unique_ptr<BuiltWork> right = right_build().open(scene, work, tracer, simd);
    return right ? std::make_unique<WrongWork>(std::move(right)) : nullptr;
}

}  // namespace

extern "C" __attribute__((visibility("default"))) const BuildFunctions* morphray_build_functions() {
    static BuildFunctions functions = {right_build().interface, right_build().version, open};
    if (std::getenv("MORPHRAY_INTERFACE") != nullptr) ++functions.interface;
    return &functions;
}
