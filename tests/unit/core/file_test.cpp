// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/core/file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <ostream>
#include <stdexcept>
#include <string>
#include <vector>

#include "temporary_folder.h"

namespace riftmap {
namespace {

using test::messageOf;
using test::TemporaryFolder;
using ::testing::HasSubstr;

TEST(File, WrittenWholeOrNotAtAll) {
    const TemporaryFolder folder;
    const auto file = folder.write("a.txt", "old");
    EXPECT_THROW(writeAtomically(file,
                                 [](std::ostream& out) {
                                     out << "half";
                                     throw std::runtime_error("stop");
                                 }),
                 std::runtime_error);
    EXPECT_EQ(readFile(file), "old");
    writeAtomically(file, [&](std::ostream& out) {
        out << "new" << std::flush;
        EXPECT_EQ(readFile(file), "old");
    });
    EXPECT_EQ(readFile(file), "new");
    const auto entries = std::distance(std::filesystem::directory_iterator(folder.path()), {});
    EXPECT_EQ(entries, 1) << "something was left beside the file";
}

TEST(File, WriteErrorsAreNotSwallowed) {
    const TemporaryFolder folder;
    EXPECT_THAT(messageOf<FileError>([&] {
                    writeAtomically(folder / "no/a.txt", [](std::ostream& out) { out << 1; });
                }),
                HasSubstr("no/a.txt: cannot be written: No such file or directory"));
    EXPECT_THAT(messageOf<FileError>([&] {
                    writeAtomically(folder / "a.txt",
                                    [](std::ostream& out) { out.setstate(std::ios::badbit); });
                }),
                HasSubstr("a.txt: cannot be written"));
    EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

TEST(File, TheTemporaryKeepsTheExtension) {
    const TemporaryFolder folder;
    writeBesideAndRename(folder / "a.png", [&](const std::filesystem::path& p) {
        EXPECT_EQ(p.extension(), ".png");
        EXPECT_EQ(p.parent_path(), folder.path());
        std::ofstream(p) << "x";
    });
    EXPECT_EQ(readFile(folder / "a.png"), "x");
    EXPECT_THAT(messageOf<FileError>([&] {
                    writeBesideAndRename(folder / "b.png", [](const std::filesystem::path&) {});
                }),
                HasSubstr("b.png: cannot be written"));
}

TEST(File, ReadingNamesTheTrouble) {
    const TemporaryFolder folder;
    EXPECT_THAT(messageOf<FileError>([&] { readFile(folder / "a"); }),
                HasSubstr("a: no such file"));
    EXPECT_THAT(messageOf<FileError>([&] { sha256OfFile(folder.path()); }),
                HasSubstr("is a directory"));
}

// From FIPS 180-2, appendix B.
TEST(File, Sha256OfTheStandardsExamples) {
    const TemporaryFolder folder;
    EXPECT_EQ(sha256("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
    EXPECT_EQ(sha256OfFile(folder.write("m", std::string(1000000, 'a'))),
              "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0");
}

TEST(File, PeakMemoryGrowsWithUse) {
    const double before = peakRssMb();
    EXPECT_GT(before, 1);
    std::vector<char> much(200'000'000, 1);
    EXPECT_EQ(much[much.size() / 2], 1);
    EXPECT_GT(peakRssMb(), 199);
}

}  // namespace
}  // namespace riftmap
