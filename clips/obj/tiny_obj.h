// Interface to tinyobjloader: the statements that its parser finds in checked text.
#pragma once

#include <span>
#include <string>
#include <string_view>

namespace mray {

/// Receives the statements of an OBJ text in their order.
class ObjEvents {
public:
    virtual ~ObjEvents() = default;
    virtual void vertex() = 0;
    /// The position indices of a face as the text has them: from 1, or relative if negative. The
    /// span is valid during the call.
    virtual void face(std::span<const int> indices) = 0;
    /// The name includes the blanks around it.
    virtual void use_material(std::string_view name) = 0;
    virtual void material_library(const std::string& name) = 0;
};

/// `text` must have passed check_obj. Exceptions of the events pass through.
void parse_obj_text(std::string_view text, ObjEvents& events);

}  // namespace mray
