#include "clips/ply/ply_header.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <set>
#include <utility>

#include "common/base/errors.h"
#include "common/text/message_text.h"
#include "common/text/number_text.h"
#include "common/text/text_parts.h"

namespace mray {
namespace {

using namespace std::string_view_literals;

constexpr std::string_view kBlanks = " \t\r";

struct NamedType {
    std::string_view name;
    PlyScalar type;
};
// The names of the format's author, and those with sizes that many programs write.
constexpr std::array kTypes = {
    NamedType{"char", PlyScalar::kInt8},     NamedType{"int8", PlyScalar::kInt8},
    NamedType{"uchar", PlyScalar::kUint8},   NamedType{"uint8", PlyScalar::kUint8},
    NamedType{"short", PlyScalar::kInt16},   NamedType{"int16", PlyScalar::kInt16},
    NamedType{"ushort", PlyScalar::kUint16}, NamedType{"uint16", PlyScalar::kUint16},
    NamedType{"int", PlyScalar::kInt32},     NamedType{"int32", PlyScalar::kInt32},
    NamedType{"uint", PlyScalar::kUint32},   NamedType{"uint32", PlyScalar::kUint32},
    NamedType{"float", PlyScalar::kFloat},   NamedType{"float32", PlyScalar::kFloat},
    NamedType{"double", PlyScalar::kDouble}, NamedType{"float64", PlyScalar::kDouble},
};

struct NamedRole {
    std::string_view element;
    std::string_view property;
    PlyRole role;
};
constexpr std::array kRoles = {
    NamedRole{"vertex", "x", PlyRole::kX},
    NamedRole{"vertex", "y", PlyRole::kY},
    NamedRole{"vertex", "z", PlyRole::kZ},
    NamedRole{"vertex", "nx", PlyRole::kNormalX},
    NamedRole{"vertex", "ny", PlyRole::kNormalY},
    NamedRole{"vertex", "nz", PlyRole::kNormalZ},
    NamedRole{"vertex", "red", PlyRole::kRed},
    NamedRole{"vertex", "green", PlyRole::kGreen},
    NamedRole{"vertex", "blue", PlyRole::kBlue},
    NamedRole{"face", "vertex_indices", PlyRole::kFace},
    NamedRole{"face", "vertex_index", PlyRole::kFace},
    NamedRole{"tristrips", "vertex_indices", PlyRole::kStrip},
    NamedRole{"tristrips", "vertex_index", PlyRole::kStrip},
};

PlyRole role_of(std::string_view element, std::string_view property) {
    const auto* const found =
        std::find_if(kRoles.begin(), kRoles.end(), [&](const NamedRole& named) {
            return named.element == element && named.property == property;
        });
    return found == kRoles.end() ? PlyRole::kNone : found->role;
}

bool is_list_role(PlyRole role) { return role == PlyRole::kFace || role == PlyRole::kStrip; }

/// The words of a line; at most as many as any statement has, and one more.
std::vector<std::string_view> words_of(std::string_view line) {
    constexpr std::size_t kMostWords = 6;
    std::vector<std::string_view> words;
    for (line = trimmed(line, kBlanks); !line.empty() && words.size() < kMostWords;) {
        const std::size_t length = std::min(line.find_first_of(kBlanks), line.size());
        words.push_back(line.substr(0, length));
        line = trimmed(line.substr(length), kBlanks);
    }
    return words;
}

class HeaderParser {
public:
    HeaderParser(std::string_view text, const std::string& name) : text_(text), name_(name) {}

    PlyHeader run() {
        read_first_line();
        while (!is_done_) read_statement(next_line());
        if (!has_format_) fail("no format before this line; write the file again");
        for (const PlyElement& element : header_.elements) require_roles(element);
        header_.size = at_;
        header_.line_count = line_;
        return std::move(header_);
    }

private:
    [[noreturn]] void fail(const std::string& what) const { fail_at(line_, what); }
    [[noreturn]] void fail_at(std::uint64_t line, const std::string& what) const {
        throw Error(ErrorKind::kBadInput, fmt::format("{}:{}: {}", name_, line, what));
    }

