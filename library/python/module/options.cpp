#include "library/python/module/options.h"

#include <limits>

#include "library/python/module/bindings.h"

namespace morphray::python {
namespace {

[[noreturn]] void throw_choice(const std::string& name, const std::string& value,
                               const std::string& choices) {
    throw py::value_error(name + ": \"" + value + "\" is none of " + choices);
}

}  // namespace

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
    if (split == "binned") return Split::binned;
    if (split == "sweep") return Split::sweep;
    throw_choice("split", split, R"("binned" and "sweep")");
}

std::optional<Box> bounds_of(const py::object& bounds) {
    if (bounds.is_none()) return {};
    if (!py::isinstance<py::sequence>(bounds) || py::isinstance<py::str>(bounds))
        throw py::type_error("bounds: a pair of points is needed, (lower, upper)");
    const auto pair = py::reinterpret_borrow<py::sequence>(bounds);
    if (py::len(pair) != 2)
        throw py::value_error("bounds: a pair of points is needed, (lower, upper)");
    return Box{point_of(pair[0], "bounds[0]"), point_of(pair[1], "bounds[1]")};
}

Rays rays_named(const std::string& rays) {
    if (rays == "primary") return Rays::primary;
    if (rays == "shadow") return Rays::shadow;
    if (rays == "ao") return Rays::ao;
    throw_choice("rays", rays, R"("primary", "shadow" and "ao")");
}

Shading shading_named(const std::string& shading) {
    if (shading == "plain") return Shading::plain;
    if (shading == "lit") return Shading::lit;
    if (shading == "normal") return Shading::normal;
    if (shading == "depth") return Shading::depth;
    if (shading == "prim") return Shading::prim;
    if (shading == "steps") return Shading::steps;
    if (shading == "sah") return Shading::sah;
    throw_choice("shading", shading,
                 R"("plain", "lit", "normal", "depth", "prim", "steps" and "sah")");
}

Crossing crossing_named(const std::string& crossing) {
    if (crossing == "owner") return Crossing::owner;
    if (crossing == "each") return Crossing::each;
    throw_choice("crossing", crossing, R"("owner" and "each")");
}

Coherence coherence_of(const py::object& coherence) {
    if (!py::isinstance<py::str>(coherence))
        return Coherence::image(uint32_of(coherence, "coherence"));
    const auto name = coherence.cast<std::string>();
    if (name == "none") return Coherence::none();
    if (name == "sort") return Coherence::sort();
    throw_choice("coherence", name, R"("none" and "sort", or the width of an image)");
}

FillRule rule_named(const std::string& rule) {
    if (rule == "nonzero") return FillRule::nonzero;
    if (rule == "odd") return FillRule::odd;
    throw_choice("rule", rule, R"("nonzero" and "odd")");
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
