// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace riftmap {

/// What a program takes on its command line besides what all of them take. Filled by
/// Program::arguments(); the bound variables outlive the parsing.
class CommandLine {
 public:
    enum class Count { kOne, kOptional, kMany };  ///< kMany: one or more

    /// A positional argument after the configuration files. An optional one, and one that
    /// takes many, comes last.
    void positional(const std::string& name, const std::string& text, Count count = Count::kOne);
    /// `--name`; `shortName` 0 for none.
    void flag(const std::string& name, char shortName, bool& value, const std::string& text);
    /// `--name VALUE`, at most once.
    void value(const std::string& name, char shortName, const std::string& placeholder,
               std::string& value, const std::string& text);
    void value(const std::string& name, char shortName, const std::string& placeholder,
               std::filesystem::path& value, const std::string& text);
    /// `--name VALUE`, any number of times.
    void values(const std::string& name, char shortName, const std::string& placeholder,
                std::vector<std::string>& value, const std::string& text);

    /// Reads the arguments and sets the bound variables. Leading positional ones that end in
    /// ".ini" are configuration files. Throws ConfigError: unknown flag (with the nearest known
    /// one), no value, a flag given twice.
    void parse(const std::vector<std::string>& arguments);
    /// Throws ConfigError that names the missing or superfluous positional argument.
    void checkPositionals() const;

    const std::vector<std::string>& configFiles() const { return configFiles_; }
    const std::vector<std::string>& given() const { return given_; }  ///< without INI files

    /// "LEFT RIGHT [OUT]"
    std::string positionalUsage() const;
    /// A line an argument and a flag.
    std::string help() const;

 private:
    struct Positional {
        std::string name, text;
        Count count;
    };
    struct Flag {
        std::string name;         ///< without the dashes
        char shortName;           ///< 0 = none
        std::string placeholder;  ///< of the value; empty = takes none
        std::string text;
        bool repeatable;
        std::function<void(const std::string&)> set;  ///< throws ConfigError
    };

    void add(Flag flag);
    const Flag& find(const std::string& argument) const;

    std::vector<Positional> positionals_;
    std::vector<Flag> flags_;
    std::vector<std::string> configFiles_, given_;
};

}  // namespace riftmap
