#include "clips/obj/obj_checker.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <string_view>

#include "common/base/errors.h"
#include "common/text/message_text.h"
#include "common/text/number_text.h"

namespace mray {
namespace {

using namespace std::string_view_literals;

// Statements of the format (Alias|Wavefront, "Object Files (.obj)", and the skinning and tag
// extensions of tinyobjloader) that do not concern triangles.
constexpr std::array kUnusedKeywords = {
    "vn"sv,     "vt"sv,    "vp"sv,    "g"sv,        "o"sv,          "s"sv,         "l"sv,
    "p"sv,      "mg"sv,    "deg"sv,   "bmat"sv,     "step"sv,       "cstype"sv,    "curv"sv,
    "curv2"sv,  "surf"sv,  "parm"sv,  "trim"sv,     "hole"sv,       "scrv"sv,      "sp"sv,
    "end"sv,    "con"sv,   "bevel"sv, "c_interp"sv, "d_interp"sv,   "lod"sv,       "usemap"sv,
    "maplib"sv, "ctech"sv, "stech"sv, "call"sv,     "shadow_obj"sv, "trace_obj"sv, "t"sv,
    "vw"sv,     "fo"sv};

constexpr std::size_t kMaxVertexNumbers = 8;  // x y z w r g b a

constexpr char kEndMark = '\x1a';

/// Reads a text that Microsoft's C library wrote until 2015 for a number that is not finite, such
/// as 1.#INF and -1.#IND00. Returns nothing for any other text.
std::optional<float> parse_old_not_finite(std::string_view text) {
    if (text.starts_with('-') || text.starts_with('+')) text.remove_prefix(1);
    if (!text.starts_with("1.#"sv)) return std::nullopt;
    text.remove_prefix(3);
    while (text.ends_with('0')) text.remove_suffix(1);
    // Signs of infinities make no difference: neither is a coordinate.
    if (text == "INF"sv) return std::numeric_limits<float>::infinity();
    if (text == "IND"sv || text == "QNAN"sv || text == "SNAN"sv)
        return std::numeric_limits<float>::quiet_NaN();
    return std::nullopt;
}

bool blank(char c) { return c == ' ' || c == '\t'; }
bool line_end(char c) { return c == '\n' || c == '\r'; }

// Bytes that text does not contain: NUL, and control characters other than tab, line ends and form
// feed.
constexpr std::array<bool, 256> make_control_table() {
    std::array<bool, 256> table = {};
    for (std::size_t c = 0; c < 32; ++c)
        table[c] = c != '\t' && c != '\n' && c != '\r' && c != '\f';
    return table;
}
constexpr std::array<bool, 256> kControl = make_control_table();

class Checker {
public:
    Checker(std::string& text, const std::string& name, const ObjCheckOptions& options)
        : name_(name),
          lenient_(options.lenient),
          rules_(options.lenient, options.max_triangles),
          with_normals_(options.normals),
          with_texcoords_(options.texcoords),
          begin_(text.data()),
          at_(text.data()),
          end_(text.data() + text.size()) {}

    CheckedObj run(const WarnFunction& warn) {
        skip_byte_order_mark();
        blank_end_marks();
        while (at_ != end_) check_statement();
        if (!lenient_ && largest_index_ > static_cast<std::int64_t>(checked_.positions.size())) {
            line_ = largest_index_line_;
            fail(
                fmt::format("vertex {} of {}; indices start at 1 and end at the number of vertices",
                            largest_index_, checked_.positions.size()));
        }
        unknown_.tell(warn);
        rules_.tell(warn);
        return std::move(checked_);
    }

private:
    [[noreturn]] void fail(const std::string& what, Remedy remedy = Remedy::kNone) const {
        throw Error(ErrorKind::kBadInput, fmt::format("{}: {}", place(), what), remedy);
    }
    std::string place() const { return fmt::format("{}:{}", name_, line_); }

    void skip_byte_order_mark() {
        const std::string_view text(begin_, static_cast<std::size_t>(end_ - begin_));
        if (text.starts_with("\xEF\xBB\xBF")) {
            std::fill_n(begin_, 3, ' ');
        } else if (text.starts_with("\xFF\xFE") || text.starts_with("\xFE\xFF")) {
            fail("is UTF-16 text; save it as UTF-8 or ASCII");
        }
    }

    // Blanks the Ctrl-Z with which programs of DOS end a text.
    void blank_end_marks() {
        for (char* last = end_; last != begin_; --last) {
            char& c = last[-1];
            if (c != kEndMark && !blank(c) && !line_end(c)) return;
            if (c == kEndMark) c = ' ';
        }
    }

