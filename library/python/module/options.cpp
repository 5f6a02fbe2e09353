// Keyword arguments as options of C++.
#include <limits>
#include <utility>

#include "library/python/module/bindings.h"
#include "library/python/module/interruptible.h"
#include "morphray/error.hpp"

namespace morphray::python {
namespace {

[[noreturn]] void throw_choice(const std::string& name, const std::string& value,
                               const std::string& choices) {
    throw py::value_error(name + ": \"" + value + "\" is none of " + choices);
}

/// The value that has the name `text` among these.
template <class Value>
Value choice(const std::string& name, const std::string& text,
             std::initializer_list<std::pair<const char*, Value>> values) {
    std::string choices;
    for (const auto& [choice, value] : values) {
        if (text == choice) return value;
        choices += (choices.empty() ? "\"" : "\", \"") + std::string(choice);
    }
    throw_choice(name, text, choices + "\"");
}

/// The items of a sequence that is no text, or nothing.
std::optional<py::sequence> items_of(const py::object& object) {
    if (!py::isinstance<py::sequence>(object) || py::isinstance<py::str>(object)) return {};
    return py::reinterpret_borrow<py::sequence>(object);
}

}  // namespace

Cancel* cancel_of(const py::object& cancel) {
    if (cancel.is_none()) return nullptr;
    if (!py::isinstance<Cancel>(cancel))
        throw py::type_error("cancel: a morphray.Cancel or None is needed");
    return &cancel.cast<Cancel&>();
}

Device device_of(const py::object& device, const std::string& name) {
    if (py::isinstance<Device>(device)) return device.cast<Device>();
    if (!py::isinstance<py::str>(device))
        throw py::type_error(name + ": a morphray.Device or a str is needed");
    const auto text = device.cast<std::string>();
    const GilRelease release;
    if (text == "cpu") return Device::cpu();
    if (text == "vulkan") return Device::vulkan();
    if (text == "brute") return Device::brute_force();
    throw_choice(name, text,
                 R"("cpu", "vulkan" and "brute"; Device.vulkan() takes the name of a device)");
}

Point point_of(const py::object& point, const std::string& name) {
    const std::string message = name + ": three numbers are needed";
    const std::optional<py::sequence> numbers = items_of(point);
    if (!numbers) throw py::type_error(message);
    if (py::len(*numbers) != 3) throw py::value_error(message);
    Point result{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
        try {
            result[axis] = py::object((*numbers)[axis]).cast<double>();
        } catch (const py::cast_error&) {
            throw py::type_error(message);
        }
    }
    return result;
}

std::optional<Point> optional_point_of(const py::object& point, const std::string& name) {
    if (point.is_none()) return {};
    return point_of(point, name);
}

std::optional<Box> bounds_of(const py::object& bounds) {
    if (bounds.is_none()) return {};
    const std::string message = "bounds: a pair of points is needed, (lower, upper)";
    const std::optional<py::sequence> pair = items_of(bounds);
    if (!pair) throw py::type_error(message);
    if (py::len(*pair) != 2) throw py::value_error(message);
    return Box{point_of((*pair)[0], "bounds[0]"), point_of((*pair)[1], "bounds[1]")};
}

UpdatePolicy policy_of(const std::string& update, double budget_ms, double budget,
                       bool deterministic) {
    UpdatePolicy policy;
    try {
        policy = parse_update_policy(update);
    } catch (const Error& error) {
        throw py::value_error(std::string("update: ") + error.what());
    }
    const Auto automatic{budget_ms, budget, deterministic};
    if (std::holds_alternative<Auto>(policy)) return automatic;
    const Auto defaults;
    if (budget_ms != defaults.budget_ms || budget != defaults.budget || deterministic) {
        throw py::value_error("update: \"" + update +
                              "\" takes no budget_ms, budget or deterministic; \"auto\" does");
    }
    return policy;
}

Split split_of(const std::string& split) {
    return choice<Split>("split", split, {{"binned", Split::binned}, {"sweep", Split::sweep}});
}

Rays rays_named(const std::string& rays) {
    return choice<Rays>("rays", rays,
                        {{"primary", Rays::primary}, {"shadow", Rays::shadow}, {"ao", Rays::ao}});
}

Shading shading_named(const std::string& shading) {
    return choice<Shading>("shading", shading,
                           {{"plain", Shading::plain},
                            {"lit", Shading::lit},
                            {"normal", Shading::normal},
                            {"depth", Shading::depth},
                            {"prim", Shading::prim},
                            {"steps", Shading::steps},
                            {"sah", Shading::sah}});
}

Crossing crossing_named(const std::string& crossing) {
    return choice<Crossing>(
        "crossing", crossing,
        {{"once", Crossing::once}, {"each", Crossing::each}, {"owner", Crossing::owner}});
}

FillRule rule_named(const std::string& rule) {
    return choice<FillRule>("rule", rule, {{"nonzero", FillRule::nonzero}, {"odd", FillRule::odd}});
}

Wrap wrap_named(const std::string& wrap) {
    return choice<Wrap>("wrap", wrap, {{"repeat", Wrap::repeat}, {"clamp", Wrap::clamp}});
}

Coherence coherence_of(const py::object& coherence) {
    if (!py::isinstance<py::str>(coherence))
        return Coherence::image(uint32_of(coherence, "coherence"));
    const auto name = coherence.cast<std::string>();
    if (name == "none") return Coherence::none();
    if (name == "sort") return Coherence::sort();
    throw_choice("coherence", name, R"("none" and "sort", or the width of an image)");
}

std::uint32_t uint32_of(const py::handle& number, const std::string& name) {
    const py::object index = py::reinterpret_steal<py::object>(PyNumber_Index(number.ptr()));
    if (!index) {
        PyErr_Clear();
        throw py::type_error(name + ": a whole number is needed");
    }
    int overflow = 0;
    const long long value = PyLong_AsLongLongAndOverflow(index.ptr(), &overflow);
    if (overflow != 0 || value < 0 || value > std::numeric_limits<std::uint32_t>::max())
        throw py::value_error(name + ": " + std::string(py::str(index)) + " is out of range");
    return static_cast<std::uint32_t>(value);
}

}  // namespace morphray::python
