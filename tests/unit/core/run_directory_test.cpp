// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/core/run_directory.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "riftmap/core/file.h"
#include "riftmap/core/options.h"
#include "temporary_folder.h"

namespace riftmap {
namespace {

using test::messageOf;
using test::TemporaryFolder;
using ::testing::HasSubstr;

const RunInfo kInfo = {.program = "riftmap-test",
                       .command = "riftmap-test a.ini 'b c'",
                       .config = "[Run]\nseed = 4\n",
                       .seed = 4,
                       .threads = 2,
                       .inputs = {}};

TEST(RunDirectory, WritesManifestAndConfiguration) {
    const TemporaryFolder folder;
    RunInfo info = kInfo;
    info.inputs = {folder.write("in.rawlog", "abc")};
    const RunDirectory run(folder / "a/b", info, false);
    EXPECT_EQ(readFile(run.file("config_used.ini")), info.config);
    const std::string manifest = readFile(run.file("manifest.yaml"));
    for (const char* line : {"program: riftmap-test\n", "command: \"riftmap-test a.ini 'b c'\"\n",
                             "seed: 4\n", "threads: 2\n", "riftmap_version: \"0.",
                             "mrpt_version: \"", "opencv_version: \"4.", "input_1_sha256: "}) {
        EXPECT_THAT(manifest, HasSubstr(line));
    }
}

TEST(RunDirectory, NeverMixesWithAnOlderRun) {
    const TemporaryFolder folder;
    const auto dir = folder / "run";
    const RunDirectory first(dir, kInfo, false);
    writeAtomically(first.file("graph.ply"), [](std::ostream& out) { out << "old"; });
    EXPECT_THAT(messageOf<ConfigError>([&] { RunDirectory(dir, kInfo, false); }),
                HasSubstr("holds an older run"));
    EXPECT_TRUE(std::filesystem::exists(dir / "graph.ply"));
    const RunDirectory second(dir, kInfo, true);
    EXPECT_FALSE(std::filesystem::exists(dir / "graph.ply"));
    EXPECT_TRUE(std::filesystem::exists(dir / "manifest.yaml"));
}

TEST(RunDirectory, NeverEmptiesWhatIsNotARun) {
    const TemporaryFolder folder;
    const auto thesis = folder.write("thesis.tex", "years of work");
    EXPECT_THAT(messageOf<ConfigError>([&] { RunDirectory(folder.path(), kInfo, true); }),
                HasSubstr("not a run of Riftmap"));
    EXPECT_THAT(messageOf<ConfigError>([&] { RunDirectory(thesis, kInfo, true); }),
                HasSubstr("is a file"));
    EXPECT_EQ(readFile(thesis), "years of work");
}

TEST(RunDirectory, NeverEmptiesItsOwnInput) {
    const TemporaryFolder folder;
    const auto dir = folder / "run";
    const RunDirectory first(dir, kInfo, false);
    RunInfo info = kInfo;
    info.inputs = {dir / "run.rawlog"};
    writeAtomically(info.inputs[0], [](std::ostream& out) { out << "views"; });
    EXPECT_THAT(messageOf<ConfigError>([&] { RunDirectory(dir, info, true); }),
                HasSubstr("would empty"));
    EXPECT_EQ(readFile(info.inputs[0]), "views");
}

TEST(RunDirectory, ResumesOnlyARun) {
    const TemporaryFolder folder;
    EXPECT_THROW(RunDirectory::resume(folder.path()), ConfigError);
    const RunDirectory run(folder / "run", kInfo, false);
    const std::string manifest = readFile(run.file("manifest.yaml"));
    EXPECT_EQ(RunDirectory::resume(folder / "run").path(), folder / "run");
    EXPECT_EQ(readFile(run.file("manifest.yaml")), manifest);
}

TEST(RunDirectory, SummaryIsFlatYaml) {
    const TemporaryFolder folder;
    const RunDirectory run(folder / "run", kInfo, false);
    YamlMap summary;
    summary.set("views", 12);
    summary.set("stop_reason", "complete");
    summary.set("note", "a: \"b\" \\ c");
    summary.set("answer", "no");
    summary.set("empty", "");
    summary.set("area_m2", 0.25);
    summary.set("views", 13);
    run.writeSummary(summary);
    EXPECT_EQ(readFile(run.file("summary.yaml")),
              "views: 13\nstop_reason: complete\nnote: \"a: \\\"b\\\" \\\\ c\"\nanswer: \"no\"\n"
              "empty: \"\"\narea_m2: 0.25\n");
}

}  // namespace
}  // namespace riftmap