    // Moves at_ past the line and returns its end.
    char* scan_line() {
        while (at_ != end_ && !line_end(*at_)) {
            if (kControl[static_cast<unsigned char>(*at_)]) {
                fail(*at_ == '\0' ? "NUL byte; this is binary data or UTF-16, save it as UTF-8 text"
                                  : fmt::format("control character 0x{:02X}; this is no text file",
                                                static_cast<unsigned>(*at_)));
            }
            ++at_;
        }
        char* const line_end_at = at_;
        if (at_ != end_) {
            if (*at_ == '\r' && at_ + 1 != end_ && at_[1] == '\n') ++at_;
            ++at_;
        }
        return line_end_at;
    }

    // A statement is one line, or several lines that all but the last end in a backslash.
    void check_statement() {
        line_ = next_line_;
        char* first = at_;
        char* last = scan_line();
        ++next_line_;
        while (first != last && (blank(*first) || *first == '\f')) *first++ = ' ';
        if (first == last) return;
        if (*first == '#') {
            require_short(first, last);
            return;
        }
        while (last != first && last[-1] == '\\' && at_ != end_) {
            std::fill(last - 1, at_, ' ');
            last = scan_line();
            ++next_line_;
        }
        dispatch(first, last);
    }

    void require_short(const char* first, const char* last) const {
        if (static_cast<std::size_t>(last - first) <= kMaxLineBytes) return;
        fail(fmt::format("line of {} bytes; at most {} are read, is this an OBJ file?",
                         last - first, kMaxLineBytes));
    }

    void dispatch(char* first, char* last) {
        char* arguments = std::find_if(first, last, blank);
        const std::string_view keyword(first, static_cast<std::size_t>(arguments - first));
        if (keyword == "v") {
            check_vertex(arguments, last);
        } else if (keyword == "f") {
            check_face(first, arguments, last);
        } else if (keyword == "usemtl" || keyword == "mtllib") {
            require_short(first, last);
            if (std::all_of(arguments, last, blank)) hide(first);
        } else {
            require_short(first, last);
            if (with_normals_ && keyword == "vn") keep_normal(arguments, last);
            if (with_texcoords_ && keyword == "vt") keep_texcoord(arguments, last);
            if (std::find(kUnusedKeywords.begin(), kUnusedKeywords.end(), keyword) ==
                kUnusedKeywords.end()) {
                unknown_.add([&] {
                    return Warning{
                        place(), fmt::format("unknown statement {}; ignored", in_quotes(keyword))};
                });
            }
            hide(first);
        }
    }

    // Makes a statement a comment. Its other lines have been joined to the first one.
    static void hide(char* first) { *first = '#'; }

    // The next token, empty at the end of the statement or at a comment, which is blanked.
    static std::string_view next_token(char*& at, char* last) {
        at = std::find_if_not(at, last, blank);
        if (at != last && *at == '#') {
            std::fill(at, last, ' ');
            at = last;
        }
        char* const token = at;
        at = std::find_if(at, last, blank);
        return {token, static_cast<std::size_t>(at - token)};
    }

    void check_vertex(char* at, char* last) {
        require_short(at, last);
        vec3 position(0.0f);
        int count = 0;
        for (;;) {
            const std::string_view token = next_token(at, last);
            if (token.empty()) break;
            std::optional<float> number = parse_float(token);
            if (!number) number = parse_old_not_finite(token);
            if (!number) fail(not_a_number(token));
            if (count < 3) position[count] = checked_coordinate(*number, token);
            if (++count > static_cast<int>(kMaxVertexNumbers)) {
                fail("vertex of more than 8 numbers; one line holds one vertex");
            }
        }
        if (count < 3) {
            fail(fmt::format("vertex of {} numbers where 3 are needed; is the file complete?",
                             count));
        }
        checked_.positions.push_back(position);
    }

    float checked_coordinate(float value, std::string_view token) {
        if (!MeshRules::is_good(value))
            rules_.take_bad_coordinate(value, token, [this] { return place(); });
        return value;
    }

    void keep_normal(char* at, char* last) {
        std::array<float, 3>& normal = checked_.normals.emplace_back();
        for (float& component : normal) {
            const std::string_view token = next_token(at, last);
            const float value = parse_float(token).value_or(0.0f);
            // NaN equals nothing, and -0 is 0.
            component = std::isnan(value) ? 0.0f : value + 0.0f;
        }
    }

    void keep_texcoord(char* at, char* last) {
        Texcoord& texcoord = checked_.texcoords.emplace_back();
        for (float* component : {&texcoord.u, &texcoord.v}) {
            const std::string_view token = next_token(at, last);
            if (token.empty()) return;
            const std::optional<float> number = parse_float(token);
            if (number && std::isfinite(*number)) {
                *component = *number;
                continue;
            }
            checked_.odd_texcoords.add([&] {
                return Warning{place(), fmt::format("texture coordinate {} is not a finite number; "
                                                    "taken as 0",
                                                    in_quotes(token))};
            });
        }
    }

    void forget_corners(std::size_t first) {
        if (with_normals_) checked_.corner_normals.resize(first);
        if (with_texcoords_) checked_.corner_texcoords.resize(first);
    }

