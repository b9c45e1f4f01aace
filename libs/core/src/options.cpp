// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/core/options.h"

#include <mrpt/config/CConfigFile.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <sstream>

#include "riftmap/core/text.h"

namespace riftmap {
namespace {

template <class T>
std::string text(T value) {
    if constexpr (std::is_floating_point_v<T>) {
        return toText(value);
    } else {
        return std::to_string(value);
    }
}

template <class T>
T parseNumber(const std::string& raw) {
    const std::string s = trimmed(raw);
    T value{};
    const auto [end, error] = std::from_chars(s.data(), s.data() + s.size(), value);
    if (error != std::errc() || end != s.data() + s.size() || s.empty()) {
        throw ConfigError("not a number");
    }
    if constexpr (std::is_floating_point_v<T>) {
        if (!std::isfinite(value)) {
            throw ConfigError("not a finite number");
        }
    }
    return value;
}

template <class T>
T parseInRange(const std::string& raw, T min, T max) {
    const T value = parseNumber<T>(raw);
    if (value < min || value > max) {
        throw ConfigError("out of range");
    }
    return value;
}

template <class T>
std::string rangeText(T min, T max) {
    return text(min) + " .. " + text(max);
}

/// Line number of a key in an INI file, for messages; 0 if it cannot be found.
int lineOf(const std::string& file, const std::string& section, const std::string& key) {
    std::ifstream in(file);
    std::string line, current;
    for (int number = 1; std::getline(in, line); ++number) {
        const std::string s = trimmed(line);
        if (!s.empty() && s.front() == '[') {
            current = lower(trimmed(s.substr(1, s.find(']') - 1)));
            if (key.empty() && current == lower(section)) {
                return number;
            }
        } else if (current == lower(section) && !key.empty()) {
            if (lower(trimmed(s.substr(0, s.find('=')))) == lower(key)) {
                return number;
            }
        }
    }
    return 0;
}

}  // namespace

void OptionTable::section(const std::string& name, const std::string& sectionText) {
    sections_.emplace_back(name, sectionText);
}

void OptionTable::addOption(Option option) {
    option.section = sections_.back().first;
    option.initial = option.format();
    options_.push_back(std::move(option));
}

void OptionTable::add(const std::string& key, double& value, double min, double max,
                      const std::string& unit, const std::string& optionText) {
    addOption({.section = {},
               .key = key,
               .unit = unit,
               .allowed = rangeText(min, max),
               .text = optionText,
               .initial = {},
               .parse = [&value, min,
                         max](const std::string& s) { value = parseInRange<double>(s, min, max); },
               .format = [&value] { return text(value); }});
}

void OptionTable::add(const std::string& key, int& value, int min, int max, const std::string& unit,
                      const std::string& optionText) {
    addOption({.section = {},
               .key = key,
               .unit = unit,
               .allowed = rangeText(min, max),
               .text = optionText,
               .initial = {},
               .parse = [&value, min,
                         max](const std::string& s) { value = parseInRange<int>(s, min, max); },
               .format = [&value] { return text(value); }});
}

void OptionTable::add(const std::string& key, std::uint64_t& value, const std::string& optionText) {
    addOption({.section = {},
               .key = key,
               .unit = {},
               .allowed = "whole number >= 0",
               .text = optionText,
               .initial = {},
               .parse = [&value](const std::string& s) { value = parseNumber<std::uint64_t>(s); },
               .format = [&value] { return text(value); }});
}

void OptionTable::add(const std::string& key, bool& value, const std::string& optionText) {
    addNamed(
        key, {"false", "true"}, optionText, [&value](std::size_t i) { value = i == 1; },
        [&value] { return value ? std::size_t{1} : std::size_t{0}; });
}

void OptionTable::add(const std::string& key, std::string& value, const std::string& optionText) {
    addOption({.section = {},
               .key = key,
               .unit = {},
               .allowed = "text",
               .text = optionText,
               .initial = {},
               .parse = [&value](const std::string& s) { value = trimmed(s); },
               .format = [&value] { return value; }});
}

void OptionTable::add(const std::string& key, std::vector<double>& value, std::size_t count,
                      const std::string& unit, const std::string& optionText) {
    const auto parse = [&value, count](const std::string& s) {
        std::vector<double> numbers;
        std::istringstream in(s);
        for (std::string word; in >> word;) {
            numbers.push_back(parseNumber<double>(word));
        }
        if (count != 0 && numbers.size() != count) {
            throw ConfigError("has " + std::to_string(numbers.size()) + " numbers");
        }
        value = std::move(numbers);
    };
    const auto format = [&value] {
        std::string s;
        for (const double v : value) {
            s += (s.empty() ? "" : " ") + text(v);
        }
        return s;
    };
    addOption({.section = {},
               .key = key,
               .unit = unit,
               .allowed = count == 0 ? "numbers" : std::to_string(count) + " numbers",
               .text = optionText,
               .initial = {},
               .parse = parse,
               .format = format});
}

void OptionTable::addDegrees(const std::string& key, double& radians, double min_deg,
                             double max_deg, const std::string& optionText) {
    constexpr double kDegree = std::numbers::pi / 180;
    addOption({.section = {},
               .key = key,
               .unit = "deg",
               .allowed = rangeText(min_deg, max_deg),
               .text = optionText,
               .initial = {},
               .parse =
                   [&radians, min_deg, max_deg](const std::string& s) {
                       radians = parseInRange<double>(s, min_deg, max_deg) * kDegree;
                   },
               // Rounded so that 30 degrees do not come back as 30.000000000000004.
               .format = [&radians] { return text(std::round(radians / kDegree * 1e9) / 1e9); }});
}

void OptionTable::addNamed(const std::string& key, const std::vector<std::string>& names,
                           const std::string& optionText,
                           const std::function<void(std::size_t)>& setIndex,
                           const std::function<std::size_t()>& index) {
    std::string allowed;
    for (const auto& name : names) {
        allowed += (allowed.empty() ? "" : " | ") + name;
    }
    const auto parse = [names, setIndex](const std::string& s) {
        const auto it = std::find_if(
            names.begin(), names.end(),
            [given = lower(trimmed(s))](const std::string& name) { return lower(name) == given; });
        if (it == names.end()) {
            throw ConfigError("unknown choice");
        }
        setIndex(static_cast<std::size_t>(it - names.begin()));
    };
    addOption({.section = {},
               .key = key,
               .unit = {},
               .allowed = allowed,
               .text = optionText,
               .initial = {},
               .parse = parse,
               .format = [names, index] { return names[index()]; }});
}

void OptionTable::assign(const std::string& section, const std::string& key,
                         const std::string& value, const std::string& where) {
    std::vector<std::string> sections, keys;
    for (const auto& option : options_) {
        sections.push_back(option.section);
        if (lower(option.section) != lower(section)) {
            continue;
        }
        keys.push_back(option.key);
        if (lower(option.key) != lower(key)) {
            continue;
        }
        try {
            option.parse(value);
        } catch (const ConfigError& e) {
            throw ConfigError(where + "[" + option.section + "] " + option.key + " = '" + value +
                              "': " + e.what() + "; allowed: " + option.allowed +
                              (option.unit.empty() ? "" : " [" + option.unit + "]"));
        }
        return;
    }
    if (keys.empty()) {
        throw ConfigError(where + "unknown section [" + section + "]; did you mean [" +
                          nearestName(section, sections) + "]?");
    }
    throw ConfigError(where + "unknown key '" + key + "' in [" + section + "]; did you mean '" +
                      nearestName(key, keys) + "'?");
}

bool OptionTable::hasSection(const std::string& name) const {
    return std::any_of(sections_.begin(), sections_.end(),
                       [&](const auto& s) { return lower(s.first) == lower(name); });
}

void OptionTable::load(const std::string& file, const std::vector<OptionTable*>& others) {
    if (!std::filesystem::is_regular_file(file)) {
        throw ConfigError(file + ": no such configuration file");
    }
    if (!std::ifstream(file)) {
        throw ConfigError(file + ": cannot be read");
    }
    std::vector<std::string> sections;
    mrpt::config::CConfigFile ini;
    try {
        ini.setFileName(file);
        ini.discardSavingChanges();
        ini.getAllSections(sections);
    } catch (const std::exception& e) {
        const std::string what = e.what();
        throw ConfigError(file + ": not an INI file: " + what.substr(0, what.find('\n')));
    }
    for (const auto& section : sections) {
        std::vector<std::string> keys;
        ini.getAllKeys(section, keys);
        const auto where = [&](const std::string& key) {
            const int line = lineOf(file, section, key);
            return file + (line > 0 ? ":" + std::to_string(line) : "") + ": ";
        };
        OptionTable* owner = this;
        if (!hasSection(section)) {
            const auto other = std::find_if(others.begin(), others.end(), [&](OptionTable* table) {
                return table->hasSection(section);
            });
            owner = other == others.end() ? this : *other;
        }
        if (keys.empty() && !section.empty() && !owner->hasSection(section)) {
            owner->assign(section, "", "", where(""));  // still worth the check of its name
        }
        for (const auto& key : keys) {
            if (key.starts_with("//")) {  // MRPT's parser takes a comment with a '=' for a key
                continue;
            }
            owner->assign(section, key, ini.read_string(section, key, "", true), where(key));
        }
    }
}

void OptionTable::set(const std::string& assignment, const std::string& where) {
    const auto equals = assignment.find('=');
    const auto dot = assignment.find('.');
    if (equals == std::string::npos || dot == std::string::npos || dot > equals) {
        throw ConfigError(where + " '" + assignment + "': allowed: Section.key=value");
    }
    assign(trimmed(assignment.substr(0, dot)),
           trimmed(assignment.substr(dot + 1, equals - dot - 1)),
           trimmed(assignment.substr(equals + 1)), where + ": ");
}

std::string OptionTable::dump() const {
    std::string out;
    for (const auto& [name, sectionText] : sections_) {
        out += "# " + sectionText + "\n[" + name + "]\n";
        for (const auto& option : options_) {
            if (option.section == name) {
                out += "# " + option.text + (option.unit.empty() ? "" : " [" + option.unit + "]") +
                       " (" + option.allowed + "; default " + option.initial + ")\n" + option.key +
                       " = " + option.format() + "\n";
            }
        }
        out += "\n";
    }
    return out;
}

std::string OptionTable::help() const {
    std::string out;
    for (const auto& [name, sectionText] : sections_) {
        out += "[" + name + "] " + sectionText + "\n";
        for (const auto& option : options_) {
            if (option.section == name) {
                out += "  " + option.key + " = " + option.initial +
                       (option.unit.empty() ? "" : " [" + option.unit + "]") + "  (" +
                       option.allowed + ")\n      " + option.text + "\n";
            }
        }
    }
    return out;
}

std::string OptionTable::markdown() const {
    std::string out;
    const auto cell = [](std::string s) {
        for (std::size_t i = 0; (i = s.find('|', i)) != std::string::npos; i += 2) {
            s.replace(i, 1, "\\|");
        }
        return s;
    };
    for (const auto& [name, sectionText] : sections_) {
        out += "### [" + name + "]\n\n" + sectionText +
               "\n\n| key | unit | default | allowed | meaning |\n|---|---|---|---|---|\n";
        for (const auto& option : options_) {
            if (option.section == name) {
                out += "| `" + option.key + "` | " + option.unit + " | " + cell(option.initial) +
                       " | " + cell(option.allowed) + " | " + cell(option.text) + " |\n";
            }
        }
        out += "\n";
    }
    return out;
}

}  // namespace riftmap
