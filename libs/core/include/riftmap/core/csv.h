// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <concepts>
#include <cstddef>
#include <filesystem>
#include <fstream>
#include <initializer_list>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace riftmap {

/// A value as text, for CSV and YAML files: numbers independent of the locale; floating-point ones
/// with up to 9 significant digits.
class Field {
 public:
    Field(std::string text) : text_(std::move(text)), isText_(true) {}
    Field(std::string_view text) : Field(std::string(text)) {}
    Field(const char* text) : Field(std::string(text)) {}
    Field(bool value) : text_(value ? "true" : "false") {}
    template <std::integral T>
    Field(T value) : text_(std::to_string(value)) {}
    Field(float value) : text_(number(value)) {}
    Field(double value) : text_(number(value)) {}

    const std::string& text() const { return text_; }
    bool isText() const { return isText_; }  ///< not a number or a truth value

 private:
    static std::string number(float value);
    static std::string number(double value);

    std::string text_;
    bool isText_ = false;
};

/// Writes a CSV file with a header, row by row; every row is on its way to the disk when row()
/// returns, so that an interrupted run keeps them. Not thread-safe.
class CsvWriter {
 public:
    enum class Mode {
        kNew,     ///< replaces the file
        kAppend,  ///< goes on with a file of the same header, or starts it
    };

    /// Throws FileError: cannot be written; another header (kAppend).
    CsvWriter(const std::filesystem::path& file, const std::vector<std::string>& header,
              Mode mode = Mode::kNew);

    /// Throws FileError, or std::invalid_argument if there are not as many fields as the header
    /// has.
    void row(const std::vector<Field>& fields);

 private:
    void writeLine(const std::vector<std::string>& cells);

    std::filesystem::path file_;
    std::size_t columns_;
    std::ofstream out_;
};

/// A CSV file in memory.
struct CsvTable {
    std::vector<std::string> header;
    std::vector<std::vector<std::string>> rows;  ///< each as long as the header

    /// Index of a column; throws std::out_of_range that names the columns there are.
    std::size_t column(std::string_view name) const;
};

/// Reads a CSV file with a header; quoted fields may hold commas and quotes, but no line ends.
/// Throws FileError (file, line, what): no header, a row of another length, an open quote.
CsvTable readCsv(const std::filesystem::path& file);

}  // namespace riftmap
