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

/// Goes through a text without keeping it, and refuses what parse_json() refuses.
class LimitCheck : public JsonTree::json_sax_t {
public:
    explicit LimitCheck(const std::string& file) : file_(file) {}

    bool null() override { return count(); }
    bool boolean(bool) override { return count(); }
    bool number_integer(JsonTree::number_integer_t) override { return count(); }
    bool number_unsigned(JsonTree::number_unsigned_t) override { return count(); }
    bool number_float(JsonTree::number_float_t, const std::string&) override { return count(); }
    bool string(std::string&) override { return count(); }
    bool binary(JsonTree::binary_t&) override { return count(); }
    bool key(std::string&) override { return true; }
    bool start_object(std::size_t) override { return enter(); }
    bool start_array(std::size_t) override { return enter(); }
    bool end_object() override { return leave(); }
    bool end_array() override { return leave(); }
    bool parse_error(std::size_t byte, const std::string&,
                     const JsonTree::exception& error) override {
        constexpr int kNumberOverflow = 406;
        if (error.id == kNumberOverflow) refuse(file_, "JSON has a number that is too large");
        refuse(file_, fmt::format("byte {} of its text is not JSON; is it a glTF file?", byte));
    }

private:
    bool count() {
        if (++values_ <= kMaxValues) return true;
        refuse(file_, fmt::format("JSON has more than {} values; split the scene", kMaxValues));
    }
    bool enter() {
        if (++depth_ > kMaxDepth)
            refuse(file_, fmt::format("JSON has brackets in more than {} others", kMaxDepth));
        return count();
    }
    bool leave() {
        --depth_;
        return true;
    }

    const std::string& file_;
    std::uint64_t values_ = 0;
    int depth_ = 0;
};

}  // namespace

// The parser's own callback takes quadratic time in arrays of objects, so the limits are checked in
// a pass of their own.
JsonTree parse_json(std::string_view text, const std::string& file) {
    LimitCheck check(file);
    JsonTree::sax_parse(text.begin(), text.end(), &check);
    return JsonTree::parse(text.begin(), text.end());
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
