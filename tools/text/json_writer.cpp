#include "tools/text/json_writer.h"

#include <algorithm>
#include <cassert>
#include <nlohmann/json.hpp>

namespace mray {
namespace {

using Tree = nlohmann::ordered_json;

/// The value as one of the library, which writes it.
struct TreeMaker {
    template <class Leaf>
    Tree operator()(const Leaf& leaf) const {
        return leaf;
    }
    Tree operator()(const Json::Array& values) const {
        Tree tree = Tree::array();
        for (const Json& value : values) tree.push_back(std::visit(*this, value.value()));
        return tree;
    }
    Tree operator()(const Json::Object& members) const {
        Tree tree = Tree::object();
        for (const auto& [name, value] : members)
            tree.emplace(name, std::visit(*this, value.value()));
        return tree;
    }
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
    auto& members = std::get<Object>(value_);
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
    for (const auto& [name, value] : std::get<Object>(other.value_)) (*this)[name] = value;
}

std::string json_text(const Json& json, int indent) {
    return std::visit(TreeMaker{}, json.value())
               .dump(indent, ' ', false, Tree::error_handler_t::replace) +
           "\n";
}

}  // namespace mray
