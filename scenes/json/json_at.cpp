#include "scenes/json/json_at.h"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

namespace mray {
namespace {

/// Finds members of an object in logarithmic time, for input that may have any number of them.
using Tree = nlohmann::json;

constexpr int kMaxDepth = 64;
// Bytes that Tree takes on a heap whose blocks are multiples of 16 bytes, with a header of 8:
// for a value in an array that doubles when it grows, for a member of an object, and for what they
// point to.
constexpr std::uint64_t kValueBytes = 32;
constexpr std::uint64_t kMemberBytes = 96;
constexpr std::uint64_t kArrayBytes = 32;
constexpr std::uint64_t kObjectBytes = 64;
constexpr std::uint64_t kStringBytes = 48;
// Texts up to this length lie in the string itself.
constexpr std::size_t kShortText = 15;
constexpr std::uint64_t kBlockBytes = 32;
// Doubles hold all whole numbers up to this one.
constexpr std::uint64_t kMaxCount = std::uint64_t{1} << 53;

[[noreturn]] void refuse(const std::string& file, const std::string& what) {
    throw Error(ErrorKind::kBadInput, fmt::format("{}: {}", file, what));
}

/// Goes through a text without keeping it, and refuses what parse_json() refuses.
class LimitCheck : public Tree::json_sax_t {
public:
    LimitCheck(const std::string& file, ContentBudget& budget) : file_(file), budget_(budget) {}

    bool null() override { return take(kValueBytes); }
    bool boolean(bool) override { return take(kValueBytes); }
    bool number_integer(Tree::number_integer_t) override { return take(kValueBytes); }
    bool number_unsigned(Tree::number_unsigned_t) override { return take(kValueBytes); }
    bool number_float(Tree::number_float_t, const std::string&) override {
        return take(kValueBytes);
    }
    // The bytes of a data: URI are those of a buffer or an image, of which the file has as many.
    bool string(std::string& text) override {
        return take(kValueBytes + kStringBytes +
                    (text.starts_with("data:") ? kBlockBytes : heap_bytes(text)));
    }
    bool binary(Tree::binary_t&) override { return take(kValueBytes); }
    // The value is in the member.
    bool key(std::string& text) override {
        return take(kMemberBytes - kValueBytes + heap_bytes(text));
    }
    bool start_object(std::size_t) override { return enter(kObjectBytes); }
    bool start_array(std::size_t) override { return enter(kArrayBytes); }
    bool end_object() override { return leave(); }
    bool end_array() override { return leave(); }
    bool parse_error(std::size_t byte, const std::string&, const Tree::exception& error) override {
        constexpr int kNumberOverflow = 406;
        if (error.id == kNumberOverflow) refuse(file_, "JSON has a number that is too large");
        refuse(file_, fmt::format("byte {} of its text is not JSON; is it a glTF file?", byte));
    }

private:
    static std::uint64_t heap_bytes(const std::string& text) {
        return text.size() <= kShortText ? 0 : text.size() + kBlockBytes;
    }
    bool take(std::uint64_t bytes) {
        if (budget_.take(bytes)) return true;
        refuse(file_, fmt::format("JSON has values that take more than {} MiB; split the scene",
                                  ContentBudget::kLeastBytes >> 20));
    }
    bool enter(std::uint64_t bytes) {
        if (++depth_ > kMaxDepth)
            refuse(file_, fmt::format("JSON has brackets in more than {} others", kMaxDepth));
        return take(kValueBytes + bytes);
    }
    bool leave() {
        --depth_;
        return true;
    }

    const std::string& file_;
    ContentBudget& budget_;
    int depth_ = 0;
};

const Tree& tree_of(const JsonNode& node) { return reinterpret_cast<const Tree&>(node); }
const JsonNode& node_of(const Tree& tree) { return reinterpret_cast<const JsonNode&>(tree); }

JsonTree keep(Tree&& tree) {
    const auto kept = std::make_shared<const Tree>(std::move(tree));
    return JsonTree({kept, &node_of(*kept)});
}

/// A filter of the parser that lets everything pass.
Tree::parser_callback_t filter_of(void (*check)(const JsonProgress&)) {
    if (check == nullptr) return nullptr;
    return [check, values = std::size_t{0}](int depth, Tree::parse_event_t event,
                                            const Tree& value) mutable {
        const bool is_end =
            event == Tree::parse_event_t::object_end || event == Tree::parse_event_t::array_end;
        if (!is_end) ++values;
        check({depth, values, value.is_string() ? value.get_ref<const std::string&>().size() : 0});
        return true;
    };
}

}  // namespace

JsonTree parse_json(std::string_view text, void (*check)(const JsonProgress&)) {
    try {
        return keep(Tree::parse(text.begin(), text.end(), filter_of(check)));
    } catch (const Tree::parse_error& error) {
        throw JsonSyntaxError(error.byte);
    } catch (const Tree::exception&) {
        throw JsonValueError(ErrorKind::kBadInput, "JSON has a number that is too large");
    }
}

// The parser's own callback takes quadratic time in arrays of objects, so the limits are checked in
// a pass of their own.
JsonTree parse_json(std::string_view text, const std::string& file, ContentBudget& budget) {
    LimitCheck check(file, budget);
    Tree::sax_parse(text.begin(), text.end(), &check);
    return keep(Tree::parse(text.begin(), text.end()));
}

void JsonAt::fail(const std::string& what, Remedy remedy) const {
    throw JsonValueError(ErrorKind::kBadInput,
                         path_.empty() ? fmt::format("{}: {}", file_, what)
                                       : fmt::format("{}: {}: {}", file_, path_, what),
                         remedy);
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
