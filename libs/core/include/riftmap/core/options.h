// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <functional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace riftmap {

/// Wrong usage or configuration: one line that names file, section, key, value and what is
/// allowed. Programs end with exit code 2.
class ConfigError : public std::runtime_error {
 public:
    using std::runtime_error::runtime_error;
};

/// One option, bound to a variable that outlives the table.
struct Option {
    std::string section, key;
    std::string unit;                               ///< "m", "px", "deg", ...; empty for none
    std::string allowed;                            ///< range or choices, for people
    std::string text;                               ///< one sentence
    std::string initial;                            ///< the default, as text
    std::function<void(const std::string&)> parse;  ///< throws ConfigError: what is allowed
    std::function<std::string()> format;            ///< the value as text that parses to itself
};

/// Options declared once: loaded from INI, checked, dumped, listed by --help and in
/// config/README.md. Every options struct has `void describe(OptionTable&)`, which names its
/// section and binds its members; their values at that time are the defaults. Not thread-safe.
class OptionTable {
 public:
    /// Starts a section; the options added next belong to it.
    void section(const std::string& name, const std::string& text);

    void add(const std::string& key, double& value, double min, double max, const std::string& unit,
             const std::string& text);
    void add(const std::string& key, int& value, int min, int max, const std::string& unit,
             const std::string& text);
    void add(const std::string& key, std::uint64_t& value, const std::string& text);
    void add(const std::string& key, bool& value, const std::string& text);
    void add(const std::string& key, std::string& value, const std::string& text);
    /// A list of numbers "1 2 3". `count`: how many there must be, 0 = any number.
    void add(const std::string& key, std::vector<double>& value, std::size_t count,
             const std::string& unit, const std::string& text);
    /// Degrees in the file (the key ends in `_deg`), radians in the variable; range in degrees.
    void addDegrees(const std::string& key, double& radians, double min_deg, double max_deg,
                    const std::string& text);
    /// One of a few names.
    template <class E>
    void addChoice(const std::string& key, E& value,
                   const std::vector<std::pair<std::string, E>>& choices, const std::string& text) {
        std::vector<std::string> names;
        names.reserve(choices.size());
        for (const auto& c : choices) {
            names.push_back(c.first);
        }
        addNamed(
            key, names, text, [&value, choices](std::size_t i) { value = choices[i].second; },
            [&value, choices] {
                std::size_t i = 0;
                while (i + 1 < choices.size() && choices[i].second != value) {
                    ++i;
                }
                return i;
            });
    }

    /// Reads an INI file. A section that this table lacks may belong to one of `others`, which
    /// checks it: one file configures several programs. Throws ConfigError: missing file, unknown
    /// section or key (with the nearest known one), a value that does not parse or is out of
    /// range; with file and line.
    void load(const std::string& file, const std::vector<OptionTable*>& others = {});
    /// "Section.key=value", as --set gives it; `where` opens the message. Throws ConfigError.
    void set(const std::string& assignment, const std::string& where = "--set");

    /// The whole configuration as INI text with comments; loads again to the same values.
    std::string dump() const;
    /// For --help: a line an option.
    std::string help() const;
    /// For config/README.md: a table a section.
    std::string markdown() const;

    const std::vector<Option>& options() const { return options_; }
    bool hasSection(const std::string& name) const;  ///< in upper or lower case

 private:
    void addNamed(const std::string& key, const std::vector<std::string>& names,
                  const std::string& text, const std::function<void(std::size_t)>& setIndex,
                  const std::function<std::size_t()>& index);
    void addOption(Option option);
    void assign(const std::string& section, const std::string& key, const std::string& value,
                const std::string& where);

    std::vector<std::pair<std::string, std::string>> sections_;  ///< name, text
    std::vector<Option> options_;
};

}  // namespace riftmap
