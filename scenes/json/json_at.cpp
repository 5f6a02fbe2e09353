#include "scenes/json/json_at.h"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

namespace mray {
namespace {

/// Finds members of an object in logarithmic time, for input that may have any number of them.
using Tree = nlohmann::json;

// Doubles hold all whole numbers up to this one.
constexpr std::uint64_t kMaxCount = std::uint64_t{1} << 53;

const Tree& tree_of(const JsonNode& node) { return reinterpret_cast<const Tree&>(node); }
const JsonNode& node_of(const Tree& tree) { return reinterpret_cast<const JsonNode&>(tree); }

JsonTree keep(Tree&& tree) {
    const auto kept = std::make_shared<const Tree>(std::move(tree));
    return JsonTree({kept, &node_of(*kept)});
}

}  // namespace

JsonTree parse_json(std::string_view text) {
    try {
        return keep(Tree::parse(text.begin(), text.end()));
    } catch (const Tree::parse_error& error) {
        throw JsonSyntaxError(error.byte);
    } catch (const Tree::exception&) {
        throw JsonValueError(ErrorKind::kBadInput, "JSON has a number that is too large");
    }
}

JsonTree parse_json(std::string_view text, const std::string& file) {
    const auto refuse = [&](const std::string& what) {
        return Error(ErrorKind::kBadInput, fmt::format("{}: {}", file, what));
    };
    try {
        return parse_json(text);
    } catch (const JsonSyntaxError& error) {
        throw refuse(
            fmt::format("byte {} of its text is not JSON; is it a glTF file?", error.byte()));
    } catch (const JsonValueError& error) {
        throw refuse(error.what());
    }
}

void JsonAt::fail(const std::string& what, Hint hint) const {
    throw JsonValueError(ErrorKind::kBadInput,
                         path_.empty() ? fmt::format("{}: {}", file_, what)
                                       : fmt::format("{}: {}: {}", file_, path_, what),
                         hint);
}

bool JsonAt::is_null() const { return tree_of(node_).is_null(); }
bool JsonAt::is_boolean() const { return tree_of(node_).is_boolean(); }
bool JsonAt::is_number() const { return tree_of(node_).is_number(); }
bool JsonAt::is_text() const { return tree_of(node_).is_string(); }
bool JsonAt::is_array() const { return tree_of(node_).is_array(); }
bool JsonAt::is_object() const { return tree_of(node_).is_object(); }

std::optional<JsonAt> JsonAt::find(const char* key) const {
    if (!is_object()) fail("must be an object");
    const Tree& value = tree_of(node_);
    const auto member = value.find(key);
    if (member == value.end()) return std::nullopt;
    return JsonAt(node_of(*member), file_, path_.empty() ? key : fmt::format("{}.{}", path_, key));
}

JsonAt JsonAt::at(const char* key) const {
    std::optional<JsonAt> member = find(key);
    if (!member) fail(fmt::format("has no member {}", key));
    return *member;
}

std::size_t JsonAt::size() const {
    if (!is_array()) fail("must be an array");
    return tree_of(node_).size();
}

JsonAt JsonAt::operator[](std::size_t index) const {
    if (index >= size()) fail(fmt::format("has {} elements, and none at {}", size(), index));
    return {node_of(tree_of(node_)[index]), file_, fmt::format("{}[{}]", path_, index)};
}

std::string_view JsonAt::text() const {
    if (!is_text()) fail("must be a string");
    return tree_of(node_).get_ref<const std::string&>();
}

bool JsonAt::boolean() const {
    if (!is_boolean()) fail("must be true or false");
    return tree_of(node_).get<bool>();
}

double JsonAt::number() const {
    if (!is_number()) fail("must be a number");
    return tree_of(node_).get<double>();
}

std::uint64_t JsonAt::count() const {
    const double value = number();
    if (!(value >= 0 && value <= static_cast<double>(kMaxCount)) || std::floor(value) != value)
        fail(fmt::format("is {}; must be a whole number from 0 on", value));
    return static_cast<std::uint64_t>(value);
}

std::optional<std::uint64_t> JsonAt::unsigned_integer() const {
    const Tree& value = tree_of(node_);
    if (!value.is_number_unsigned()) return std::nullopt;
    return value.get<std::uint64_t>();
}

std::uint32_t JsonAt::index_below(std::size_t limit, const char* what) const {
    const std::uint64_t index = count();
    if (index >= limit) fail(fmt::format("is {}, but there are {} {}", index, limit, what));
    return static_cast<std::uint32_t>(index);
}

void JsonAt::numbers(std::span<double> out) const {
    if (size() != out.size()) fail(fmt::format("has {} numbers instead of {}", size(), out.size()));
    for (std::size_t i = 0; i < out.size(); ++i) out[i] = (*this)[i].number();
}

std::uint64_t JsonAt::count_or(const char* key, std::uint64_t otherwise) const {
    const std::optional<JsonAt> member = find(key);
    return member ? member->count() : otherwise;
}

std::optional<std::uint32_t> JsonAt::index_or_none(const char* key, std::size_t limit,
                                                   const char* what) const {
    const std::optional<JsonAt> member = find(key);
    return member ? std::optional(member->index_below(limit, what)) : std::nullopt;
}

}  // namespace mray
