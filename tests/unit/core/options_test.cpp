// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/core/options.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

namespace riftmap {
namespace {

using ::testing::HasSubstr;

struct Sample {
    enum class Colour { kRed, kGreen };
    double length = 0.5;
    int count = 3;
    bool on = true;
    double angle = 0.5235987755982988;  // 30 degrees
    std::vector<double> origin = {1, 2, 3};
    Colour colour = Colour::kGreen;

    void describe(OptionTable& table) {
        table.section("Sample", "Options of the test.");
        table.add("length", length, 0.0, 10.0, "m", "A length.");
        table.add("count", count, 1, 9, "", "A count.");
        table.add("on", on, "A switch.");
        table.addDegrees("angle_deg", angle, -90, 90, "An angle.");
        table.add("origin", origin, 3, "m", "A point.");
        table.addChoice<Colour>("colour", colour,
                                {{"red", Colour::kRed}, {"green", Colour::kGreen}}, "A colour.");
    }
};

std::string write(const std::string& content) {
    const auto* info = ::testing::UnitTest::GetInstance()->current_test_info();
    const auto file = std::filesystem::temp_directory_path() /
                      (std::string("riftmap_options_") + info->name() + ".ini");
    std::ofstream(file) << content;
    return file.string();
}

std::string errorOf(const std::string& content) {
    Sample sample;
    OptionTable table;
    sample.describe(table);
    try {
        table.load(write(content));
    } catch (const ConfigError& e) {
        return e.what();
    }
    return {};
}

TEST(Options, ChoicesAreFoundInAnyCase) {
    int level = 0;
    OptionTable table;
    table.section("Noise", "A test.");
    table.addChoice<int>("level", level, {{"N0", 0}, {"N3", 3}}, "A level.");
    table.set("Noise.level=N3");
    EXPECT_EQ(level, 3);
    table.set("Noise.level=n0");
    EXPECT_EQ(level, 0);
    EXPECT_THAT(table.dump(), HasSubstr("N0"));
}

TEST(Options, LoadsEveryKind) {
    Sample sample;
    OptionTable table;
    sample.describe(table);
    table.load(
        write("# a\n; b=1\n// c\n// count=8\n[Sample]\n// count=8\n#count=9\nlength=2.5 // "
              "metres\ncount=7\non=false\nangle_deg=45\n"
              "origin=4 5 -6\ncolour=red\n"));
    EXPECT_EQ(sample.length, 2.5);
    EXPECT_EQ(sample.count, 7);
    EXPECT_FALSE(sample.on);
    EXPECT_DOUBLE_EQ(sample.angle, 0.7853981633974483);
    EXPECT_EQ(sample.origin, (std::vector<double>{4, 5, -6}));
    EXPECT_EQ(sample.colour, Sample::Colour::kRed);
}

TEST(Options, DumpLoadsAgain) {
    Sample a;
    OptionTable ta;
    a.describe(ta);
    ta.set("Sample.length=0.1");
    ta.set("Sample.angle_deg=12.5");
    ta.set("sample.COLOUR=red");
    Sample b;
    OptionTable tb;
    b.describe(tb);
    tb.load(write(ta.dump()));
    EXPECT_EQ(tb.dump(), ta.dump());
    EXPECT_EQ(b.length, 0.1);
}

TEST(Options, NamesWhatIsWrong) {
    EXPECT_THAT(errorOf("[Sample]\n\nlenght=2\n"),
                AllOf(HasSubstr(":3: "), HasSubstr("lenght"), HasSubstr("did you mean 'length'")));
    EXPECT_THAT(errorOf("[Sampel]\nlength=2\n"), HasSubstr("did you mean [Sample]"));
    EXPECT_THAT(errorOf("[Sample]\nlength=abc\n"), HasSubstr("not a number"));
    EXPECT_THAT(errorOf("[Sample]\nlength=1,5\n"), HasSubstr("not a number"));
    EXPECT_THAT(errorOf("[Sample]\nlength=nan\n"), HasSubstr("finite"));
    EXPECT_THAT(errorOf("[Sample]\ncount=10\n"),
                AllOf(HasSubstr("out of range"), HasSubstr("1 .. 9")));
    EXPECT_THAT(errorOf("[Sample]\non=on\n"), HasSubstr("false | true"));
    EXPECT_THAT(errorOf("[Sample]\norigin=1 2\n"), HasSubstr("3 numbers"));
    EXPECT_THAT(errorOf("[Sample]\ncolour=blue\n"), HasSubstr("red | green"));
    EXPECT_EQ(errorOf("[Sample]\nlength=1\n"), "");
}

TEST(Options, SetNeedsSectionAndKey) {
    Sample sample;
    OptionTable table;
    sample.describe(table);
    EXPECT_THROW(table.set("length=2"), ConfigError);
    EXPECT_THROW(table.set("Sample.length"), ConfigError);
    EXPECT_THROW(table.load("/nonexistent/x.ini"), ConfigError);
}

}  // namespace
}  // namespace riftmap
