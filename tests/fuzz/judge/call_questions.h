// Questions of a case of calls to a scene.
#pragma once

#include "tests/fuzz/judge/call_play.h"

namespace mray::fuzz {

/// Asks all that the interface answers about rays, about points, or an image, at places that are
/// drawn from the call's seed around the meshes. Appends the answers. `other`: a scene to compare
/// with, or null.
void ask_about_rays(const morphray::Scene& scene, const morphray::Scene* other, const Call& call,
                    const Surroundings& around, CallAnswer& answer);
void ask_about_points(const morphray::Scene& scene, const Call& call, const Surroundings& around,
                      CallAnswer& answer);
void ask_for_image(const morphray::Scene& scene, const Call& call, const Surroundings& around,
                   CallAnswer& answer);

/// Does `work`, and appends the code of an error that it throws.
template <class Work>
void with_error_code(CallAnswer& answer, Work work) {
    try {
        work();
    } catch (const morphray::Error& error) {
        answer.push_back({"errors", {static_cast<std::uint32_t>(error.code())}});
    }
}

}  // namespace mray::fuzz
