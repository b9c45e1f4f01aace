// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "riftmap/core/csv.h"

namespace riftmap {

/// Flat `key: value` pairs in the order in which they were first set.
class YamlMap {
 public:
    void set(const std::string& key, const Field& value);
    /// The text of a file; strings are quoted where YAML needs it.
    std::string text() const;
    const std::vector<std::pair<std::string, Field>>& entries() const { return entries_; }

 private:
    std::vector<std::pair<std::string, Field>> entries_;
};

/// What a run was, for its manifest.
struct RunInfo {
    std::string program;
    std::string command;  ///< as typed
    std::string config;   ///< the whole configuration, as INI text that loads again
    std::uint64_t seed = 0;
    int threads = 1;
    std::vector<std::filesystem::path> inputs;  ///< files; their SHA-256 is recorded
};

/// The directory that one run fills; it never mixes with an older one. Not thread-safe.
class RunDirectory {
 public:
    /// Makes the directory and writes `config_used.ini` and `manifest.yaml` (versions, seed,
    /// threads, command, hashes of the inputs) into it. A directory that holds anything already is
    /// refused; with `overwrite` one that holds a `manifest.yaml` is emptied first, but any other
    /// still refused. Throws ConfigError (refused), FileError.
    RunDirectory(std::filesystem::path directory, const RunInfo& info, bool overwrite);
    /// Goes on in the directory of an interrupted run; changes nothing there. Throws ConfigError
    /// where there is none.
    static RunDirectory resume(std::filesystem::path directory);

    const std::filesystem::path& path() const { return directory_; }
    /// A file in it.
    std::filesystem::path file(const std::string& name) const { return directory_ / name; }
    /// Writes `summary.yaml`. Throws FileError.
    void writeSummary(const YamlMap& summary) const;

 private:
    explicit RunDirectory(std::filesystem::path directory) : directory_(std::move(directory)) {}

    std::filesystem::path directory_;
};

/// The versions of Riftmap and of the libraries under it, for manifests.
YamlMap versions();

}  // namespace riftmap
