#include "scenes/json/json_at.h"

#include <fmt/format.h>

#include <cmath>

namespace mray {

JsonTree parse_json(std::string_view text, const std::string& file) {
    std::string what = "JSON has a number that is too large";
    try {
        return JsonTree::parse(text.begin(), text.end());
    } catch (const JsonTree::parse_error& error) {
        what = fmt::format("byte {} of its text is not JSON; is it complete?", error.byte);
    } catch (const JsonTree::exception&) {
    }
    throw Error(ErrorKind::kBadInput, "{}: {}", file, what);
}

std::optional<JsonAt> JsonAt::find(const std::string& key) const {
    if (!value_.is_object()) fail("must be an object");
    const auto member = value_.find(key);
    if (member == value_.end()) return std::nullopt;
    return JsonAt(*member, file_, path_.empty() ? key : fmt::format("{}.{}", path_, key));
}

JsonAt JsonAt::at(const std::string& key) const {
    std::optional<JsonAt> member = find(key);
    if (!member) fail("has no member {}", key);
    return *member;
}

std::size_t JsonAt::size() const {
    if (!value_.is_array()) fail("must be an array");
    return value_.size();
}

JsonAt JsonAt::operator[](std::size_t index) const {
    if (index >= size()) fail("has {} elements, and none at {}", size(), index);
    return {value_[index], file_, fmt::format("{}[{}]", path_, index)};
}

std::string_view JsonAt::text() const {
    if (!is_text()) fail("must be a string");
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
    // Doubles hold all whole numbers up to this one.
    constexpr double kMaxCount = 0x1p53;
    const double value = number();
    if (!(value >= 0 && value <= kMaxCount) || std::floor(value) != value)
        fail("is {}; must be a whole number from 0 on", value);
    return static_cast<std::uint64_t>(value);
}

std::uint32_t JsonAt::index_below(std::size_t limit, const char* what) const {
    const std::uint64_t index = count();
    if (index >= limit) fail("is {}, but there are {} {}", index, limit, what);
    return static_cast<std::uint32_t>(index);
}

void JsonAt::numbers(std::span<double> out) const {
    if (size() != out.size()) fail("has {} numbers instead of {}", size(), out.size());
    for (std::size_t i = 0; i < out.size(); ++i) out[i] = (*this)[i].number();
}

void JsonAt::numbers_of(const char* key, std::span<double> out) const {
    if (const std::optional<JsonAt> member = find(key)) member->numbers(out);
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
