#include "scenes/gltf/file/uri.h"

#include <fmt/format.h>

#include <algorithm>

#include "common/base/input_file.h"
#include "common/base/warning.h"
#include "common/text/base64.h"
#include "common/text/message_text.h"

namespace mray::gltf {
namespace {

bool is_letter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); }

/// The scheme of a URI, without its colon; empty if it has none.
std::string_view scheme_of(std::string_view uri) {
    const std::size_t colon = uri.find_first_of(":/?#");
    if (colon == std::string_view::npos || uri[colon] != ':' || colon == 0 || !is_letter(uri[0]))
        return {};
    return uri.substr(0, colon);
}

bool is_data(std::string_view uri) {
    const std::string_view scheme = scheme_of(uri);
    constexpr std::string_view kData = "data";
    return std::equal(scheme.begin(), scheme.end(), kData.begin(), kData.end(),
                      [](char a, char b) { return (a | 0x20) == b; });
}

std::optional<int> hex_digit(char c) {
    if (c >= '0' && c <= '9') return c - '0';
    if (c >= 'a' && c <= 'f') return c - 'a' + 10;
    if (c >= 'A' && c <= 'F') return c - 'A' + 10;
    return std::nullopt;
}

/// The text from `first` on.
std::string percent_decoded(const JsonAt& uri, std::size_t first = 0) {
    const std::string_view text = uri.text();
    std::string decoded;
    for (std::size_t i = first; i < text.size(); ++i) {
        if (text[i] != '%') {
            decoded += text[i];
            continue;
        }
        const auto high = i + 2 < text.size() ? hex_digit(text[i + 1]) : std::nullopt;
        const auto low = i + 2 < text.size() ? hex_digit(text[i + 2]) : std::nullopt;
        if (!high || !low) uri.fail("has a % without two hexadecimal digits");
        decoded += static_cast<char>(*high * 16 + *low);
        i += 2;
    }
    return decoded;
}

}  // namespace

std::optional<std::string> data_of_uri(const JsonAt& uri) {
    const std::string_view text = uri.text();
    if (!is_data(text)) return std::nullopt;
    constexpr std::string_view kBase64 = ";base64";
    const std::size_t comma = text.find(',');
    if (comma == std::string_view::npos || !text.substr(0, comma).ends_with(kBase64))
        uri.fail("is a data: URI that is not in base 64");
    std::optional<std::string> bytes = text.find('%', comma) == std::string_view::npos
                                           ? from_base64(text.substr(comma + 1))
                                           : from_base64(percent_decoded(uri, comma + 1));
    if (!bytes) uri.fail("has characters that are not base 64, or is cut");
    return bytes;
}

std::filesystem::path file_of_uri(const JsonAt& uri, const std::filesystem::path& scene_file) {
    const std::string name = percent_decoded(uri);
    for (const std::string_view text : {uri.text(), std::string_view(name)}) {
        if (scheme_of(text).empty()) continue;
        uri.fail(
            fmt::format("{} is not followed; put the file beside the scene and give its name "
                        "only",
                        in_quotes(text)));
    }
    try {
        return side_file(scene_file, name);
    } catch (const Error& error) {
        if (error.kind() != ErrorKind::kBadInput) throw;
        const Warning at = as_warning(error, uri.file());
        uri.fail(at.place.empty() || at.place == uri.file() ? at.text : error.what());
    }
}

}  // namespace mray::gltf
