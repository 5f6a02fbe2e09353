#include "common/scene/formats/gltf/file/json_at.h"

#include <fmt/format.h>

#include <cmath>
#include <utility>

namespace mray::gltf {
namespace {

constexpr int kMaxDepth = 64;
constexpr std::uint64_t kMaxValues = std::uint64_t{1} << 20;
// Doubles hold all whole numbers up to this one.
constexpr std::uint64_t kMaxCount = std::uint64_t{1} << 53;

[[noreturn]] void refuse(const std::string& file, const std::string& what) {
    throw Error(ErrorKind::kBadInput, fmt::format("{}: {}", file, what));
}

}  // namespace

JsonTree parse_json(std::string_view text, const std::string& file) {
    std::uint64_t values = 0;
    const auto check = [&](int depth, JsonTree::parse_event_t event, JsonTree&) {
        if (depth > kMaxDepth)
            refuse(file, fmt::format("JSON has brackets in more than {} others", kMaxDepth));
        using Event = JsonTree::parse_event_t;
        if (event == Event::value || event == Event::object_start || event == Event::array_start)
            ++values;
        if (values > kMaxValues)
            refuse(file, fmt::format("JSON has more than {} values; split the scene", kMaxValues));
        return true;
    };
    try {
        return JsonTree::parse(text.begin(), text.end(), check);
    } catch (const JsonTree::parse_error& error) {
        refuse(file,
               fmt::format("byte {} of its text is not JSON; is it a glTF file?", error.byte));
    } catch (const JsonTree::exception&) {
        refuse(file, "JSON has a number that is too large");
    }
}

void JsonAt::fail(const std::string& what, Remedy remedy) const {
    throw Error(ErrorKind::kBadInput,
                path_.empty() ? fmt::format("{}: {}", file_, what)
                              : fmt::format("{}: {}: {}", file_, path_, what),
                remedy);
}

void JsonAt::require_object() const {
    if (!value_.is_object()) fail("must be an object");
}

std::optional<JsonAt> JsonAt::find(const char* key) const {
    require_object();
    const auto member = value_.find(key);
    if (member == value_.end()) return std::nullopt;
    return JsonAt(*member, file_, path_.empty() ? key : fmt::format("{}.{}", path_, key));
}

JsonAt JsonAt::at(const char* key) const {
    std::optional<JsonAt> member = find(key);
    if (!member) fail(fmt::format("has no member {}", key));
    return *member;
}

std::size_t JsonAt::size() const {
    if (!value_.is_array()) fail("must be an array");
    return value_.size();
}

JsonAt JsonAt::operator[](std::size_t index) const {
    return {value_[index], file_, fmt::format("{}[{}]", path_, index)};
}

std::string_view JsonAt::text() const {
    if (!value_.is_string()) fail("must be a string");
    return value_.get_ref<const std::string&>();
}

bool JsonAt::boolean() const {
    if (!value_.is_boolean()) fail("must be true or false");
    return value_.get<bool>();
}

double JsonAt::number() const {
    if (!value_.is_number()) fail("must be a number");
    return value_.get<double>();
}

std::uint64_t JsonAt::count() const {
    const double value = number();
    if (!(value >= 0 && value <= static_cast<double>(kMaxCount)) || std::floor(value) != value)
        fail(fmt::format("is {}; must be a whole number from 0 on", value));
    return static_cast<std::uint64_t>(value);
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

}  // namespace mray::gltf
