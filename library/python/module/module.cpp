// The extension module morphray._morphray. The package's __init__.py makes its names public.
#include "library/python/module/arrays.h"
#include "library/python/module/bindings.h"
#include "morphray/geometry.hpp"
#include "morphray/version.hpp"

PYBIND11_MODULE(_morphray, module) {
    namespace mp = morphray::python;
    // Docstrings have signatures in the form that inspect.signature() reads.
    pybind11::options options;
    options.disable_function_signatures();

    module.attr("__version__") = morphray::version();
    module.attr("INVALID_ID") = morphray::kNoPrim;
    module.attr("ray_dtype") = mp::ray_dtype();
    module.attr("hit_dtype") = mp::hit_dtype();
    module.attr("closest_dtype") = mp::closest_dtype();
    mp::bind_errors(module);
    mp::bind_devices(module);
    mp::bind_images(module);
    mp::bind_scene(module);
    mp::bind_compare(module);
}
