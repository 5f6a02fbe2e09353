#include "common/report/xml_text.h"

#include <algorithm>

#include "common/text/text_parts.h"

namespace mray {

std::string xml_escaped(std::string_view text) {
    std::string result;
    for (const char c : utf8_text(text)) {
        if (c == '&') {
            result += "&amp;";
        } else if (c == '<') {
            result += "&lt;";
        } else if (c == '>') {
            result += "&gt;";
        } else if (c == '"') {
            result += "&quot;";
        } else {
            result += c;
        }
    }
    return result;
}

std::string xml_ascii(std::string_view text) {
    std::string ascii(text);
    // A reader rejects the whole report for one bad byte.
    std::replace_if(
        ascii.begin(), ascii.end(), [](unsigned char c) { return c < 0x20 || c >= 0x7F; }, '?');
    return xml_escaped(ascii);
}

}  // namespace mray
