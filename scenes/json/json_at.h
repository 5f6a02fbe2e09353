// Reading JSON: the values of a text, each with its place for messages.
#pragma once

#include <cstddef>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>

#include "common/base/errors.h"

namespace mray {

/// Finds members of an object in logarithmic time, for input that may have any number of them.
using JsonTree = nlohmann::json;

/// Parses the JSON text of a file, whose name in messages is `file`. Throws Error(kBadInput) with
/// the byte for a text that is not JSON, and for a number beyond the largest double.
JsonTree parse_json(std::string_view text, const std::string& file);

/// A value and its place, for errors (kBadInput) of values of another type. Tree and name must
/// outlive it.
class JsonAt {
public:
    JsonAt(const JsonTree& value, const std::string& file, std::string path = {})
        : value_(value), file_(file), path_(std::move(path)) {}

    /// Such as "accessors[3].byteOffset"; empty for the whole file.
    const std::string& path() const { return path_; }
    const std::string& file() const { return file_; }
    template <class... Values>
    [[noreturn]] void fail(fmt::format_string<Values...> what, Values&&... values) const {
        throw Error(ErrorKind::kBadInput, "{}{}{}: {}", file_, path_.empty() ? "" : ": ", path_,
                    fmt::format(what, std::forward<Values>(values)...));
    }

    bool is_text() const { return value_.is_string(); }

    /// A member of an object; nothing if it is not there.
    std::optional<JsonAt> find(const std::string& key) const;
    /// A member that has to be there.
    JsonAt at(const std::string& key) const;

    std::size_t size() const;
    /// An element that has to be there.
    JsonAt operator[](std::size_t index) const;

    std::string_view text() const;
    bool boolean() const;
    double number() const;
    /// A whole number of at least 0 and at most 2^53, however it is written.
    std::uint64_t count() const;
    /// A whole number below `limit`, which counts `what` ("nodes").
    std::uint32_t index_below(std::size_t limit, const char* what) const;
    /// Fills `out` from an array of as many numbers.
    void numbers(std::span<double> out) const;
    /// Leaves `out` as it is if there is no such member.
    void numbers_of(const char* key, std::span<double> out) const;

    std::uint64_t count_or(const char* key, std::uint64_t otherwise) const;
    std::optional<std::uint32_t> index_or_none(const char* key, std::size_t limit,
                                               const char* what) const;

private:
    const JsonTree& value_;
    const std::string& file_;
    std::string path_;
};

}  // namespace mray
