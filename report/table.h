// Rows of text in aligned columns and as comma-separated values; text of markup.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

namespace mray {

/// A column of text. A cell that is wider moves those after it.
struct Column {
    std::string name;
    /// The least width in characters.
    std::size_t width = 0;
    bool is_right_aligned = true;
};

/// A line with the names of the columns, two spaces apart.
std::string header_text(std::span<const Column> columns);
std::string row_text(std::span<const Column> columns, std::span<const std::string> cells);

/// Rows that are all known before they are written.
class Table {
public:
    explicit Table(std::vector<std::string> header) : header_(std::move(header)) {}

    void add(std::vector<std::string> row);

    /// Columns two spaces apart; columns of numbers are aligned right, others left.
    std::string text() const;
    /// RFC 4180, with \n.
    std::string csv() const;

private:
    std::vector<std::string> header_;
    std::vector<std::vector<std::string>> rows_;
};

/// The text with markup as entities, and '?' for all but printable ASCII and ends of lines: a
/// reader rejects the whole report for one bad byte.
std::string markup_text(const std::string& text);

}  // namespace mray
