// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/apps/program.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <mrpt/core/exceptions.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <functional>
#include <string>
#include <vector>

#include "riftmap/core/file.h"

namespace riftmap {
namespace {

using ::testing::HasSubstr;
using ::testing::MatchesRegex;
using ::testing::StartsWith;
using Arguments = std::vector<std::string>;

/// Adds the lengths of its inputs; everything public, as tests of real programs need it.
class SampleProgram : public Program {
 public:
    explicit SampleProgram(Config config = Config::kOptional)
        : Program("riftmap-sample", "Adds lengths.", config) {}

    void run() override {
        ran = true;
        threadLimit =
            tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism);
        if (failure) {
            failure();
        }
    }

    bool ran = false;
    bool twice = false;
    double length = 0.5;
    std::vector<std::string> extras;
    std::size_t threadLimit = 0;
    std::function<void()> failure;

    using Program::argument;
    using Program::checkMayWrite;
    using Program::commandText;
    using Program::configFiles;
    using Program::makeRunDirectory;
    using Program::out;
    using Program::overwrite;
    using Program::positionals;
    using Program::progress;
    using Program::requiredOut;
    using Program::seed;
    using Program::threads;

 protected:
    void describe(OptionTable& table) override {
        table.section("Sample", "Options of the sample.");
        table.add("length", length, 0.0, 10.0, "m", "A length.");
    }
    void arguments(CommandLine& line) override {
        line.positional("INPUT", "what to add", CommandLine::Count::kMany);
        line.flag("twice", 't', twice, "adds everything twice");
        line.values("extra", 0, "NAME", extras, "one more");
    }
};

struct Outcome {
    int code;
    std::string out, err;
};

Outcome outcome(SampleProgram& program, const Arguments& arguments) {
    testing::internal::CaptureStdout();
    testing::internal::CaptureStderr();
    const int code = runProgram(program, arguments);
    return {code, testing::internal::GetCapturedStdout(), testing::internal::GetCapturedStderr()};
}

Outcome outcome(const Arguments& arguments) {
    SampleProgram program;
    return outcome(program, arguments);
}

void expectUsageError(const Arguments& arguments, const std::string& message) {
    SampleProgram program;
    const Outcome result = outcome(program, arguments);
    EXPECT_EQ(result.code, 2);
    EXPECT_FALSE(program.ran);
    EXPECT_THAT(result.err, StartsWith("riftmap-sample: "));
    EXPECT_THAT(result.err, HasSubstr(message));
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
}

std::string writeIni(const std::string& name, const std::string& content) {
    const auto file = std::filesystem::path(testing::TempDir()) / ("riftmap_program_" + name);
    std::ofstream(file) << content;
    return file.string();
}

TEST(Program, ReadsConfigurationThenFlags) {
    SampleProgram program;
    const auto first = writeIni("first.ini", "[Sample]\nlength=1\n[Run]\nseed=5\nthreads=2\n");
    const auto second = writeIni("second.INI", "[Sample]\nlength=2\n");
    ASSERT_TRUE(program.initialize({first, second, "a", "b", "--out", "dir", "-w", "--set",
                                    "Sample.length=3", "-t", "--extra=x", "--extra", "y",
                                    "--no-progress", "-s", "Sample.length=4"}));
    EXPECT_EQ(program.length, 4);
    EXPECT_EQ(program.configFiles(), (Arguments{first, second}));
    EXPECT_EQ(program.positionals(), (Arguments{"a", "b"}));
    EXPECT_EQ(program.argument(1), "b");
    EXPECT_EQ(program.argument(2), "");
    EXPECT_EQ(program.requiredOut(), "dir");
    EXPECT_TRUE(program.overwrite());
    EXPECT_TRUE(program.twice);
    EXPECT_FALSE(program.progress());
    EXPECT_EQ(program.extras, (Arguments{"x", "y"}));
    EXPECT_EQ(program.seed(), 5U);
    EXPECT_EQ(program.threads(), 2);
    program.run();
    EXPECT_EQ(program.threadLimit, 2U);
}

// One file configures several programs; a mistake in what another program reads is found too.
TEST(Program, SectionsOfOtherProgramsAreCheckedButNotTaken) {
    SampleProgram program;
    const auto shared =
        writeIni("shared.ini", "[Explore]\nplanner=random\n[baseline]\n[Sample]\nlength=2\n");
    ASSERT_TRUE(program.initialize({shared, "a"}));
    EXPECT_EQ(program.length, 2);
    expectUsageError({writeIni("value.ini", "[Explore]\nplanner=rndom\n"), "a"},
                     "[Explore] planner = 'rndom'");
    expectUsageError({writeIni("key.ini", "[Stop]\nmax_view=3\n"), "a"},
                     "unknown key 'max_view' in [Stop]; did you mean 'max_views'?");
    expectUsageError({writeIni("nowhere.ini", "[Explor]\nplanner=random\n"), "a"},
                     "unknown section [Explor]");
    expectUsageError({"a", "--set", "Explore.planner=random"}, "unknown section [Explore]");
}

TEST(Program, CommandLineBeatsFile) {
    SampleProgram program;
    const auto file = writeIni("seed.ini", "[Run]\nseed=5\nthreads=2\n");
    ASSERT_TRUE(program.initialize({"--seed", "7", file, "a", "--threads=1"}));
    EXPECT_EQ(program.seed(), 7U);
    EXPECT_EQ(program.threads(), 1);
    EXPECT_THAT(program.commandText(), MatchesRegex("riftmap-sample --seed 7 .*seed.ini a .*"));
}

TEST(Program, ArgvForm) {
    SampleProgram program;
    const char* argv[] = {"/some/where/riftmap-sample", "a", "--", "-t", nullptr};
    ASSERT_TRUE(program.initialize(4, argv));
    EXPECT_EQ(program.positionals(), (Arguments{"a", "-t"}));
    EXPECT_FALSE(program.twice);
    EXPECT_THROW(program.requiredOut(), ConfigError);
}

TEST(Program, HelpListsEverythingAndSucceeds) {
    for (const char* flag : {"--help", "-h"}) {
        SampleProgram program(Program::Config::kRequired);
        const Outcome result = outcome(program, {flag});
        EXPECT_EQ(result.code, 0);
        EXPECT_FALSE(program.ran);
        EXPECT_EQ(result.err, "");
        for (const char* text :
             {"Usage: riftmap-sample CONFIG.ini... INPUT... --out PATH", "Adds lengths.",
              "-t, --twice", "--extra NAME", "--set Section.key=value", "--dump-config", "--seed N",
              "--threads N", "-v, --verbosity LEVEL", "--no-progress", "-p, --plugins",
              "-w, --overwrite", "--help", "--version", "length = 0.5 [m]  (0 .. 10)",
              "A length."}) {
            EXPECT_THAT(result.out, HasSubstr(text));
        }
    }
}

TEST(Program, VersionIsThatOfTheBuild) {
    const Outcome result = outcome({"--version"});
    EXPECT_EQ(result.code, 0);
    EXPECT_THAT(result.out,
                MatchesRegex("riftmap-sample \\(Riftmap\\) [0-9]+\\.[0-9]+\\.[0-9]+\n"));
}

TEST(Program, OptionsAsMarkdown) {
    const Outcome result = outcome({"--options-markdown"});
    EXPECT_EQ(result.code, 0);
    EXPECT_THAT(result.out, HasSubstr("### [Sample]\n\nOptions of the sample.\n"));
    EXPECT_THAT(result.out, HasSubstr("| `length` | m | 0.5 | 0 .. 10 | A length. |\n"));
    EXPECT_THAT(result.out, HasSubstr("| `seed` |"));
}

TEST(Program, DumpedConfigurationLoadsAgain) {
    const Outcome first = outcome({"--dump-config", "--set", "Sample.length=0.1", "--seed", "3"});
    EXPECT_EQ(first.code, 0);
    EXPECT_THAT(first.out, HasSubstr("length = 0.1"));
    EXPECT_THAT(first.out, HasSubstr("seed = 3"));
    const Outcome second = outcome({writeIni("dump.ini", first.out), "--dump-config"});
    EXPECT_EQ(second.err, "");
    EXPECT_EQ(second.out, first.out);
}

TEST(Program, WrongUsageIsOneLineAndTwo) {
    expectUsageError({}, "missing argument INPUT");
    expectUsageError({"a", "--twise"}, "unknown flag '--twise'; did you mean '--twice'?");
    expectUsageError({"a", "-x"}, "unknown flag '-x'");
    expectUsageError({"a", "--thread=2"}, "did you mean '--threads'?");
    expectUsageError({"a", "--out"}, "--out needs a value");
    expectUsageError({"a", "--out", "b", "-o", "c"}, "--out is given twice");
    expectUsageError({"a", "--twice=1"}, "takes no value");
    expectUsageError({"a", "--seed", "-1"}, "--seed: [Run] seed = '-1': not a number");
    expectUsageError({"a", "--threads", "2000"}, "0 .. 1024");
    expectUsageError({"a", "-v", "loud"}, "debug | info | warn | error");
    expectUsageError({"a", "--set", "Sample.lenght=1"}, "did you mean 'length'");
    expectUsageError({"a", "--set", "Sample.length=11"}, "allowed: 0 .. 10 [m]");
    expectUsageError({"/nonexistent/c.ini", "a"}, "/nonexistent/c.ini: no such");
    expectUsageError({"a", "-p", "/nonexistent/libx.so"}, "/nonexistent/libx.so");
}

TEST(Program, RequiredConfigurationIsAskedFor) {
    SampleProgram program(Program::Config::kRequired);
    const Outcome result = outcome(program, {"a"});
    EXPECT_EQ(result.code, 2);
    EXPECT_THAT(result.err, HasSubstr("missing argument CONFIG.ini"));
}

TEST(Program, FailureWhileRunningIsOneLineAndOne) {
    SampleProgram program;
    program.failure = [] { throw std::runtime_error("k.rawlog: cut\nafter object 7"); };
    const Outcome result = outcome(program, {"a"});
    EXPECT_EQ(result.code, 1);
    EXPECT_EQ(result.err, "riftmap-sample: k.rawlog: cut after object 7\n");
}

TEST(Program, NoBacktraceOfMrptIsShown) {
    SampleProgram program;
    program.failure = [] { THROW_EXCEPTION("the pose is not finite"); };
    const Outcome result = outcome(program, {"a"});
    EXPECT_EQ(result.code, 1);
    EXPECT_EQ(result.err, "riftmap-sample: the pose is not finite\n");
}

TEST(Program, WrongConfigurationFoundWhileRunningIsTwo) {
    SampleProgram program;
    program.failure = [] { throw ConfigError("[World] mesh: no such file"); };
    EXPECT_EQ(outcome(program, {"a"}).code, 2);
}

TEST(Program, RunDirectoryRecordsTheRun) {
    const auto dir = std::filesystem::path(testing::TempDir()) / "riftmap_program_run";
    std::filesystem::remove_all(dir);
    const auto input = writeIni("input.txt", "abc");
    const Arguments arguments = {input,    "--out", dir.string(), "--set", "Sample.length=3",
                                 "--seed", "9"};
    const auto run = [&](const Arguments& with) {
        SampleProgram program;
        program.failure = [&] { program.makeRunDirectory({input}); };
        return outcome(program, with);
    };
    ASSERT_EQ(run(arguments).code, 0);
    const std::string manifest = readFile(dir / "manifest.yaml");
    EXPECT_THAT(manifest, HasSubstr("seed: 9\n"));
    EXPECT_THAT(manifest, HasSubstr("program: riftmap-sample\n"));
    EXPECT_THAT(manifest, HasSubstr("--set Sample.length=3"));
    EXPECT_THAT(manifest,
                HasSubstr("ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad"));

    const Outcome again = run(arguments);
    EXPECT_EQ(again.code, 2);
    EXPECT_THAT(again.err, HasSubstr("holds an older run"));
    Arguments overwriting = arguments;
    overwriting.emplace_back("-w");
    EXPECT_EQ(run(overwriting).code, 0);

    SampleProgram same;
    ASSERT_TRUE(same.initialize({(dir / "config_used.ini").string(), "a"}));
    EXPECT_EQ(same.length, 3);
    EXPECT_EQ(same.seed(), 9U);
}

TEST(Program, FilesAreReplacedOnlyIfAsked) {
    const auto file = writeIni("kept.txt", "abc");
    SampleProgram careful, bold;
    ASSERT_TRUE(careful.initialize({"a"}));
    ASSERT_TRUE(bold.initialize({"a", "--overwrite"}));
    EXPECT_THROW(careful.checkMayWrite(file), ConfigError);
    EXPECT_NO_THROW(careful.checkMayWrite(file + ".other"));
    EXPECT_NO_THROW(bold.checkMayWrite(file));
}

TEST(Program, SuccessIsSilentAndZero) {
    SampleProgram program;
    const Outcome result = outcome(program, {"a"});
    EXPECT_EQ(result.code, 0);
    EXPECT_TRUE(program.ran);
    EXPECT_EQ(result.out + result.err, "");
}

}  // namespace
}  // namespace riftmap