    void read_first_line() {
        line_ = 1;
        const std::size_t length = text_.find_first_of("\r\n"sv);
        const std::string_view first = text_.substr(0, length);
        if (trimmed(first, kBlanks) != "ply")
            fail(R"(not a PLY file; the first line must be "ply")");
        if (length == std::string_view::npos) fail("ends within its header; is it complete?");
        const std::string_view rest = text_.substr(length);
        line_end_ = rest.starts_with("\r\n") ? "\r\n"sv : rest.substr(0, 1);
        at_ = length + line_end_.size();
    }

    std::string_view next_line() {
        ++line_;
        const std::string_view rest = text_.substr(at_);
        const std::size_t length = rest.find(line_end_);
        if (length == std::string_view::npos) {
            if (text_.size() >= kMaxPlyHeaderBytes) {
                fail(fmt::format("no end_header within the first {} bytes; is this a PLY file?",
                                 kMaxPlyHeaderBytes));
            }
            fail("no end_header; is the file complete?");
        }
        const std::string_view line = rest.substr(0, length);
        const auto is_control = [](char c) { return static_cast<unsigned char>(c) < 32; };
        const auto bad = std::find_if(line.begin(), line.end(), [&](char c) {
            return is_control(c) && kBlanks.find(c) == std::string_view::npos;
        });
        if (bad != line.end()) {
            fail(fmt::format("control character 0x{:02X} in the header; is the file damaged?",
                             static_cast<unsigned>(*bad)));
        }
        at_ += length + line_end_.size();
        return line;
    }

    void read_statement(std::string_view line) {
        const std::vector<std::string_view> words = words_of(line);
        if (words.empty() || words[0] == "comment" || words[0] == "obj_info") return;
        if (words[0] == "format") {
            read_format(words);
        } else if (words[0] == "element") {
            read_element(words);
        } else if (words[0] == "property") {
            read_property(words);
        } else if (words[0] == "end_header" && words.size() == 1) {
            is_done_ = true;
        } else {
            fail(fmt::format("unknown statement {} in the header; is the file damaged?",
                             in_quotes(trimmed(line, kBlanks))));
        }
    }

    void read_format(const std::vector<std::string_view>& words) {
        if (has_format_) fail("second format; write the file again");
        if (words.size() != 3 || words[2] != "1.0") {
            fail(
                "format that is not known; write ascii, binary_little_endian or "
                "binary_big_endian, and 1.0");
        }
        if (words[1] == "ascii") {
            header_.encoding = PlyEncoding::kText;
        } else if (words[1] == "binary_little_endian") {
            header_.encoding = PlyEncoding::kLittleEndian;
        } else if (words[1] == "binary_big_endian") {
            header_.encoding = PlyEncoding::kBigEndian;
        } else {
            fail(
                fmt::format("format {} is not known; write ascii, binary_little_endian or "
                            "binary_big_endian",
                            in_quotes(words[1])));
        }
        has_format_ = true;
    }

    void read_element(const std::vector<std::string_view>& words) {
        if (words.size() != 3) fail("element without a name and a number; is the file damaged?");
        const auto count = parse_unsigned(words[2]);
        if (!count) {
            fail(fmt::format("{} is not a number of items; give a whole number from 0 on",
                             in_quotes(words[2])));
        }
        if (!names_.emplace(words[1]).second)
            fail(fmt::format("second element {}; write the file again", in_quotes(words[1])));
        header_.elements.push_back({std::string(words[1]), *count, {}, line_});
        properties_.clear();
    }

    void read_property(const std::vector<std::string_view>& words) {
        if (header_.elements.empty()) fail("property without an element; write the file again");
        PlyElement& element = header_.elements.back();
        const bool is_list = words.size() > 1 && words[1] == "list";
        if (words.size() != (is_list ? 5u : 3u)) {
            fail(
                "property that is not known; write property TYPE NAME, or property list TYPE "
                "TYPE NAME");
        }
        PlyProperty property;
        property.name = words.back();
        property.line = line_;
        property.type = type_of(words[words.size() - 2]);
        if (is_list) {
            property.count_type = type_of(words[2]);
            if (!is_integer(*property.count_type))
                fail(fmt::format("list with numbers of entries of type {}; use an integer type",
                                 words[2]));
        }
        property.role = role_of(element.name, property.name);
        require_kind(property, words[words.size() - 2]);
        require_one_list(element, property);
        if (!properties_.emplace(property.name).second)
            fail(fmt::format("second property {} of an element; write the file again",
                             in_quotes(property.name)));
        element.properties.push_back(std::move(property));
    }