    void check_face(char* first, char* at, char* last) {
        const std::size_t first_corner =
            with_normals_ ? checked_.corner_normals.size() : checked_.corner_texcoords.size();
        std::uint64_t corners = 0;
        for (;;) {
            const std::string_view token = next_token(at, last);
            if (token.empty()) break;
            if (!check_corner(token)) {
                forget_corners(first_corner);
                hide(first);
                return;
            }
            ++corners;
        }
        // A file without a final line end may have been cut.
        if (!rules_.keeps_face(corners, last == end_, [this] { return place(); })) {
            forget_corners(first_corner);
            hide(first);
            return;
        }
        ++checked_.face_count;
        checked_.corner_count += corners;
        rules_.count_face(corners, [this] { return place(); });
    }

    // A corner is v, v/vt, v//vn or v/vt/vn; vt and vn may be left out, but not the slash between
    // them. Blanks all but v. Returns whether the face is kept.
    bool check_corner(std::string_view token) {
        const std::size_t slash = std::min(token.find('/'), token.size());
        const std::optional<std::int64_t> index = parse_index(token.substr(0, slash));
        const auto vertex_count = static_cast<std::int64_t>(checked_.positions.size());
        std::string problem;
        if (!index || !check_attributes(token.substr(slash))) {
            problem = fmt::format("{} is not a corner; write v, v/vt, v//vn or v/vt/vn",
                                  in_quotes(token));
        } else if (*index == 0) {
            problem = "vertex 0; indices start at 1";
        } else if (*index < -vertex_count) {
            problem = fmt::format("vertex {} relative to {} so far; is the file complete?", *index,
                                  vertex_count);
        } else if (*index > std::numeric_limits<int>::max()) {
            problem = fmt::format("vertex {}; no scene has that many vertices",
                                  in_quotes(token.substr(0, slash)));
        }
        if (!problem.empty()) {
            rules_.leave_out(problem, [this] { return place(); });
            return false;
        }
        if (*index > largest_index_) {
            largest_index_ = *index;
            largest_index_line_ = line_;
        }
        keep_attributes(token.substr(slash));
        char* const rest = begin_ + (token.data() - begin_) + slash;
        std::fill_n(rest, token.size() - slash, ' ');
        return true;
    }

    // `text` is "", "/vt", "//vn" or "/vt/vn", and checked.
    void keep_attributes(std::string_view text) {
        const std::string_view both = text.substr(std::min<std::size_t>(text.size(), 1));
        const std::size_t slash = std::min(both.find('/'), both.size());
        if (with_texcoords_) {
            checked_.corner_texcoords.push_back(
                attribute_of(both.substr(0, slash), checked_.texcoords.size()));
        }
        if (with_normals_) {
            checked_.corner_normals.push_back(attribute_of(
                both.substr(std::min(both.size(), slash + 1)), checked_.normals.size()));
        }
    }

    // The attribute of this number, from 1, or relative to `count` if negative.
    static std::uint32_t attribute_of(std::string_view number, std::size_t size) {
        const auto count = static_cast<std::int64_t>(size);
        const std::int64_t index = parse_index(number).value_or(0);
        const std::int64_t at = index > 0 ? index - 1 : count + index;
        const bool is_there = index != 0 && at >= 0 && at < count;
        return is_there ? static_cast<std::uint32_t>(at) : kNoAttribute;
    }

    // "", "/vt", "//vn" or "/vt/vn" with any integers or none.
    static bool check_attributes(std::string_view text) {
        if (text.empty()) return true;
        text.remove_prefix(1);
        const std::size_t slash = std::min(text.find('/'), text.size());
        return is_index_or_none(text.substr(0, slash)) &&
               is_index_or_none(text.substr(std::min(text.size(), slash + 1)));
    }
    static bool is_index_or_none(std::string_view text) {
        return text.empty() || parse_index(text).has_value();
    }

    // An integer that may have a sign of either kind.
    static std::optional<std::int64_t> parse_index(std::string_view text) {
        const bool is_signed = text.size() > 1 && text[0] == '+' && text[1] != '-';
        return parse_integer(text.substr(is_signed ? 1 : 0));
    }

    const std::string& name_;
    const bool lenient_;
    MeshRules rules_;
    const bool with_normals_;
    const bool with_texcoords_;
    char* const begin_;
    char* at_;
    char* const end_;
    std::uint64_t line_ = 1;
    std::uint64_t next_line_ = 1;
    std::int64_t largest_index_ = 0;
    std::uint64_t largest_index_line_ = 0;
    CheckedObj checked_;
    WarningCount unknown_;
};

}  // namespace

CheckedObj check_obj(std::string& text, const std::string& name, const ObjCheckOptions& options) {
    return Checker(text, name, options).run(options.warn);
}

}  // namespace mray
