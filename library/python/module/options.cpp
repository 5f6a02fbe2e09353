// Keyword arguments as options of C++.
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

template <class Value>
Value choice(const std::string& name, const py::object& given,
             std::initializer_list<std::pair<const char*, Value>> values) {
    const std::string text = py::str(given);
    std::string choices;
    for (const auto& [choice, value] : values) {
        if (text == choice) return value;
        choices += (choices.empty() ? "\"" : "\", \"") + std::string(choice);
    }
    throw_choice(name, text, choices + "\"");
}

}  // namespace

Device device_of(const py::object& device) {
    if (py::isinstance<Device>(device)) return device.cast<Device>();
    const std::string text = py::str(device);
    const GilRelease release;
    if (text == "cpu") return Device::cpu();
    if (text == "vulkan") return Device::vulkan();
    if (text == "brute") return Device::brute_force();
    throw_choice("device", text,
                 R"("cpu", "vulkan" and "brute"; Device.vulkan() takes the name of a device)");
}

Coherence coherence_of(const py::object& coherence) {
    const char* const wanted = R"(coherence: "none", "sort" or the width of an image)";
    if (!py::isinstance<py::str>(coherence))
        return Coherence::image(value_of<std::uint32_t>(coherence, wanted));
    const std::string name = py::str(coherence);
    if (name == "none") return Coherence::none();
    if (name == "sort") return Coherence::sort();
    throw_choice("coherence", name, R"("none" and "sort", or the width of an image)");
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

Rays rays_named(const py::object& rays) {
    return choice<Rays>("rays", rays,
                        {{"primary", Rays::primary}, {"shadow", Rays::shadow}, {"ao", Rays::ao}});
}

Shading shading_named(const py::object& shading) {
    return choice<Shading>("shading", shading,
                           {{"plain", Shading::plain},
                            {"lit", Shading::lit},
                            {"normal", Shading::normal},
                            {"depth", Shading::depth},
                            {"prim", Shading::prim},
                            {"steps", Shading::steps},
                            {"sah", Shading::sah}});
}

Crossing crossing_named(const py::object& crossing) {
    return choice<Crossing>(
        "crossing", crossing,
        {{"once", Crossing::once}, {"each", Crossing::each}, {"owner", Crossing::owner}});
}

FillRule rule_named(const py::object& rule) {
    return choice<FillRule>("rule", rule, {{"nonzero", FillRule::nonzero}, {"odd", FillRule::odd}});
}

Threads threads_named(const py::object& threads) {
    return choice<Threads>("threads", threads,
                           {{"all", Threads::all}, {"calling", Threads::calling}});
}

Wrap wrap_named(const py::object& wrap) {
    return choice<Wrap>("wrap", wrap, {{"repeat", Wrap::repeat}, {"clamp", Wrap::clamp}});
}

}  // namespace morphray::python
