// Rows of text in aligned columns, and the same rows as comma-separated values.
#pragma once

#include <string>
#include <vector>

namespace mray {

class Table {
public:
    explicit Table(std::vector<std::string> header) : header_(std::move(header)) {}

    /// Adds a row of as many cells as the header has (asserted).
    void add(std::vector<std::string> row);
    bool empty() const { return rows_.empty(); }

    /// Columns two spaces apart; columns of numbers are aligned right, others left.
    std::string text() const;
    /// RFC 4180, with \n.
    std::string csv() const;

private:
    std::vector<std::string> header_;
    std::vector<std::vector<std::string>> rows_;
};

}  // namespace mray
