// The statements of an OBJ text, and their words.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <string>
#include <string_view>

#include "common/base/errors.h"

namespace mray {

inline constexpr std::string_view kBlanks = " \t\f";

/// Splits a text into statements and refuses what is no text. `name` is the file in messages.
class ObjLines {
public:
    ObjLines(std::string_view text, std::string name) : rest_(text), name_(std::move(name)) {
        if (rest_.starts_with("\xEF\xBB\xBF")) rest_.remove_prefix(3);
    }

    bool at_end() const { return rest_.empty(); }
    /// A line, or several of which all but the last end in a backslash. Valid until the next call.
    std::string_view next() {
        line_ = next_line_;
        std::string_view statement = take_line();
        statement.remove_prefix(std::min(statement.find_first_not_of(kBlanks), statement.size()));
        if (!statement.ends_with('\\') || statement.starts_with('#') || at_end()) return statement;
        joined_ = statement;
        while (joined_.ends_with('\\') && !at_end()) {
            joined_.back() = ' ';
            joined_ += take_line();
        }
        return joined_;
    }

    /// The line that the current statement begins in.
    std::uint64_t line() const { return line_; }
    /// Whether the current statement ends the file without a line end.
    bool may_be_cut() const { return !has_line_end_; }
    std::string place() const { return fmt::format("{}:{}", name_, line_); }
    [[noreturn]] void fail(const std::string& what) const {
        throw Error(ErrorKind::kBadInput, "{}: {}", place(), what);
    }

private:
    std::string_view take_line() {
        ++next_line_;
        std::size_t length = 0;
        for (; length < rest_.size() && rest_[length] != '\n' && rest_[length] != '\r'; ++length) {
            const auto c = static_cast<unsigned char>(rest_[length]);
            if (c >= 32 || c == '\t' || c == '\f') continue;
            fail(
                fmt::format("control character 0x{:02X}; this is binary data or UTF-16, save it as "
                            "UTF-8 text",
                            c));
        }
        const std::string_view line = rest_.substr(0, length);
        has_line_end_ = length < rest_.size();
        rest_.remove_prefix(length);
        if (has_line_end_) rest_.remove_prefix(rest_.starts_with("\r\n") ? 2 : 1);
        return line;
    }

    std::string_view rest_;
    const std::string name_;
    std::uint64_t line_ = 1;
    std::uint64_t next_line_ = 1;
    bool has_line_end_ = false;
    std::string joined_;
};

inline bool is_blank(char c) { return c == ' ' || c == '\t'; }

/// Takes the next word of a statement; empty at its end or at a comment.
inline std::string_view next_word(std::string_view& rest) {
    const auto* const begin = std::find_if_not(rest.begin(), rest.end(), is_blank);
    if (begin == rest.end() || *begin == '#') return {};
    const auto* const end = std::find_if(begin, rest.end(), is_blank);
    rest = std::string_view(end, static_cast<std::size_t>(rest.end() - end));
    return {begin, static_cast<std::size_t>(end - begin)};
}

}  // namespace mray