    PlyScalar type_of(std::string_view name) const {
        const auto* const found =
            std::find_if(kTypes.begin(), kTypes.end(),
                         [&](const NamedType& named) { return named.name == name; });
        if (found == kTypes.end()) {
            fail(
                fmt::format("type {} is not known; use char, uchar, short, ushort, int, uint, "
                            "float or double",
                            in_quotes(name)));
        }
        return found->type;
    }

    void require_kind(const PlyProperty& property, std::string_view type) const {
        if (property.role == PlyRole::kNone) return;
        const bool is_list = property.count_type.has_value();
        if (is_list != is_list_role(property.role)) {
            fail(fmt::format("property {} must {}be a list; write the file again", property.name,
                             is_list ? "not " : ""));
        }
        if (is_list && !is_integer(property.type))
            fail(fmt::format("indices of type {}; use an integer type", type));
    }

    void require_one_list(const PlyElement& element, const PlyProperty& property) const {
        if (!is_list_role(property.role)) return;
        for (const PlyProperty& other : element.properties) {
            if (other.role == property.role)
                fail(fmt::format("{} beside {}; keep one of them", property.name, other.name));
        }
    }

    void require_roles(const PlyElement& element) const {
        const auto has = [&](PlyRole role) {
            return std::any_of(element.properties.begin(), element.properties.end(),
                               [&](const PlyProperty& property) { return property.role == role; });
        };
        if (element.name == "vertex") {
            for (const auto& [role, name] :
                 {std::pair{PlyRole::kX, 'x'}, {PlyRole::kY, 'y'}, {PlyRole::kZ, 'z'}}) {
                if (!has(role)) {
                    fail_at(element.line,
                            fmt::format("vertices without {}; they need x, y and z", name));
                }
            }
        } else if (element.name == "face" && element.count > 0 && !has(PlyRole::kFace)) {
            fail_at(element.line,
                    "faces without vertex_indices or vertex_index; write the file "
                    "again with corners");
        }
    }

    const std::string_view text_;
    const std::string& name_;
    std::size_t at_ = 0;
    std::uint64_t line_ = 0;
    std::string_view line_end_;
    bool has_format_ = false;
    bool is_done_ = false;
    /// The elements so far, and the properties of the last one.
    std::set<std::string, std::less<>> names_;
    std::set<std::string, std::less<>> properties_;
    PlyHeader header_;
};

}  // namespace

std::size_t size_of(PlyScalar type) {
    switch (type) {
        case PlyScalar::kInt8:
        case PlyScalar::kUint8:
            return 1;
        case PlyScalar::kInt16:
        case PlyScalar::kUint16:
            return 2;
        case PlyScalar::kInt32:
        case PlyScalar::kUint32:
        case PlyScalar::kFloat:
            return 4;
        case PlyScalar::kDouble:
            break;
    }
    return 8;
}

std::string PlyElement::shown_name() const {
    const bool is_read = name == "vertex" || name == "face" || name == "tristrips";
    return is_read ? name : in_quotes(name);
}

bool PlyElement::has_lists() const {
    return std::any_of(properties.begin(), properties.end(),
                       [](const PlyProperty& property) { return property.count_type.has_value(); });
}

std::uint64_t PlyElement::least_bytes() const {
    std::uint64_t bytes = 0;
    for (const PlyProperty& property : properties)
        bytes += size_of(property.count_type.value_or(property.type));
    return bytes;
}

PlyHeader parse_ply_header(std::string_view text, const std::string& name) {
    return HeaderParser(text, name).run();
}

}  // namespace mray
