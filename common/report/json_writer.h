// Values that reports write as JSON.
#pragma once

#include <array>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

namespace mray {

/// A value of JSON: null, a truth value, a number, a text, an array or an object. An object keeps
/// its members in the order in which they were added.
///
/// A list in braces is an object if each of its elements is a pair in braces whose first is a text,
/// and else an array: {{"x", 1}, {"y", 2}} and {1, 2}.
class Json {
public:
    /// Name and value.
    using Member = std::pair<std::string, Json>;
    using Array = std::vector<Json>;
    /// A struct, since std::variant of libstdc++ 12 destroys values that were not made, if a copy
    /// throws and all alternatives are known to it.
    struct Object {
        std::vector<Member> members = {};
    };
    using Value = std::variant<std::nullptr_t, bool, std::int64_t, std::uint64_t, double,
                               std::string, Array, Object>;

    Json() = default;
    Json(std::nullptr_t) {}
    /// Integers are written as such. Doubles have a point or an exponent, and as few digits as give
    /// the double back; floats are written as doubles.
    template <class Number>
    requires std::integral<Number> || std::floating_point<Number> Json(Number number)
        : value_(kept(number)) {}
    Json(const char* text) : value_(std::string(text)) {}
    Json(std::string_view text) : value_(std::string(text)) {}
    Json(std::string text) : value_(std::move(text)) {}
    template <class T>
    Json(const std::vector<T>& values) : value_(Array(values.begin(), values.end())) {}
    template <class T, std::size_t N>
    Json(const std::array<T, N>& values) : value_(Array(values.begin(), values.end())) {}
    Json(std::initializer_list<Json> values);

    /// An array without elements.
    static Json array();

    /// The member of an object, which is added if it is not there; null becomes an object. Any
    /// other value is a broken invariant (asserted).
    Json& operator[](std::string_view name);
    /// Adds an element to an array; null becomes an array. Any other value is a broken invariant
    /// (asserted).
    void push_back(Json value);
    /// The last element of an array that has some.
    Json& back();
    /// Sets the members of `other`, an object, in this one.
    void update(const Json& other);

    const Value& value() const { return value_; }

private:
    /// A number as one of the types that are kept.
    template <class Number>
    static auto kept(Number number) {
        if constexpr (std::same_as<Number, bool>) {
            return number;
        } else if constexpr (std::floating_point<Number>) {
            return static_cast<double>(number);
        } else if constexpr (std::signed_integral<Number>) {
            return static_cast<std::int64_t>(number);
        } else {
            return static_cast<std::uint64_t>(number);
        }
    }

    Value value_;
};

/// The text with a final line end. Bytes that are not UTF-8 become U+FFFD, numbers that are not
/// finite become null. `indent` is per level; -1 gives a single line.
std::string json_text(const Json& json, int indent = 2);

}  // namespace mray
