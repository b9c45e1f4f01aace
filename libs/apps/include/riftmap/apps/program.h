// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <mrpt/system/COutputLogger.h>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "riftmap/apps/command_line.h"
#include "riftmap/core/options.h"
#include "riftmap/core/progress.h"
#include "riftmap/core/run_directory.h"

namespace riftmap {

/// A program as a class, to be run from main() or from a test:
///
///     program [CONFIG.ini...] [INPUT...] --out PATH [flags]
///
/// The base class owns the command line that all programs share: --out, --set, --dump-config,
/// --seed, --threads, -v/--verbosity, --no-progress, -p/--plugins, -w/--overwrite, --help,
/// --version. A derived class names its options (`describe`), its own arguments (`arguments`) and
/// does its work (`run`). Leading arguments that end in `.ini` are the configuration; of several,
/// the later wins. Use each object once.
class Program : public mrpt::system::COutputLogger {
 public:
    enum class Config {
        kOptional,  ///< runs with the defaults when there is none
        kRequired,
    };

    Program(std::string name, std::string purpose, Config config);
    ~Program() override;
    Program(const Program&) = delete;
    Program& operator=(const Program&) = delete;

    /// Reads the command line (argv[0] is ignored) and the configuration, loads the plug-ins and
    /// limits the threads. False when all that was asked for was text (--help, --version,
    /// --options-markdown, --dump-config), now on stdout. Throws ConfigError.
    bool initialize(int argc, const char* const* argv);
    /// The same, from the arguments alone.
    bool initialize(const std::vector<std::string>& arguments);

    /// The work; after initialize() returned true. Throws ConfigError where the configuration
    /// turns out to be wrong, anything else where the work failed.
    virtual void run() = 0;

    const std::string& name() const { return name_; }
    /// The options with their present values.
    const OptionTable& table();
    /// What --help prints: purpose, usage, arguments, flags, options.
    std::string helpText();

 protected:
    /// Binds the options of all parts of the program.
    virtual void describe(OptionTable& table) = 0;
    /// Declares positional arguments and flags; none by default.
    virtual void arguments(CommandLine& line);
    /// Configuration that is loaded where none is given on the command line; empty: none.
    virtual std::filesystem::path defaultConfiguration() const { return {}; }

    // What the command line said; meaningful in run().
    /// Positional argument number i, without the INI files; empty if it was not given.
    std::string argument(std::size_t i) const;
    const std::vector<std::string>& positionals() const;
    const std::filesystem::path& out() const { return out_; }  ///< --out; empty if not given
    /// --out. Throws ConfigError if it was not given.
    const std::filesystem::path& requiredOut() const;
    std::uint64_t seed() const { return seed_; }    ///< default 0
    int threads() const;                            ///< at most so many work at once
    bool overwrite() const { return overwrite_; }   ///< -w
    bool progress() const { return !noProgress_; }  ///< --no-progress not given
    /// A Progress line that begins at the first call: for work that may not come.
    OnProgress progressOf(const std::string& what, const std::string& unit) const;
    const std::string& commandText() const { return command_; }  ///< as typed, for manifests
    const std::vector<std::string>& configFiles() const;

    /// The run directory named by --out, with its manifest and config_used.ini; -w allows an older
    /// run to be replaced. `inputs`: files whose hashes go into the manifest. Throws ConfigError.
    RunDirectory makeRunDirectory(const std::vector<std::filesystem::path>& inputs = {}) const;
    /// Throws ConfigError if the file is there and -w was not given: for programs whose --out is a
    /// file.
    void checkMayWrite(const std::filesystem::path& file) const;

 private:
    void declare();
    bool loadConfiguration();
    void declareCommonFlags();
    void loadPlugins();
    std::string usageText() const;

    std::string name_, purpose_;
    Config config_;
    CommandLine line_;
    OptionTable table_;
    bool declared_ = false;
    std::string command_;
    std::filesystem::path out_;
    std::vector<std::string> sets_, plugins_;
    std::string seedText_, threadsText_, verbosity_ = "WARN";
    std::uint64_t seed_ = 0;
    int threads_ = 0;  ///< 0 = one a core
    bool help_ = false, version_ = false, markdown_ = false, dumpConfig_ = false;
    bool overwrite_ = false, noProgress_ = false;
    std::shared_ptr<void> threadLimit_;  ///< a tbb::global_control
};

/// initialize() and run() with exit codes: 0 done, 1 failed while running, 2 wrong usage or
/// configuration. An error is one line on stderr that starts with the program's name.
int runProgram(Program& program, int argc, const char* const* argv);
int runProgram(Program& program, const std::vector<std::string>& arguments);

}  // namespace riftmap
