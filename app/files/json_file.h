// JSON files that the program has written and reads back.
#pragma once

#include <cstdint>
#include <stdexcept>
#include <string>
#include <string_view>

#include "common/base/input_file.h"
#include "common/text/text_parts.h"
#include "scenes/json/json_at.h"

namespace mray::app {

/// Throws Error(kBadInput): what is wrong at a place, and which command writes such files.
[[noreturn]] void refuse_json(const std::string& place, const std::string& what,
                              const char* command);
/// Whether the member "command" has this value.
bool is_report_of(std::string_view command, const JsonAt& json);

/// Reads a file of at most `most_bytes` that `command` has written, and returns make(json), which
/// takes a JsonAt. Throws Error: kBadInput that names the file for text that is not JSON (with the
/// byte), for members that make() misses or finds of another type, and with the text of a
/// std::invalid_argument of make(); what read_input_file() throws.
template <class Make>
auto read_json_file(const std::string& file, std::uint64_t most_bytes, const char* command,
                    Make make) {
    const JsonTree tree = parse_json(read_input_file(file, most_bytes), escape(file));
    try {
        return make(JsonAt(tree, file));
    } catch (const JsonValueError&) {
        refuse_json(escape(file), "lacks a member", command);
    } catch (const std::invalid_argument& error) {
        refuse_json(escape(file), error.what(), command);
    }
}

}  // namespace mray::app
