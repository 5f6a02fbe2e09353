// Values that reports write as JSON.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

namespace mray {

/// An object keeps its members in the order in which they were added.
using Json = nlohmann::ordered_json;

/// The text with a final line end. Bytes that are not UTF-8 become U+FFFD, numbers that are not
/// finite become null. `indent` is per level; -1 gives a single line.
inline std::string json_text(const Json& json, int indent = 2) {
    return json.dump(indent, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace mray
