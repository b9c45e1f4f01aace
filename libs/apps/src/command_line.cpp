// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/apps/command_line.h"

#include <algorithm>
#include <set>
#include <utility>

#include "riftmap/core/options.h"
#include "riftmap/core/text.h"

namespace riftmap {
namespace {

constexpr std::size_t kHelpColumn = 28;

std::string helpLine(const std::string& left, const std::string& text) {
    const std::string gap =
        left.size() + 4 <= kHelpColumn ? std::string(kHelpColumn - left.size() - 2, ' ') : "  ";
    return "  " + left + gap + text + "\n";
}

}  // namespace

void CommandLine::positional(const std::string& name, const std::string& text, Count count) {
    positionals_.push_back({name, text, count});
}

void CommandLine::flag(const std::string& name, char shortName, bool& value,
                       const std::string& text) {
    add({name, shortName, "", text, true, [&value](const std::string&) { value = true; }});
}

void CommandLine::value(const std::string& name, char shortName, const std::string& placeholder,
                        std::string& value, const std::string& text) {
    add({name, shortName, placeholder, text, false, [&value](const std::string& s) { value = s; }});
}

void CommandLine::value(const std::string& name, char shortName, const std::string& placeholder,
                        std::filesystem::path& value, const std::string& text) {
    add({name, shortName, placeholder, text, false, [&value](const std::string& s) { value = s; }});
}

void CommandLine::values(const std::string& name, char shortName, const std::string& placeholder,
                         std::vector<std::string>& value, const std::string& text) {
    add({name, shortName, placeholder, text, true,
         [&value](const std::string& s) { value.push_back(s); }});
}

void CommandLine::add(Flag flag) {
    flags_.push_back(std::move(flag));
}

const CommandLine::Flag& CommandLine::find(const std::string& argument) const {
    const bool isLong = argument.rfind("--", 0) == 0;
    std::vector<std::string> known;
    for (const auto& flag : flags_) {
        if (isLong ? argument.substr(2) == flag.name
                   : argument.size() == 2 && argument[1] == flag.shortName) {
            return flag;
        }
        known.push_back("--" + flag.name);
    }
    throw ConfigError("unknown flag '" + argument + "'; did you mean '" +
                      nearestName(argument, known) + "'?");
}

void CommandLine::parse(const std::vector<std::string>& arguments) {
    std::set<std::string> seen;
    bool flagsEnded = false;
    for (std::size_t i = 0; i < arguments.size(); ++i) {
        const std::string& argument = arguments[i];
        if (flagsEnded || argument.size() < 2 || argument[0] != '-') {
            const bool isConfig = given_.empty() && lower(argument).ends_with(".ini");
            (isConfig ? configFiles_ : given_).push_back(argument);
            continue;
        }
        if (argument == "--") {
            flagsEnded = true;
            continue;
        }
        const auto equals = argument.find('=');
        const Flag& flag = find(argument.substr(0, equals));
        if (!seen.insert(flag.name).second && !flag.repeatable) {
            throw ConfigError("--" + flag.name + " is given twice");
        }
        if (flag.placeholder.empty()) {
            if (equals != std::string::npos) {
                throw ConfigError("--" + flag.name + " takes no value");
            }
            flag.set("");
        } else if (equals != std::string::npos) {
            flag.set(argument.substr(equals + 1));
        } else if (i + 1 < arguments.size()) {
            flag.set(arguments[++i]);
        } else {
            throw ConfigError("--" + flag.name + " needs a value: " + flag.placeholder);
        }
    }
}

void CommandLine::checkPositionals() const {
    std::size_t needed = 0;
    bool endless = false;
    for (const auto& p : positionals_) {
        if (p.count != Count::kOptional && given_.size() <= needed) {
            throw ConfigError("missing argument " + p.name + " (" + p.text + "); see --help");
        }
        ++needed;
        endless = endless || p.count == Count::kMany;
    }
    if (given_.size() > needed && !endless) {
        throw ConfigError("superfluous argument '" + given_[needed] + "'; see --help");
    }
}

std::string CommandLine::positionalUsage() const {
    std::string usage;
    for (const auto& p : positionals_) {
        usage += p.count == Count::kOptional ? " [" + p.name + "]"
                 : p.count == Count::kMany   ? " " + p.name + "..."
                                             : " " + p.name;
    }
    return usage;
}

std::string CommandLine::help() const {
    std::string out;
    if (!positionals_.empty()) {
        out += "Arguments:\n";
        for (const auto& p : positionals_) {
            out += helpLine(p.name, p.text);
        }
        out += "\n";
    }
    out += "Flags:\n";
    for (const auto& flag : flags_) {
        const std::string shortText =
            flag.shortName == 0 ? "" : std::string("-") + flag.shortName + ", ";
        const std::string value = flag.placeholder.empty() ? "" : " " + flag.placeholder;
        out += helpLine(shortText + "--" + flag.name + value, flag.text);
    }
    return out;
}

}  // namespace riftmap
