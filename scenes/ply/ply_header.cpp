#include "scenes/ply/ply_header.h"

#include <fmt/format.h>

#include <cstring>
#include <type_traits>
#include <utility>

#include "common/base/errors.h"
#include "common/text/number_text.h"
#include "common/text/text_parts.h"

namespace mray {
namespace {

constexpr std::string_view kBlanks = " \t\r";

template <class Number>
constexpr PlyType type_named(std::string_view name, std::string_view other) {
    constexpr auto kValue = [](const char* bytes) {
        Number number;
        std::memcpy(&number, bytes, sizeof(Number));
        return static_cast<double>(number);
    };
    return {{name, other}, sizeof(Number), std::is_integral_v<Number>, kValue};
}

constexpr PlyType kPlyTypes[] = {
    type_named<std::int8_t>("char", "int8"),    type_named<std::uint8_t>("uchar", "uint8"),
    type_named<std::int16_t>("short", "int16"), type_named<std::uint16_t>("ushort", "uint16"),
    type_named<std::int32_t>("int", "int32"),   type_named<std::uint32_t>("uint", "uint32"),
    type_named<float>("float", "float32"),      type_named<double>("double", "float64"),
};

/// The words of a line; at most as many as any statement has, and one more.
std::vector<std::string_view> words_of(std::string_view line) {
    constexpr std::size_t kMostWords = 6;
    std::vector<std::string_view> words;
    for (line = trimmed(line, kBlanks); !line.empty() && words.size() < kMostWords;) {
        words.push_back(line.substr(0, line.find_first_of(kBlanks)));
        line = trimmed(line.substr(words.back().size()), kBlanks);
    }
    return words;
}

class HeaderParser {
public:
    HeaderParser(std::string_view text, const std::string& name) : text_(text), name_(name) {}

    PlyHeader run() {
        const std::string_view first = text_.substr(0, text_.find_first_of("\r\n"));
        if (trimmed(first, kBlanks) != "ply")
            fail(R"(not a PLY file; the first line must be "ply")");
        const std::string_view rest = text_.substr(first.size());
        line_end_ = rest.starts_with("\r\n") ? "\r\n" : rest.substr(0, 1);
        header_.size = first.size() + line_end_.size();
        bool has_format = false;
        for (bool is_done = line_end_.empty(); !is_done;) {
            const std::string_view line = next_line();
            const std::vector<std::string_view> words = words_of(line);
            if (words.empty() || words[0] == "comment" || words[0] == "obj_info") continue;
            if (words[0] == "format") {
                read_format(words);
                has_format = true;
            } else if (words[0] == "element") {
                read_element(words);
            } else if (words[0] == "property") {
                read_property(words);
            } else if (words[0] == "end_header") {
                is_done = true;
            } else {
                fail(fmt::format("unknown statement {} in the header; is the file damaged?",
                                 quote(trimmed(line, kBlanks))));
            }
        }
        if (!has_format) fail("no format before this line; is the file complete?");
        for (const PlyElement& element : header_.elements) require_meaning(element);
        require_size();
        return std::move(header_);
    }

private:
    [[noreturn]] void fail(const std::string& what) const { fail_at(header_.line_count, what); }
    [[noreturn]] void fail_at(std::uint64_t line, const std::string& what) const {
        throw Error(ErrorKind::kBadInput, "{}:{}: {}", name_, line, what);
    }

    std::string_view next_line() {
        ++header_.line_count;
        const std::string_view rest = text_.substr(header_.size);
        const std::size_t length = rest.find(line_end_);
        if (length == std::string_view::npos) fail("no end_header; is the file complete?");
        header_.size += length + line_end_.size();
        return rest.substr(0, length);
    }

    void read_format(const std::vector<std::string_view>& words) {
        constexpr std::array<std::string_view, 3> kNames = {"ascii", "binary_little_endian",
                                                            "binary_big_endian"};
        const auto* const found =
            words.size() == 3 ? std::ranges::find(kNames, words[1]) : kNames.end();
        if (found == kNames.end() || words[2] != "1.0") {
            fail(
                "format that is not known; write ascii, binary_little_endian or "
                "binary_big_endian, and 1.0");
        }
        header_.encoding = static_cast<PlyEncoding>(found - kNames.begin());
    }

    void read_element(const std::vector<std::string_view>& words) {
        const auto count = words.size() == 3 ? parse_unsigned(words[2]) : std::nullopt;
        if (!count) fail("element without a name and a number of items; write the file again");
        if (words[1] == "vertex" &&
            std::ranges::count(header_.elements, words[1], &PlyElement::name) > 0)
            fail("second element vertex; write the file again");
        header_.elements.push_back({std::string(words[1]), *count, {}, header_.line_count});
    }

    void read_property(const std::vector<std::string_view>& words) {
        if (header_.elements.empty()) fail("property without an element; write the file again");
        const bool is_list = words.size() == 5 && words[1] == "list";
        const PlyType* const type = words.size() < 3 ? nullptr : type_of(words[words.size() - 2]);
        const PlyType* const count_type = is_list ? type_of(words[2]) : nullptr;
        const bool is_counted = count_type != nullptr && count_type->is_integer;
        if (type == nullptr || (is_list ? !is_counted : words.size() != 3)) {
            fail(
                "property that is not known; write property TYPE NAME, or property list INTEGER "
                "TYPE NAME, with types char, uchar, short, ushort, int, uint, float or double");
        }
        PlyProperty property{std::string(words.back()), type, count_type};
        PlyElement& element = header_.elements.back();
        property.has_corners =
            element.may_have_faces() && is_list && type->is_integer &&
            (property.name == "vertex_indices" || property.name == "vertex_index");
        element.properties.push_back(std::move(property));
    }

    static const PlyType* type_of(std::string_view name) {
        for (const PlyType& type : kPlyTypes)
            if (std::ranges::count(type.names, name) > 0) return &type;
        return nullptr;
    }

    void require_meaning(const PlyElement& element) const {
        if (element.name == "vertex" && !element.has(kPlyPosition))
            fail_at(element.line, "vertices without x, y or z; write the file again");
        if (element.may_have_faces() && element.count > 0 && !element.has_faces()) {
            fail_at(element.line,
                    "faces without vertex_indices or vertex_index, a list of integers; write the "
                    "file again with corners");
        }
    }

    /// Refuses numbers of items that do not fit into the file.
    void require_size() const {
        const bool is_text = header_.encoding == PlyEncoding::kText;
        // The last line of a text may lack its end.
        std::uint64_t left = text_.size() - header_.size + (is_text ? 1 : 0);
        for (const PlyElement& element : header_.elements) {
            // A value in text takes a digit and a blank or line end.
            std::uint64_t bytes = 0;
            for (const PlyProperty& property : element.properties)
                bytes += is_text ? 2 : property.first_type().size;
            if (bytes != 0 && element.count > left / bytes) {
                fail_at(element.line,
                        fmt::format("{} items of {}, which {} bytes cannot hold; is the file "
                                    "complete?",
                                    element.count, quote(element.name), left));
            }
            left -= element.count * bytes;
        }
    }

    const std::string_view text_;
    const std::string& name_;
    std::string_view line_end_;
    PlyHeader header_;
};

}  // namespace

PlyHeader parse_ply_header(std::string_view text, const std::string& name) {
    return HeaderParser(text, name).run();
}

}  // namespace mray
