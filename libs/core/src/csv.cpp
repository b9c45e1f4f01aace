// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/core/csv.h"

#include <algorithm>
#include <charconv>
#include <optional>
#include <sstream>
#include <stdexcept>

#include "riftmap/core/file.h"
#include "riftmap/core/text.h"

namespace riftmap {
namespace {

std::string quotedIfNeeded(const std::string& cell) {
    if (cell.find_first_of(",\"\r\n") == std::string::npos) {
        return cell;
    }
    std::string out = "\"";
    for (const char c : cell) {
        // Rows stay lines: a line end inside a field becomes a blank.
        out += c == '"' ? "\"\"" : std::string(1, c == '\n' || c == '\r' ? ' ' : c);
    }
    return out + "\"";
}

std::string joined(const std::vector<std::string>& cells) {
    std::string line;
    for (std::size_t i = 0; i < cells.size(); ++i) {
        line += (i == 0 ? "" : ",") + quotedIfNeeded(cells[i]);
    }
    return line;
}

/// Nothing where a quote stays open.
std::optional<std::vector<std::string>> split(const std::string& line) {
    std::vector<std::string> cells(1);
    bool quoted = false;
    for (std::size_t i = 0; i < line.size(); ++i) {
        const char c = line[i];
        if (c == '"' && quoted && i + 1 < line.size() && line[i + 1] == '"') {
            cells.back() += '"';
            ++i;
        } else if (c == '"') {
            quoted = !quoted;
        } else if (c == ',' && !quoted) {
            cells.emplace_back();
        } else {
            cells.back() += c;
        }
    }
    return quoted ? std::nullopt : std::optional(std::move(cells));
}

}  // namespace

std::string Field::number(float value) {
    return toText(value);
}

std::string Field::number(double value) {
    char buffer[64];
    const auto end =
        std::to_chars(buffer, buffer + sizeof(buffer), value, std::chars_format::general, 9).ptr;
    return {buffer, end};
}

CsvWriter::CsvWriter(const std::filesystem::path& file, const std::vector<std::string>& header,
                     Mode mode)
    : file_(file), columns_(header.size()) {
    const bool goesOn = mode == Mode::kAppend && std::filesystem::exists(file);
    if (goesOn && readCsv(file).header != header) {
        throw FileError(file.string() + ":1: another header than " + joined(header));
    }
    out_.open(file, goesOn ? std::ios::app : std::ios::trunc);
    if (!goesOn) {
        writeLine(header);
    }
}

void CsvWriter::row(const std::vector<Field>& fields) {
    if (fields.size() != columns_) {
        throw std::invalid_argument(file_.string() + ": a row of " + std::to_string(fields.size()) +
                                    " fields under a header of " + std::to_string(columns_));
    }
    std::vector<std::string> cells;
    cells.reserve(fields.size());
    for (const auto& field : fields) {
        cells.push_back(field.text());
    }
    writeLine(cells);
}

void CsvWriter::writeLine(const std::vector<std::string>& cells) {
    out_ << joined(cells) << '\n' << std::flush;
    if (!out_) {
        throw FileError(file_.string() + ": cannot be written");
    }
}

std::size_t CsvTable::column(std::string_view name) const {
    const auto found = std::find(header.begin(), header.end(), name);
    if (found == header.end()) {
        throw std::out_of_range("no column '" + std::string(name) + "' in " + joined(header));
    }
    return static_cast<std::size_t>(found - header.begin());
}

CsvTable readCsv(const std::filesystem::path& file) {
    std::istringstream in(readFile(file));
    CsvTable table;
    std::string line;
    for (int number = 1; std::getline(in, line); ++number) {
        const auto fail = [&](const std::string& what) {
            throw FileError(file.string() + ":" + std::to_string(number) + ": " + what);
        };
        if (line.ends_with('\r')) {
            line.pop_back();
        }
        auto cells = split(line);
        if (!cells) {
            fail("a quote stays open");
        } else if (number == 1) {
            table.header = std::move(*cells);
        } else if (cells->size() != table.header.size()) {
            fail(std::to_string(cells->size()) + " fields under a header of " +
                 std::to_string(table.header.size()));
        } else {
            table.rows.push_back(std::move(*cells));
        }
    }
    if (table.header.empty()) {
        throw FileError(file.string() + ": has no header");
    }
    return table;
}

}  // namespace riftmap
