#include "clips/ply/ply_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "common/base/errors.h"
#include "common/text/message_text.h"
#include "common/text/number_text.h"

namespace mray {
namespace {

bool is_blank(char c) { return c == ' ' || c == '\t'; }
bool is_line_end(char c) { return c == '\n' || c == '\r'; }

class TextBody {
public:
    TextBody(std::string_view text, const PlyHeader& header, const std::string& name, PlyMesh& mesh)
        : rest_(text), next_line_(header.line_count + 1), name_(name), mesh_(mesh), place_([this] {
              return place();
          }) {}

    void read(const PlyElement& element) {
        if (element.properties.empty()) return;
        const bool is_read = std::any_of(
            element.properties.begin(), element.properties.end(),
            [](const PlyProperty& property) { return property.role != PlyRole::kNone; });
        for (std::uint64_t item = 0; item < element.count; ++item) {
            next_row(element, item);
            if (is_read) read_row(element, static_cast<std::size_t>(item));
        }
    }

    std::string_view rest() {
        skip_blank_lines();
        return rest_;
    }

private:
    std::string place() const { return fmt::format("{}:{}", name_, line_); }
    [[noreturn]] void fail(const std::string& what) const {
        throw Error(ErrorKind::kBadInput, fmt::format("{}: {}", place(), what));
    }

    void skip_blank_lines() {
        std::size_t i = 0;
        for (; i < rest_.size(); ++i) {
            if (rest_[i] == '\n' || (rest_[i] == '\r' && !rest_.substr(i + 1).starts_with('\n')))
                ++next_line_;
            else if (!is_blank(rest_[i]) && rest_[i] != '\r')
                break;
        }
        rest_.remove_prefix(i);
    }

    /// Makes row_ the next line that is not blank.
    void next_row(const PlyElement& element, std::uint64_t item) {
        skip_blank_lines();
        line_ = next_line_;
        if (rest_.empty()) {
            fail(fmt::format("ends before {} {} of {}; is the file complete?", element.shown_name(),
                             item, element.count));
        }
        const auto* const end = std::find_if(rest_.begin(), rest_.end(), is_line_end);
        row_ = rest_.substr(0, static_cast<std::size_t>(end - rest_.begin()));
        rest_.remove_prefix(row_.size());
        value_count_ = 0;
    }

    std::string_view next_value(const PlyProperty& property) {
        std::size_t begin = 0;
        while (begin < row_.size() && is_blank(row_[begin])) ++begin;
        std::size_t end = begin;
        while (end < row_.size() && !is_blank(row_[end])) ++end;
        const std::string_view value = row_.substr(begin, end - begin);
        if (value.empty()) {
            fail(fmt::format("line of {} values, none for {}; is the file complete?", value_count_,
                             in_quotes(property.name)));
        }
        row_.remove_prefix(end);
        ++value_count_;
        return value;
    }

    void read_row(const PlyElement& element, std::size_t item) {
        for (const PlyProperty& property : element.properties) {
            if (property.count_type) {
                read_list(property);
            } else if (property.role == PlyRole::kNone) {
                next_value(property);
            } else {
                mesh_.components(property.role)[item][PlyMesh::axis_of(property.role)] =
                    read_component(property);
            }
        }
        if (std::all_of(row_.begin(), row_.end(), is_blank)) return;
        fail(fmt::format("more values than the {} that {} has; is the header right?", value_count_,
                         in_quotes(element.name)));
    }

    float read_component(const PlyProperty& property) {
        const std::string_view token = next_value(property);
        if (property.role >= PlyRole::kRed && property.type == PlyScalar::kUint8) {
            const auto channel = parse_unsigned(token);
            if (!channel || *channel > 255) {
                fail(fmt::format("colour {} is no whole number from 0 to 255; repair it",
                                 in_quotes(token)));
            }
            return PlyMesh::linear_channel(static_cast<std::uint8_t>(*channel));
        }
        const auto number = parse_float(token);
        if (!number) fail(not_a_number(token));
        float value = *number;
        if (property.role <= PlyRole::kZ) mesh_.check_coordinate(value, token, place_);
        if (property.role >= PlyRole::kRed) mesh_.check_channel(value, place_);
        return value;
    }

    std::int64_t read_integer(const PlyProperty& property) {
        const std::string_view token = next_value(property);
        const auto number = parse_integer(token);
        if (!number) {
            fail(fmt::format("{} is not a whole number; {} needs one", in_quotes(token),
                             in_quotes(property.name)));
        }
        return *number;
    }

    void read_list(const PlyProperty& property) {
        const std::int64_t count = read_integer(property);
        // Each entry takes a blank and a digit.
        if (count < 0 || static_cast<std::uint64_t>(count) > row_.size() / 2) {
            fail(
                fmt::format("list of {} entries, which this line does not have; is the file "
                            "complete?",
                            count));
        }
        if (property.role == PlyRole::kNone) {
            for (std::int64_t i = 0; i < count; ++i) next_value(property);
            return;
        }
        corners_.clear();
        for (std::int64_t i = 0; i < count; ++i) corners_.push_back(read_integer(property));
        if (property.role == PlyRole::kFace)
            mesh_.add_face(corners_, place_);
        else
            mesh_.add_strips(corners_, place_);
    }

    std::string_view rest_;
    /// The number of the line that rest_ begins in, and of that of row_.
    std::uint64_t next_line_;
    std::uint64_t line_ = 0;
    std::string_view row_;
    std::size_t value_count_ = 0;
    std::vector<std::int64_t> corners_;
    const std::string& name_;
    PlyMesh& mesh_;
    const PlyMesh::Place place_;
};

}  // namespace

std::string_view read_ply_text(std::string_view text, const PlyHeader& header,
                               const std::string& name, PlyMesh& mesh) {
    TextBody body(text, header, name, mesh);
    for (const PlyElement& element : header.elements) body.read(element);
    return body.rest();
}

}  // namespace mray
