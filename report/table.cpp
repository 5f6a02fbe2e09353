#include "report/table.h"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <map>

namespace mray {
namespace {

// The number of UTF-8 characters, which is about the width on a terminal.
std::size_t width_of(const std::string& cell) {
    return static_cast<std::size_t>(std::count_if(cell.begin(), cell.end(), [](char c) {
        return (static_cast<unsigned char>(c) & 0xC0) != 0x80;
    }));
}

std::string quoted_cell(const std::string& cell) {
    if (cell.find_first_of(",\"\n\r") == std::string::npos) return cell;
    std::string quoted(1, '"');
    for (const char c : cell) quoted.append(c == '"' ? 2 : 1, c);
    quoted.push_back('"');
    return quoted;
}

}  // namespace

std::string header_text(std::span<const Column> columns) {
    std::vector<std::string> names;
    for (const Column& column : columns) names.push_back(column.name);
    return row_text(columns, names);
}

std::string row_text(std::span<const Column> columns, std::span<const std::string> cells) {
    assert(cells.size() == columns.size());
    std::string line;
    for (std::size_t i = 0; i < columns.size(); ++i) {
        const std::size_t width = std::max(columns[i].width, width_of(columns[i].name));
        const std::size_t padding = width - std::min(width, width_of(cells[i]));
        if (i > 0) line.append(2, ' ');
        if (columns[i].is_right_aligned) line.append(padding, ' ');
        line.append(cells[i]);
        if (!columns[i].is_right_aligned) line.append(padding, ' ');
    }
    line.erase(line.find_last_not_of(' ') + 1);
    return line + '\n';
}

void Table::add(std::vector<std::string> row) {
    assert(row.size() == header_.size());
    rows_.push_back(std::move(row));
}

std::string Table::text() const {
    std::vector<Column> columns;
    for (std::size_t i = 0; i < header_.size(); ++i) {
        Column& column = columns.emplace_back(Column{header_[i]});
        for (const auto& row : rows_) {
            column.width = std::max(column.width, width_of(row[i]));
            // Numbers, "-" and nothing.
            if (row[i].find_first_not_of("0123456789.-+e") != std::string::npos)
                column.is_right_aligned = false;
        }
    }
    std::string text = header_text(columns);
    for (const auto& row : rows_) text += row_text(columns, row);
    return text;
}

std::string Table::csv() const {
    std::string text;
    const auto append = [&](std::vector<std::string> row) {
        std::ranges::transform(row, row.begin(), quoted_cell);
        text += fmt::format("{}\n", fmt::join(row, ","));
    };
    append(header_);
    std::ranges::for_each(rows_, append);
    return text;
}

std::string markup_text(const std::string& text) {
    static const std::map<char, const char*> entities = {
        {'&', "&amp;"}, {'<', "&lt;"}, {'>', "&gt;"}, {'"', "&quot;"}};
    std::string result;
    for (const char c : text) {
        if (const auto entity = entities.find(c); entity != entities.end())
            result += entity->second;
        else
            result += (c < 0x20 && c != '\n') || c >= 0x7F ? '?' : c;
    }
    return result;
}

}  // namespace mray
