#include "library/src/engine.h"

#include "library/src/scene_impl.h"

namespace morphray::engine {

using detail::SceneImpl;

mray::Backend& backend(const Scene& scene) {
    const SceneImpl& impl = SceneImpl::of(scene);
    impl.tracer().watch_images(mray::Watch(impl.options().cancel));
    return impl.tracer();
}

std::unique_ptr<mray::Backend> copy_on(const Device& device, const Scene& scene) {
    const SceneImpl& impl = SceneImpl::of(scene);
    std::unique_ptr<mray::Backend> copy = detail::DeviceImpl::of(device).make_backend();
    copy->watch_images(mray::Watch(impl.options().cancel));
    copy->set_scene(impl.meshes().topology(), impl.pose().pose(), impl.tracer().host_tree());
    return copy;
}

void read_positions(const Scene& scene) {
    SceneImpl& impl = SceneImpl::of(scene);
    impl.read_positions(impl.meshes().deforming_vertices());
}
std::span<const mray::vec3> positions(const Scene& scene) {
    return SceneImpl::of(scene).pose().positions();
}
const mray::SceneSpace& space(const Scene& scene) { return SceneImpl::of(scene).pose().space(); }

mray::ViewSpec to_spec(const View& view, const Point& origin) {
    static_assert(static_cast<std::uint32_t>(Rays::ao) == mray::kRaysAo);
    if (view.rays < Rays::primary || view.rays > Rays::ao)
        detail::throw_bad_argument("View::rays: not one of primary, shadow and ao");
    const auto less_origin = [&](std::optional<Point> point) {
        for (std::size_t axis = 0; point && axis < 3; ++axis) (*point)[axis] -= origin[axis];
        return point;
    };
    std::optional<mray::Pinhole> pinhole;
    if (view.pinhole) {
        const auto& [to_world, fx, fy, cx, cy] = *view.pinhole;
        pinhole = {.fx = fx, .fy = fy, .cx = cx, .cy = cy};
        for (int axis = 0; axis < 3; ++axis) {
            const std::array<double, 4>& row = to_world[static_cast<std::size_t>(axis)];
            pinhole->right[axis] = row[0];
            pinhole->down[axis] = row[1];
            pinhole->forward[axis] = row[2];
            pinhole->org[axis] =
                static_cast<float>(row[3] - origin[static_cast<std::size_t>(axis)]);
        }
    }
    return {.eye = less_origin(view.eye),
            .target = less_origin(view.target),
            .up = view.up,
            .fov = view.fov,
            .pinhole = pinhole,
            .light = less_origin(view.light),
            .width = view.width,
            .height = view.height,
            .rays = static_cast<std::uint32_t>(view.rays),
            .ao_count = view.ao_count,
            .ao_distance = view.ao_distance};
}

mray::ImageParams image_params(const Scene& scene, const View& view) {
    const SceneImpl& impl = SceneImpl::of(scene);
    return mray::make_image_params(to_spec(view, impl.options().origin), impl.pose().bounds(),
                                   impl.pose().space());
}

}  // namespace morphray::engine
