// Text inside XML and HTML.
#pragma once

#include <string>
#include <string_view>

namespace mray {

/// The text with & < > " as entities, for an attribute or an element. Bytes that are not UTF-8
/// become \xNN, since a browser would show other characters and a reader of XML refuses them.
std::string xml_escaped(std::string_view text);

/// As above, with '?' for control characters, which XML 1.0 excludes, and for bytes that are not
/// ASCII, which may not be UTF-8.
std::string xml_ascii(std::string_view text);

}  // namespace mray
