// A value of a glTF file's JSON, with its place for messages.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "clips/json/content_budget.h"
#include "clips/json/json.h"
#include "common/base/errors.h"

namespace mray::gltf {

/// Parses the JSON text of a file, whose name in messages is `file`. Throws Error(kBadInput) with
/// the byte for a text that is not JSON, for brackets in more than 64 others, and for values that
/// take more than the budget: some hundred bytes each, data: URIs as much as any short text.
JsonTree parse_json(std::string_view text, const std::string& file, ContentBudget& budget);

/// Every member function throws Error(kBadInput), "file: place: what is wrong", for a value of
/// another type. Both arguments of the constructor must outlive it.
class JsonAt {
public:
    JsonAt(const JsonTree& value, const std::string& file, std::string path = {})
        : value_(value), file_(file), path_(std::move(path)) {}

    /// Such as "accessors[3].byteOffset"; empty for the whole file.
    const std::string& path() const { return path_; }
    const std::string& file() const { return file_; }
    [[noreturn]] void fail(const std::string& what, Remedy remedy = Remedy::kNone) const;

    /// A member of an object; nothing if it is not there.
    std::optional<JsonAt> find(const char* key) const;
    /// A member that has to be there.
    JsonAt at(const char* key) const;

    /// The number of elements of an array.
    std::size_t size() const;
    JsonAt operator[](std::size_t index) const;

    std::string_view text() const;
    bool boolean() const;
    double number() const;
    /// A whole number of at least 0 and at most 2^53.
    std::uint64_t count() const;
    /// A whole number below `limit`, which counts `what` ("nodes").
    std::uint32_t index_below(std::size_t limit, const char* what) const;
    /// Fills `out` from an array of as many numbers.
    void numbers(std::span<double> out) const;

    std::uint64_t count_or(const char* key, std::uint64_t otherwise) const;
    std::optional<std::uint32_t> index_or_none(const char* key, std::size_t limit,
                                               const char* what) const;

private:
    void require_object() const;

    const JsonTree& value_;
    const std::string& file_;
    std::string path_;
};

}  // namespace mray::gltf
