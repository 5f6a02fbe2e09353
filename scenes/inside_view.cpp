#include "scenes/inside_view.h"

#include <optional>

namespace mray {

ViewSpec with_inside_view(ViewSpec view, const Clip& clip) {
    const std::optional<InsideView> inside = clip.inside_view();
    if (!inside) return view;
    if (!view.eye && !view.target) {
        view.eye = inside->eye;
        view.target = inside->target;
    }
    if (!view.light) view.light = inside->light;
    return view;
}

}  // namespace mray
