#include "app/view/window.h"

#include <glm/gtc/matrix_transform.hpp>

namespace mray::app {

std::vector<glm::vec4> box_lines(const ViewSpec& view, std::span<const morphray::Box> boxes) {
    const glm::dvec3 eye = to_dvec3(*view.eye);
    const glm::dvec3 target = to_dvec3(*view.target);
    const double aspect = static_cast<double>(view.width) / view.height;
    const glm::dmat4 camera = glm::infinitePerspective(glm::radians(view.fov), aspect,
                                                       1e-3 * glm::distance(eye, target)) *
                              glm::lookAt(eye, target, to_dvec3(view.up));
    std::vector<glm::vec4> ends;
    for (const morphray::Box& box : boxes) {
        const auto corner = [&](unsigned i) {
            return glm::vec4(camera * glm::dvec4((i & 1 ? box.upper : box.lower)[0],
                                                 (i & 2 ? box.upper : box.lower)[1],
                                                 (i & 4 ? box.upper : box.lower)[2], 1));
        };
        for (unsigned i = 0; i < 8; ++i) {
            for (const unsigned axis : {1u, 2u, 4u})
                if ((i & axis) == 0) ends.insert(ends.end(), {corner(i), corner(i | axis)});
        }
    }
    return ends;
}

}  // namespace mray::app
