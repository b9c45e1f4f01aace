// SPDX-License-Identifier: BSD-3-Clause
#include "explore_record.h"

#include <algorithm>
#include <fstream>
#include <map>
#include <set>
#include <sstream>
#include <stdexcept>

#include "riftmap/apps/rawlog_writer.h"
#include "riftmap/core/csv.h"
#include "riftmap/core/file.h"
#include "riftmap/core/options.h"

namespace riftmap {
namespace {

namespace fs = std::filesystem;

/// "Section.key" to value, of a configuration as OptionTable::dump() writes it.
std::map<std::string, std::string> optionsOf(const std::string& config) {
    std::map<std::string, std::string> options;
    std::istringstream lines(config);
    std::string section;
    for (std::string line; std::getline(lines, line);) {
        const auto equals = line.find(" =");
        if (line.starts_with('[')) {
            section = line.substr(1, line.find(']') - 1) + ".";
        } else if (!line.starts_with('#') && equals != std::string::npos) {
            options[section + line.substr(0, equals)] = line.substr(equals + 2);
        }
    }
    return options;
}

bool isLimit(const std::string& key) {
    return key.starts_with("Stop.");
}

/// What changes neither views nor figures.
bool doesNotMatter(const std::string& key) {
    const std::set<std::string> keys = {"Run.threads", "Explore.picture_every", "Eval.cache"};
    return keys.contains(key);
}

/// The first key whose value differs, among those that `counts` takes.
template <class F>
std::optional<std::string> firstDifference(const std::string& a, const std::string& b,
                                           const F& counts) {
    const auto mine = optionsOf(a);
    const auto other = optionsOf(b);
    for (const auto& [key, value] : mine) {
        const auto found = other.find(key);
        if (counts(key) && (found == other.end() || found->second != value)) {
            return key;
        }
    }
    return std::nullopt;
}

std::string usedConfiguration(const RunDirectory& directory) {
    return readFile(directory.file("config_used.ini"));
}

/// Lines of a text that have an end.
std::size_t wholeLines(const std::string& text) {
    return static_cast<std::size_t>(std::count(text.begin(), text.end(), '\n'));
}

std::size_t wholeLines(const fs::path& file) {
    return fs::exists(file) ? wholeLines(readFile(file)) : 0;
}

/// Leaves the first lines of a file, or no file where it has none.
void keepLines(const fs::path& file, std::size_t lines) {
    if (!fs::exists(file)) {
        return;
    }
    const std::string text = readFile(file);
    std::size_t end = 0;
    for (std::size_t i = 0; i < lines; ++i) {
        end = text.find('\n', end) + 1;
    }
    if (end == 0) {
        fs::remove(file);
    } else if (end < text.size()) {
        writeAtomically(file, [&](std::ostream& out) { out << text.substr(0, end); });
    }
}

std::size_t withoutHeader(std::size_t lines) {
    return lines > 0 ? lines - 1 : 0;
}

double numberIn(const std::string& text, const fs::path& file) {
    try {
        return std::stod(text);
    } catch (const std::logic_error&) {
        throw FileError(file.string() + ": '" + text + "' is no number");
    }
}

std::vector<StepRow> readRows(const fs::path& file) {
    std::vector<StepRow> rows;
    const CsvTable table = readCsv(file);
    for (const auto& cells : table.rows) {
        StepRow row;
        for (const auto& [name, member] :
             {std::pair{"stereo_ms", &StepRow::stereoMs}, std::pair{"merge_ms", &StepRow::mergeMs},
              std::pair{"rifts_ms", &StepRow::riftsMs}, std::pair{"plan_ms", &StepRow::planMs},
              std::pair{"seconds", &StepRow::seconds}}) {
            row.*member = numberIn(cells[table.column(name)], file);
        }
        rows.push_back(row);
    }
    return rows;
}

std::vector<std::vector<Coverage>> readCoverage(const fs::path& file,
                                                const std::vector<double>& deltas) {
    constexpr std::size_t kFirst = 3;  // after view, path and gain: two columns a distance
    std::vector<std::vector<Coverage>> all;
    const CsvTable table = readCsv(file);
    if (table.header.size() != kFirst + 2 * deltas.size()) {
        throw FileError(file.string() + ": has columns for other distances");
    }
    for (const auto& cells : table.rows) {
        all.emplace_back();
        for (std::size_t i = 0; i < deltas.size(); ++i) {
            all.back().push_back({deltas[i], numberIn(cells[kFirst + 2 * i], file),
                                  numberIn(cells[kFirst + 2 * i + 1], file)});
        }
    }
    return all;
}

/// Before anything is cut: a file without this column is of another version.
void checkColumn(const fs::path& table, const std::string& column) {
    std::ifstream in(table);
    std::string header;
    if (std::getline(in, header) &&
        ("," + header + ",").find("," + column + ",") == std::string::npos) {
        throw FileError(table.string() + ":1: no column '" + column +
                        "': recorded by another version; nothing is changed");
    }
}

}  // namespace

void checkSameConfiguration(const RunDirectory& directory, const std::string& config) {
    const auto matters = [](const std::string& key) {
        return !isLimit(key) && !doesNotMatter(key);
    };
    const std::string used = usedConfiguration(directory);
    if (const auto key = firstDifference(used, config, matters)) {
        const auto here = optionsOf(config);
        const auto found = here.find(*key);
        throw ConfigError(directory.path().string() + ": was run with " + *key + " =" +
                          optionsOf(used).at(*key) + ", not" +
                          (found == here.end() ? std::string(" without") : found->second) +
                          "; --resume goes on with the same configuration, but for [Stop]");
    }
}

std::optional<std::string> howItEnded(const RunDirectory& directory, const std::string& config) {
    const fs::path summary = directory.file("summary.yaml");
    if (!fs::exists(summary)) {
        return std::nullopt;
    }
    const std::string key = "\nstop_reason: ";
    const std::string text = "\n" + readFile(summary);
    const auto at = text.find(key);
    if (at == std::string::npos) {
        return std::nullopt;
    }
    const auto begin = at + key.size();
    const std::string reason = text.substr(begin, text.find('\n', begin) - begin);
    const bool sameLimits = !firstDifference(usedConfiguration(directory), config, isLimit);
    const bool limit = reason.starts_with("max_");
    return reason == "interrupted" || (limit && !sameLimits) ? std::nullopt : std::optional(reason);
}

ExploreRecord salvageRecord(const RunDirectory& directory, bool rawlog,
                            const std::vector<double>& deltas) {
    ExploreRecord record;
    const fs::path steps = directory.file("steps.csv");
    const fs::path curve = directory.file("coverage.csv");
    const fs::path trajectory = directory.file("trajectory.tum");
    const fs::path gains = directory.file("gains.csv");
    checkColumn(steps, "seconds");
    checkColumn(gains, "expected_share");
    if (wholeLines(steps) > 0 && wholeLines(gains) == 0) {
        throw FileError(gains.string() + ": missing, or without a line, beside " +
                        steps.filename().string() + "; nothing is changed");
    }
    std::size_t rows = std::min({withoutHeader(wholeLines(steps)), withoutHeader(wholeLines(gains)),
                                 wholeLines(trajectory)});
    if (!deltas.empty()) {
        rows = std::min(rows, withoutHeader(wholeLines(curve)));
    }
    if (rawlog) {
        record.observations = salvageRawlog(directory.file("run.rawlog"), rows > 0);
        rows = std::min(rows, record.observations);
    }
    keepLines(trajectory, rows);
    for (const fs::path& table : {steps, curve, gains}) {
        keepLines(table, rows > 0 ? rows + 1 : 0);
    }
    if (rows > 0) {
        record.rows = readRows(steps);
        if (!deltas.empty()) {
            record.coverage = readCoverage(curve, deltas);
        }
    }
    return record;
}

ReplayingPlatform::ReplayingPlatform(SimulatedPlatform& platform, const RunDirectory& directory,
                                     std::size_t views)
    : platform_(platform), rawlog_(directory.file("run.rawlog").string()), views_(views) {
    if (views > 0) {
        reader_.emplace(rawlog_, RawlogOptions{});
    }
}

StereoObservation ReplayingPlatform::grab() {
    if (grabbed_++ >= views_) {
        return platform_.grab();
    }
    auto observation = reader_->next();
    if (!observation) {
        throw FileError(rawlog_ + ": ends before view " + std::to_string(grabbed_));
    }
    constexpr double kSame = 1e-6;  // [m], and of the axes; the file costs the last bits
    const Pose here = platform_.pose();
    const Pose& there = observation->world_T_camera;
    if ((here.translation - there.translation).norm() > kSame ||
        (here.rotation - there.rotation).norm() > kSame) {
        throw std::runtime_error(rawlog_ + ": view " + std::to_string(grabbed_) +
                                 " is not from where this run would take it: recorded by another "
                                 "version or on another world");
    }
    observation->time_ns = platform_.state().time_ns;  // MRPT's clock ticks every 100 ns
    platform_.skipView();
    return std::move(*observation);
}

}  // namespace riftmap
