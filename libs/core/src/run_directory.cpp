// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/core/run_directory.h"

#include <mrpt/system/os.h>
#include <openssl/crypto.h>
#include <tbb/version.h>

#include <Eigen/Core>
#include <algorithm>
#include <opencv2/core/version.hpp>
#include <ostream>
#include <system_error>

#include "riftmap/core/file.h"
#include "riftmap/core/options.h"
#include "riftmap/core/text.h"
#include "riftmap/core/version.h"

namespace riftmap {
namespace {

namespace fs = std::filesystem;

constexpr const char* kManifest = "manifest.yaml";

std::string yamlString(const std::string& s) {
    constexpr const char* kPlain =
        "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-./";
    const bool isWord = !s.empty() && s.find_first_not_of(kPlain) == std::string::npos &&
                        ((s[0] >= 'a' && s[0] <= 'z') || (s[0] >= 'A' && s[0] <= 'Z'));
    const std::string low = lower(s);
    const auto means = {"true", "false", "yes", "no", "on", "off", "null", "y", "n"};
    if (isWord && std::find(means.begin(), means.end(), low) == means.end()) {
        return s;
    }
    std::string out = "\"";
    for (const char c : s) {
        if (c == '"' || c == '\\') {
            out += '\\';
            out += c;
        } else if (static_cast<unsigned char>(c) < 0x20) {
            out += c == '\n' ? "\\n" : c == '\t' ? "\\t" : " ";
        } else {
            out += c;
        }
    }
    return out + "\"";
}

void empty(const fs::path& directory) {
    for (const auto& entry : fs::directory_iterator(directory)) {
        fs::remove_all(entry.path());
    }
}

void prepare(const fs::path& directory, bool overwrite) {
    std::error_code error;
    if (fs::exists(directory) && !fs::is_directory(directory)) {
        throw ConfigError(directory.string() + ": is a file, not a directory for the results");
    }
    if (fs::is_directory(directory) && !fs::is_empty(directory)) {
        if (!fs::exists(directory / kManifest)) {
            throw ConfigError(directory.string() +
                              ": is not empty and not a run of Riftmap; name another with --out");
        }
        if (!overwrite) {
            throw ConfigError(directory.string() +
                              ": holds an older run; name another with --out, or give --overwrite");
        }
        empty(directory);
    }
    fs::create_directories(directory, error);
    if (error) {
        throw ConfigError(directory.string() + ": cannot be made: " + error.message());
    }
}

YamlMap manifest(const RunInfo& info) {
    YamlMap map;
    map.set("program", info.program);
    map.set("command", info.command);
    map.set("seed", info.seed);
    map.set("threads", info.threads);
    const YamlMap libraries = versions();
    for (const auto& [key, value] : libraries.entries()) {
        map.set(key, value);
    }
    for (std::size_t i = 0; i < info.inputs.size(); ++i) {
        const std::string key = "input_" + std::to_string(i + 1);
        map.set(key, info.inputs[i].string());
        if (fs::is_regular_file(info.inputs[i])) {
            map.set(key + "_sha256", sha256OfFile(info.inputs[i]));
        }
    }
    return map;
}

}  // namespace

void YamlMap::set(const std::string& key, const Field& value) {
    const auto found = std::find_if(entries_.begin(), entries_.end(),
                                    [&](const auto& entry) { return entry.first == key; });
    if (found == entries_.end()) {
        entries_.emplace_back(key, value);
    } else {
        found->second = value;
    }
}

std::string YamlMap::text() const {
    std::string out;
    for (const auto& [key, value] : entries_) {
        out += key + ": " + (value.isText() ? yamlString(value.text()) : value.text()) + "\n";
    }
    return out;
}

YamlMap versions() {
    YamlMap map;
    map.set("riftmap_version", kVersion);
    map.set("mrpt_version", mrpt::system::MRPT_getVersion());
    map.set("opencv_version", CV_VERSION);
    map.set("eigen_version", std::to_string(EIGEN_WORLD_VERSION) + "." +
                                 std::to_string(EIGEN_MAJOR_VERSION) + "." +
                                 std::to_string(EIGEN_MINOR_VERSION));
    map.set("tbb_version", TBB_runtime_version());
    map.set("openssl_version", OpenSSL_version(OPENSSL_VERSION_STRING));
    return map;
}

RunDirectory::RunDirectory(std::filesystem::path directory, const RunInfo& info, bool overwrite)
    : directory_(std::move(directory)) {
    // First the inputs, while nothing is changed: they may be missing, or lie in the old run.
    const std::string text = manifest(info).text();
    for (const auto& input : info.inputs) {
        const auto inside =
            fs::weakly_canonical(input).lexically_relative(fs::weakly_canonical(directory_));
        if (overwrite && !inside.empty() && *inside.begin() != "..") {
            throw ConfigError(input.string() + ": lies in " + directory_.string() +
                              ", which --overwrite would empty");
        }
    }
    prepare(directory_, overwrite);
    writeAtomically(file(kManifest), [&](std::ostream& out) { out << text; });
    writeAtomically(file("config_used.ini"), [&](std::ostream& out) { out << info.config; });
}

RunDirectory RunDirectory::resume(std::filesystem::path directory) {
    if (!fs::exists(directory / kManifest)) {
        throw ConfigError(directory.string() + ": no run of Riftmap to go on with");
    }
    return RunDirectory(std::move(directory));
}

void RunDirectory::writeSummary(const YamlMap& summary) const {
    writeAtomically(file("summary.yaml"), [&](std::ostream& out) { out << summary.text(); });
}

}  // namespace riftmap
