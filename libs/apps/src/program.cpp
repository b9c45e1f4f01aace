// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/apps/program.h"

#include <mrpt/system/os.h>
#include <tbb/global_control.h>
#include <tbb/info.h>

#include <cstdio>
#include <exception>
#include <optional>
#include <utility>

#include "all_programs.h"
#include "riftmap/core/text.h"
#include "riftmap/core/version.h"

namespace riftmap {
namespace {

const std::vector<std::pair<std::string, mrpt::system::VerbosityLevel>>& verbosityLevels() {
    static const std::vector<std::pair<std::string, mrpt::system::VerbosityLevel>> levels = {
        {"debug", mrpt::system::LVL_DEBUG},
        {"info", mrpt::system::LVL_INFO},
        {"warn", mrpt::system::LVL_WARN},
        {"error", mrpt::system::LVL_ERROR}};
    return levels;
}

mrpt::system::VerbosityLevel verbosityFrom(const std::string& text) {
    for (const auto& [name, level] : verbosityLevels()) {
        if (lower(text) == name) {
            return level;
        }
    }
    throw ConfigError("--verbosity '" + text + "': allowed: debug | info | warn | error");
}

/// As a shell takes it: quoted where it must be.
std::string quoted(const std::string& argument) {
    constexpr const char* kPlain =
        "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-+=./:,@%";
    if (!argument.empty() && argument.find_first_not_of(kPlain) == std::string::npos) {
        return argument;
    }
    std::string out = "'";
    for (const char c : argument) {
        out += c == '\'' ? std::string("'\\''") : std::string(1, c);
    }
    return out + "'";
}

void print(const std::string& text) {
    std::fwrite(text.data(), 1, text.size(), stdout);
    std::fflush(stdout);
}

}  // namespace

Program::Program(std::string name, std::string purpose, Config config)
    : mrpt::system::COutputLogger(name),
      name_(std::move(name)),
      purpose_(std::move(purpose)),
      config_(config) {}

Program::~Program() = default;

void Program::arguments(CommandLine& /*line*/) {}

void Program::declare() {
    if (declared_) {
        return;
    }
    declared_ = true;
    describe(table_);
    table_.section("Run", "How the program runs.");
    table_.add("seed", seed_, "Seed of everything random; --seed.");
    table_.add("threads", threads_, 0, 1024, "", "Threads at work at once; 0 = a core each.");
    arguments(line_);
    declareCommonFlags();
}

void Program::declareCommonFlags() {
    line_.value("out", 'o', "PATH", out_, "where the results go");
    line_.values("set", 's', "Section.key=value", sets_,
                 "overrides an option; any number of times, the last wins");
    line_.flag("dump-config", 0, dumpConfig_, "prints the whole configuration as INI and ends");
    line_.value("seed", 0, "N", seedText_, "seed of everything random (Run.seed)");
    line_.value("threads", 0, "N", threadsText_,
                "threads at work at once, 0 = a core each (Run.threads)");
    line_.value("verbosity", 'v', "LEVEL", verbosity_,
                "debug, info, warn or error; warn if not given");
    line_.flag("no-progress", 0, noProgress_, "no progress line");
    line_.values("plugins", 'p', "A.so[,B.so]", plugins_, "shared libraries to load first");
    line_.flag("overwrite", 'w', overwrite_, "replaces results that are already there");
    line_.flag("options-markdown", 0, markdown_,
               "prints the options as they stand in config/README.md and ends");
    line_.flag("help", 'h', help_, "prints this and ends");
    line_.flag("version", 0, version_, "prints the version and ends");
}

/// The files may also hold sections of other programs, which are checked all the same: what one
/// program was run with, another one judges or plays back with. False if there is no file.
bool Program::loadConfiguration() {
    auto files = line_.configFiles();
    if (const auto file = defaultConfiguration(); files.empty() && !file.empty()) {
        files.push_back(file.string());
    }
    if (files.empty()) {
        return false;
    }
    const std::vector<std::unique_ptr<Program>> programs = allPrograms();
    std::vector<OptionTable*> others;
    for (const auto& program : programs) {
        program->declare();
        others.push_back(&program->table_);
    }
    for (const auto& file : files) {
        table_.load(file, others);
    }
    return true;
}

bool Program::initialize(int argc, const char* const* argv) {
    return initialize(std::vector<std::string>(argv + (argc > 0 ? 1 : 0), argv + argc));
}

bool Program::initialize(const std::vector<std::string>& arguments) {
    declare();
    command_ = name_;
    for (const auto& argument : arguments) {
        command_ += " " + quoted(argument);
    }
    line_.parse(arguments);
    if (help_ || version_ || markdown_) {
        print(help_      ? helpText()
              : version_ ? name_ + " (Riftmap) " + kVersion + "\n"
                         : table_.markdown());
        return false;
    }
    setMinLoggingLevel(verbosityFrom(verbosity_));
    loadPlugins();
    const bool configured = loadConfiguration();
    for (const auto& assignment : sets_) {
        table_.set(assignment);
    }
    if (!seedText_.empty()) {
        table_.set("Run.seed=" + seedText_, "--seed");
    }
    if (!threadsText_.empty()) {
        table_.set("Run.threads=" + threadsText_, "--threads");
    }
    if (dumpConfig_) {
        print(table_.dump());
        return false;
    }
    if (config_ == Config::kRequired && !configured) {
        throw ConfigError("missing argument CONFIG.ini; see --help");
    }
    line_.checkPositionals();
    if (threads_ > 0) {
        threadLimit_ = std::make_shared<tbb::global_control>(
            tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(threads_));
    }
    return true;
}

void Program::loadPlugins() {
    for (const auto& plugins : plugins_) {
        std::string error;
        if (!mrpt::system::loadPluginModules(plugins, error)) {
            throw ConfigError("--plugins '" + plugins + "': " + oneLine(error));
        }
    }
}

const OptionTable& Program::table() {
    declare();
    return table_;
}

std::string Program::argument(std::size_t i) const {
    return i < line_.given().size() ? line_.given()[i] : std::string();
}

const std::vector<std::string>& Program::positionals() const {
    return line_.given();
}

const std::vector<std::string>& Program::configFiles() const {
    return line_.configFiles();
}

const std::filesystem::path& Program::requiredOut() const {
    if (out_.empty()) {
        throw ConfigError("missing --out PATH; see --help");
    }
    return out_;
}

RunDirectory Program::makeRunDirectory(const std::vector<std::filesystem::path>& inputs) const {
    const RunInfo info{.program = name_,
                       .command = command_,
                       .config = table_.dump(),
                       .seed = seed_,
                       .threads = threads(),
                       .inputs = inputs};
    return RunDirectory(requiredOut(), info, overwrite_);
}

void Program::checkMayWrite(const std::filesystem::path& file) const {
    if (!overwrite_ && std::filesystem::exists(file)) {
        throw ConfigError(file.string() + ": is there already; --overwrite replaces it");
    }
}

int Program::threads() const {
    return threads_ > 0 ? threads_ : tbb::info::default_concurrency();
}

OnProgress Program::progressOf(const std::string& what, const std::string& unit) const {
    // Shared, for a function is copied.
    const auto bar = std::make_shared<std::optional<Progress>>();
    return [=, enabled = progress()](std::size_t done, std::size_t all) {
        if (!*bar) {
            bar->emplace(what, unit, all, enabled);
        }
        (*bar)->update(done);
    };
}

std::string Program::usageText() const {
    const char* config = config_ == Config::kRequired ? " CONFIG.ini..." : " [CONFIG.ini...]";
    return name_ + config + line_.positionalUsage() + " --out PATH [flags]";
}

std::string Program::helpText() {
    declare();
    return name_ + ": " + purpose_ + "\n\nUsage: " + usageText() + "\n\n" + line_.help() +
           "\nOptions (in CONFIG.ini, or with --set Section.key=value):\n\n" + table_.help();
}

int runProgram(Program& program, int argc, const char* const* argv) {
    return runProgram(program, std::vector<std::string>(argv + (argc > 0 ? 1 : 0), argv + argc));
}

int runProgram(Program& program, const std::vector<std::string>& arguments) {
    const auto fail = [&program](const char* what, int code) {
        std::fflush(stdout);
        std::fprintf(stderr, "%s: %s\n", program.name().c_str(), oneLine(what).c_str());
        return code;
    };
    try {
        if (program.initialize(arguments)) {
            program.run();
        }
        return 0;
    } catch (const ConfigError& e) {
        return fail(e.what(), 2);
    } catch (const std::exception& e) {
        return fail(e.what(), 1);
    } catch (...) {
        return fail("unknown error", 1);
    }
}

}  // namespace riftmap
