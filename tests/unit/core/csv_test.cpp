// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/core/csv.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <limits>
#include <stdexcept>
#include <string>

#include "riftmap/core/file.h"
#include "temporary_folder.h"

namespace riftmap {
namespace {

using test::messageOf;
using test::TemporaryFolder;
using ::testing::HasSubstr;
using Row = std::vector<std::string>;

TEST(Csv, WritesNumbersAndTextTheSameWayEverywhere) {
    const TemporaryFolder folder;
    CsvWriter csv(folder / "a.csv", {"i", "x", "text"});
    csv.row({-3, 0.1, "plain"});
    csv.row({std::numeric_limits<std::uint64_t>::max(), 1.0 / 3, "a, \"b\"\nc"});
    csv.row({true, 1e-12F, std::string()});
    EXPECT_EQ(readFile(folder / "a.csv"),
              "i,x,text\n-3,0.1,plain\n18446744073709551615,0.333333333,\"a, \"\"b\"\" c\"\n"
              "true,1e-12,\n");
}

TEST(Csv, EveryRowIsOnDiskAtOnce) {
    const TemporaryFolder folder;
    CsvWriter csv(folder / "a.csv", {"i"});
    EXPECT_EQ(readFile(folder / "a.csv"), "i\n");
    csv.row({1});
    EXPECT_EQ(readFile(folder / "a.csv"), "i\n1\n");
}

TEST(Csv, ReadsBackWhatItWrote) {
    const TemporaryFolder folder;
    {
        CsvWriter csv(folder / "a.csv", {"name", "value"});
        csv.row({"with, comma", 1});
        csv.row({"with \"quotes\"", 2.5});
    }
    const CsvTable table = readCsv(folder / "a.csv");
    EXPECT_EQ(table.header, (Row{"name", "value"}));
    EXPECT_EQ(table.rows, (std::vector<Row>{{"with, comma", "1"}, {"with \"quotes\"", "2.5"}}));
    EXPECT_EQ(table.column("value"), 1U);
    EXPECT_THAT(messageOf<std::out_of_range>([&] { table.column("valu"); }),
                HasSubstr("no column 'valu' in name,value"));
}

TEST(Csv, AppendsUnderTheSameHeaderOnly) {
    const TemporaryFolder folder;
    const auto file = folder / "a.csv";
    for (int i = 0; i < 2; ++i) {
        CsvWriter csv(file, {"i"}, CsvWriter::Mode::kAppend);
        csv.row({i});
    }
    EXPECT_EQ(readFile(file), "i\n0\n1\n");
    EXPECT_THAT(messageOf<FileError>([&] { CsvWriter(file, {"j"}, CsvWriter::Mode::kAppend); }),
                HasSubstr("another header"));
    { CsvWriter csv(file, {"j"}); }
    EXPECT_EQ(readFile(file), "j\n");
}

TEST(Csv, BrokenFilesAndRowsAreNamed) {
    const TemporaryFolder folder;
    const auto message = [&](const std::string& bytes) {
        const auto file = folder.write("x.csv", bytes);
        return messageOf<FileError>([&] { readCsv(file); });
    };
    EXPECT_THAT(message(""), HasSubstr("x.csv: has no header"));
    EXPECT_THAT(message("a,b\n1,2\n1\n"), HasSubstr("x.csv:3: 1 fields under a header of 2"));
    EXPECT_THAT(message("a,b\n\"1,2\n"), HasSubstr("x.csv:2: a quote stays open"));
    EXPECT_THAT(messageOf<FileError>([&] { CsvWriter(folder / "no/such/a.csv", {"i"}); }),
                HasSubstr("cannot be written"));
    CsvWriter csv(folder / "a.csv", {"i", "j"});
    EXPECT_THROW(csv.row({1}), std::invalid_argument);
}

}  // namespace
}  // namespace riftmap
