#include "common/report/json_writer.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <nlohmann/json.hpp>

namespace mray {
namespace {

/// Appends values to a text. The JSON library writes numbers and texts, one at a time: a tree of
/// its values is no longer sound once memory for a part of it has not sufficed.
class Writer {
public:
    /// `indent` as for json_text().
    explicit Writer(int indent) : indent_(indent) {}

    void operator()(std::nullptr_t) { out_ += "null"; }
    void operator()(bool value) { out_ += value ? "true" : "false"; }
    void operator()(std::int64_t value) { out_ += std::to_string(value); }
    void operator()(std::uint64_t value) { out_ += std::to_string(value); }
    void operator()(double value) {
        if (!std::isfinite(value)) return (*this)(nullptr);
        std::array<char, 64> text;
        const char* const end =
            nlohmann::detail::to_chars(text.data(), text.data() + text.size(), value);
        out_.append(text.data(), static_cast<std::size_t>(end - text.data()));
    }
    void operator()(const std::string& text) {
        out_ += nlohmann::json(text).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
    }
    void operator()(const Json::Array& values) {
        write_list(
            '[', values, [this](const Json& value) { std::visit(*this, value.value()); }, ']');
    }
    void operator()(const Json::Object& object) {
        const auto write_member = [this](const Json::Member& member) {
            (*this)(member.first);
            out_ += indent_ < 0 ? ":" : ": ";
            std::visit(*this, member.second.value());
        };
        write_list('{', object.members, write_member, '}');
    }

    std::string take() { return std::move(out_); }

private:
    template <class List, class Write>
    void write_list(char open, const List& list, Write write, char close) {
        out_ += open;
        ++level_;
        for (std::size_t i = 0; i < list.size(); ++i) {
            if (i > 0) out_ += ',';
            begin_line();
            write(list[i]);
        }
        --level_;
        if (!list.empty()) begin_line();
        out_ += close;
    }
    void begin_line() {
        if (indent_ < 0) return;
        out_ += '\n';
        out_.append(static_cast<std::size_t>(indent_) * level_, ' ');
    }

    int indent_;
    std::size_t level_ = 0;
    std::string out_;
};

/// The name of a member that is written as a pair; null for any other value.
const std::string* name_of(const Json& json) {
    const auto* pair = std::get_if<Json::Array>(&json.value());
    return pair && pair->size() == 2 ? std::get_if<std::string>(&pair->front().value()) : nullptr;
}

}  // namespace

Json::Json(std::initializer_list<Json> values) {
    if (!std::ranges::all_of(values, name_of)) {
        value_ = Array(values);
        return;
    }
    value_ = Object();
    for (const Json& value : values) (*this)[*name_of(value)] = std::get<Array>(value.value_)[1];
}

Json Json::array() {
    Json json;
    json.value_ = Array();
    return json;
}

Json& Json::operator[](std::string_view name) {
    if (std::holds_alternative<std::nullptr_t>(value_)) value_ = Object();
    assert(std::holds_alternative<Object>(value_));
    std::vector<Member>& members = std::get<Object>(value_).members;
    const auto found = std::ranges::find(members, name, &Member::first);
    return found != members.end() ? found->second : members.emplace_back(name, Json()).second;
}

void Json::push_back(Json value) {
    if (std::holds_alternative<std::nullptr_t>(value_)) value_ = Array();
    assert(std::holds_alternative<Array>(value_));
    std::get<Array>(value_).push_back(std::move(value));
}

Json& Json::back() { return std::get<Array>(value_).back(); }

void Json::update(const Json& other) {
    for (const auto& [name, value] : std::get<Object>(other.value_).members) (*this)[name] = value;
}

std::string json_text(const Json& json, int indent) {
    Writer writer(indent);
    std::visit(writer, json.value());
    return writer.take() + "\n";
}

}  // namespace mray
