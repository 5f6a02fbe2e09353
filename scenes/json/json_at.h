// Reading JSON: the values of a text, each with its place for messages.
#pragma once

#include <cstddef>
#include <cstdint>
#include <exception>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>

#include "common/base/errors.h"

namespace mray {

/// Stands for a value of the JSON library, whose type json_at.cpp alone knows; never defined.
struct JsonNode;

/// The values of a text. Copies share them, and threads may read them at the same time.
class JsonTree {
public:
    /// A tree without a value, to be replaced by one that parse_json() returns.
    JsonTree() = default;
    explicit JsonTree(std::shared_ptr<const JsonNode> root) : root_(std::move(root)) {}
    const JsonNode& root() const { return *root_; }

private:
    std::shared_ptr<const JsonNode> root_;
};

/// A text that is not JSON.
class JsonSyntaxError : public std::exception {
public:
    explicit JsonSyntaxError(std::size_t byte) : byte_(byte) {}
    const char* what() const noexcept override { return "is not JSON"; }
    /// The number of bytes up to the first wrong one, which counts.
    std::size_t byte() const { return byte_; }

private:
    std::size_t byte_;
};

/// A value of another type or size than a reader asks for.
class JsonValueError : public Error {
public:
    using Error::Error;
};

/// Parses a text. Throws JsonSyntaxError, and JsonValueError for a number beyond the largest
/// double.
JsonTree parse_json(std::string_view text);

/// Parses the JSON text of a file, whose name in messages is `file`. Throws Error(kBadInput) with
/// the byte for a text that is not JSON.
JsonTree parse_json(std::string_view text, const std::string& file);

/// A value and its place. Member functions but those that ask for the type throw JsonValueError,
/// kBadInput and "file: place: what is wrong", for a value of another type. Tree and file name must
/// outlive it.
class JsonAt {
public:
    JsonAt(const JsonTree& tree, const std::string& file) : JsonAt(tree.root(), file, {}) {}

    /// Such as "accessors[3].byteOffset"; empty for the whole file.
    const std::string& path() const { return path_; }
    const std::string& file() const { return file_; }
    [[noreturn]] void fail(const std::string& what, Hint hint = Hint::kNone) const;

    bool is_null() const;
    bool is_boolean() const;
    bool is_number() const;
    bool is_text() const;
    bool is_array() const;
    bool is_object() const;

    /// A member of an object; nothing if it is not there.
    std::optional<JsonAt> find(const char* key) const;
    /// A member that has to be there.
    JsonAt at(const char* key) const;

    /// The number of elements of an array.
    std::size_t size() const;
    /// An element that has to be there.
    JsonAt operator[](std::size_t index) const;

    std::string_view text() const;
    bool boolean() const;
    double number() const;
    /// A whole number of at least 0 and at most 2^53, however it is written.
    std::uint64_t count() const;
    /// A number from 0 to 2^64 - 1 that is written without sign, point and exponent; nothing for
    /// any other value.
    std::optional<std::uint64_t> unsigned_integer() const;
    /// A whole number below `limit`, which counts `what` ("nodes").
    std::uint32_t index_below(std::size_t limit, const char* what) const;
    /// Fills `out` from an array of as many numbers.
    void numbers(std::span<double> out) const;

    std::uint64_t count_or(const char* key, std::uint64_t otherwise) const;
    std::optional<std::uint32_t> index_or_none(const char* key, std::size_t limit,
                                               const char* what) const;

private:
    JsonAt(const JsonNode& node, const std::string& file, std::string path)
        : node_(node), file_(file), path_(std::move(path)) {}

    const JsonNode& node_;
    const std::string& file_;
    std::string path_;
};

}  // namespace mray
