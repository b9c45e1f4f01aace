// SPDX-License-Identifier: BSD-3-Clause
// Times PaperMatcher against OpenCV's matchers by turns in one process, and scores all of them
// against true disparity. Prints tables; --csv FILE writes `figure,value,unit`.
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <iostream>
#include <iterator>
#include <map>
#include <memory>
#include <opencv2/calib3d.hpp>
#include <opencv2/core/utility.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <stdexcept>
#include <string>
#include <vector>

#include "middlebury.h"
#include "riftmap/core/csv.h"
#include "riftmap/stereo/facet_filter.h"
#include "riftmap/stereo/opencv_matchers.h"
#include "riftmap/stereo/paper_matcher.h"

namespace riftmap::bench {
namespace {

/// A matcher by the name it has in the tables.
struct Contender {
    std::string name;
    std::function<std::unique_ptr<StereoMatcher>(int numDisparities)> make;
};

/// What goes with the semi-global pass: it smooths, so a smaller window does.
void setSemiGlobal(StereoOptions& o) {
    o.semiGlobal = true;
    o.prefilter = Prefilter::kGradient;
    o.prefilterGain = 1;
    o.prefilterCap = 31;
    o.truncation = 62;
    o.window = 7;
    o.sigmaFloor = 0.13;
    o.anchorReach = 48;
    o.leftRightTolerance = 1;
    o.isolatedSize = 200;
}

/// The settings of the table: those of the library, but for what is said here. OpenCV's matchers
/// get a uniqueness of 10 % (the middle of the 5 .. 15 that its documentation advises; the
/// `_5` and `_15` variants show both ends) and the same filter of isolated groups. `settings`
/// ("Stereo.key=value") change ours.
std::vector<Contender> contenders(const std::vector<std::string>& settings) {
    const auto paper = [&settings](auto&& change) {
        return [change, settings](int n) -> std::unique_ptr<StereoMatcher> {
            StereoOptions o;
            o.numDisparities = n;
            change(o);
            OptionTable table;
            o.describe(table);
            for (const std::string& setting : settings) {
                table.set(setting);
            }
            return makeStereoMatcher(o);
        };
    };
    const auto openCv = [](int n, int uniqueness) {
        StereoOptions o;
        o.numDisparities = n;
        o.uniqueness = uniqueness;
        o.leftRightTolerance = 1;
        return o;
    };
    const auto block = [openCv](int uniqueness) {
        return [=](int n) -> std::unique_ptr<StereoMatcher> {
            return std::make_unique<OpenCvBlockMatcher>(openCv(n, uniqueness));
        };
    };
    const auto sgbm = [openCv](int uniqueness, bool full) {
        return [=](int n) -> std::unique_ptr<StereoMatcher> {
            return std::make_unique<OpenCvSgbmMatcher>(openCv(n, uniqueness), full);
        };
    };
    return {{"paper", paper([](StereoOptions&) {})},
            {"paper_refined", paper([](StereoOptions& o) { o.refine = 2; })},
            {"paper_semi_global", paper(setSemiGlobal)},
            {"paper_dense", paper([](StereoOptions& o) {
                 setSemiGlobal(o);
                 o.penaltySmall = 4;
                 o.penaltyLarge = 30;
                 o.anchorReach = 1000;
                 o.silhouetteReach = 0;
                 o.uniqueness = 0;
                 o.isolatedSize = 50;
                 o.leftRightTolerance = 2;
             })},
            {"paper_one_window", paper([](StereoOptions& o) {
                 o.supportingWindows = false;
                 o.silhouetteReach = 0;
             })},
            {"opencv_bm", block(10)},
            {"opencv_bm_5", block(5)},
            {"opencv_bm_15", block(15)},
            {"opencv_sgbm", sgbm(10, false)},
            {"opencv_sgbm_full", sgbm(10, true)}};
}

class Figures {
 public:
    explicit Figures(const std::string& file) {
        if (!file.empty()) {
            csv_ = std::make_unique<CsvWriter>(file,
                                               std::vector<std::string>{"figure", "value", "unit"});
        }
    }
    void add(const std::string& figure, double value, const char* unit) {
        if (csv_) {
            csv_->row({figure, value, unit});
        }
    }

 private:
    std::unique_ptr<CsvWriter> csv_;
};

double median(std::vector<double> values) {
    std::nth_element(values.begin(),
                     values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2), values.end());
    return values[values.size() / 2];
}

/// 512 x 384: the middle of the Motorcycle pair. Times depend on what is seen, so nothing else
/// stands in for it: throws where it is absent.
std::pair<cv::Mat, cv::Mat> timedPair(const std::string& folder) {
    const cv::Size size(512, 384);
    const auto pair = loadPair(folder, "motorcycle");
    if (!pair) {
        throw std::runtime_error(folder +
                                 ": no Motorcycle pair to time with; tests/benchmarks/matcher/"
                                 "fetch_pairs FOLDER takes it out of Debian's packages, then "
                                 "--data FOLDER");
    }
    const cv::Rect middle((pair->left.cols - size.width) / 2, (pair->left.rows - size.height) / 2,
                          size.width, size.height);
    cv::Mat left, right;
    cv::cvtColor(pair->left(middle), left, cv::COLOR_BGR2GRAY);
    cv::cvtColor(pair->right(middle), right, cv::COLOR_BGR2GRAY);
    return {left, right};
}

/// Integer arithmetic in the first-level cache, in eight parts that share nothing: how much a
/// second thread can give on this machine.
void computeOnly() {
    tbb::parallel_for(0, 8, [](int part) {
        std::array<std::uint16_t, 4096> values{};
        for (int round = 0; round < 3000; ++round) {
            for (auto& v : values) {
                v = static_cast<std::uint16_t>(std::min((v >> 1) + part, 60000) + round);
            }
        }
        volatile std::uint16_t sink = values[static_cast<std::size_t>(part)];
        static_cast<void>(sink);
    });
}

/// What is timed, and how long each of its turns took.
struct Turn {
    std::string name;
    std::function<void()> work;
    std::vector<double> ms;  ///< a frame
};

/// Median over the rounds of the one's time over the other's: a busy moment of the machine meets
/// both turns of a round and divides out.
double medianRatio(const Turn& a, const Turn& b) {
    std::vector<double> ratios(a.ms.size());
    std::transform(a.ms.begin(), a.ms.end(), b.ms.begin(), ratios.begin(), std::divides<>());
    return median(ratios);
}

/// Times by turns in one process. A turn is several frames one after another, as they come from a
/// camera; what is compared with one another stands side by side.
void timeAll(const std::string& folder, int rounds, Figures& figures) {
    constexpr int kFrames = 8;
    const auto [left, right] = timedPair(folder);
    cv::setNumThreads(1);
    StereoOptions options;  // window 11, 64 disparities, all stages on
    PaperMatcher paper(options);
    StereoOptions semiGlobalOptions;
    setSemiGlobal(semiGlobalOptions);
    PaperMatcher semiGlobal(semiGlobalOptions);
    StereoOptions refinedOptions;
    refinedOptions.refine = 2;
    const auto refined = makeStereoMatcher(refinedOptions);
    DisparityImage given;  // with noise of its own at each pixel
    paper.compute(left, right, given);
    cv::RNG random(1);
    for (std::size_t i = 0; i < given.disparity.size(); ++i) {
        given.disparity[i] += static_cast<float>(random.gaussian(0.25));
        given.sigma[i] = 0.25F;
    }
    FacetFilter facets;
    const auto bm = cv::StereoBM::create(options.numDisparities, options.window);
    bm->setDisp12MaxDiff(1);
    const auto sgbm = cv::StereoSGBM::create(0, options.numDisparities, 5, 200, 800, 1, 63, 10, 0,
                                             0, cv::StereoSGBM::MODE_SGBM_3WAY);
    DisparityImage disparity;
    cv::Mat raw;
    tbb::task_arena one(1), two(2);
    const auto in = [&](tbb::task_arena& arena, StereoMatcher& matcher) {
        return [&] { arena.execute([&] { matcher.compute(left, right, disparity); }); };
    };
    enum { kBm, kPaper, kPaper2, kSemiGlobal, kRefined, kFacets, kSgbm, kCompute, kCompute2 };
    std::array<Turn, 9> turns;
    turns[kBm] = {"cv::StereoBM, 1 thread", [&] { bm->compute(left, right, raw); }, {}};
    turns[kPaper] = {"paper, 1 thread", in(one, paper), {}};
    turns[kPaper2] = {"paper, 2 threads", in(two, paper), {}};
    turns[kSemiGlobal] = {"paper semi-global, 1 thread", in(one, semiGlobal), {}};
    turns[kRefined] = {"paper refined, 1 thread", in(one, *refined), {}};
    turns[kFacets] = {"facet filter, 1 thread",
                      [&] {
                          one.execute([&] {
                              disparity = given;
                              facets.apply(disparity, options.facetRadius);
                          });
                      },
                      {}};
    turns[kSgbm] = {"cv::StereoSGBM 3-way, 1 thread", [&] { sgbm->compute(left, right, raw); }, {}};
    turns[kCompute] = {"compute only, 1 thread", [&] { one.execute(computeOnly); }, {}};
    turns[kCompute2] = {"compute only, 2 threads", [&] { two.execute(computeOnly); }, {}};
    for (int round = -1; round < rounds; ++round) {  // one round to warm up
        for (auto& turn : turns) {
            const auto start = std::chrono::steady_clock::now();
            for (int frame = 0; frame < kFrames; ++frame) {
                turn.work();
            }
            const std::chrono::duration<double, std::milli> ms =
                std::chrono::steady_clock::now() - start;
            if (round >= 0) {
                turn.ms.push_back(ms.count() / kFrames);
            }
        }
    }
    std::printf("%d x %d, 64 disparities, window 11, medians of %d rounds of %d frames a turn\n",
                left.cols, left.rows, rounds, kFrames);
    for (const auto& turn : turns) {
        std::printf("  %-36s %7.2f ms\n", turn.name.c_str(), median(turn.ms));
    }
    const auto ratio = [&](const char* figure, int a, int b) {
        const double value = medianRatio(turns.at(static_cast<std::size_t>(a)),
                                         turns.at(static_cast<std::size_t>(b)));
        std::printf("  %-36s %7.3f\n", figure, value);
        figures.add(figure, value, "");
    };
    ratio("time_ratio_bm_1thread", kPaper, kBm);
    ratio("time_ratio_sgbm_1thread", kPaper, kSgbm);
    ratio("speedup_2threads", kPaper, kPaper2);
    ratio("machine_speedup_2threads", kCompute, kCompute2);
    ratio("semi_global_time_ratio_bm_1thread", kSemiGlobal, kBm);
    ratio("semi_global_time_ratio_sgbm_1thread", kSemiGlobal, kSgbm);
    ratio("refined_time_ratio_bm_1thread", kRefined, kBm);
    ratio("refined_time_ratio_sgbm_1thread", kRefined, kSgbm);
    ratio("facets_time_ratio_bm_1thread", kFacets, kBm);
    figures.add("paper_1thread", median(turns[kPaper].ms), "ms");
    figures.add("paper_2threads", median(turns[kPaper2].ms), "ms");
    figures.add("opencv_bm_1thread", median(turns[kBm].ms), "ms");
    figures.add("opencv_sgbm_1thread", median(turns[kSgbm].ms), "ms");
}

void writeScore(const std::string& prefix, const Score& s, Figures& figures) {
    figures.add(prefix + ".matched", s.matched, "%");
    figures.add(prefix + ".bad1", s.bad1, "%");
    figures.add(prefix + ".bad2", s.bad2, "%");
    figures.add(prefix + ".mean_error", s.meanError, "px");
    figures.add(prefix + ".matched_steps", s.matchedSteps, "%");
    figures.add(prefix + ".bad1_steps", s.bad1Steps, "%");
    figures.add(prefix + ".bad2_steps", s.bad2Steps, "%");
    figures.add(prefix + ".mean_error_steps", s.meanErrorSteps, "px");
    figures.add(prefix + ".matched_occluded", s.occluded, "%");
    figures.add(prefix + ".residual", s.residual, "");
}

void saveDisparity(const std::string& file, const DisparityImage& disparity, int range) {
    cv::Mat picture(disparity.height, disparity.width, CV_8UC1);
    for (int r = 0; r < picture.rows; ++r) {
        for (int c = 0; c < picture.cols; ++c) {
            const float level = disparity.at(c, r) * 255.0F / static_cast<float>(range);
            picture.at<std::uint8_t>(r, c) =
                cv::saturate_cast<std::uint8_t>(disparity.valid(c, r) ? level : 0.0F);
        }
    }
    cv::Mat colour;
    cv::applyColorMap(picture, colour, cv::COLORMAP_TURBO);
    for (int r = 0; r < picture.rows; ++r) {
        for (int c = 0; c < picture.cols; ++c) {
            if (!disparity.valid(c, r)) {
                colour.at<cv::Vec3b>(r, c) = {255, 255, 255};
            }
        }
    }
    if (!cv::imwrite(file, colour)) {
        throw std::runtime_error(file + ": cannot be written");
    }
}

/// Share of the pixels nearer than a range cut to `numDisparities` that are matched all the same.
double invented(const Pair& pair, const Contender& contender, int numDisparities) {
    DisparityImage found;
    contender.make(numDisparities)->compute(pair.left, pair.right, found);
    double tooNear = 0, matched = 0;
    for (int r = 0; r < found.height; ++r) {
        for (int c = found.firstColumn; c < found.width; ++c) {
            const float truth = pair.truth.at<float>(r, c);
            if (std::isfinite(truth) && truth > static_cast<float>(numDisparities + 1)) {
                ++tooNear;
                matched += found.valid(c, r) ? 1 : 0;
            }
        }
    }
    return tooNear > 0 ? 100 * matched / tooNear : 0;
}

void scoreAll(const std::string& folder, const std::string& pictures, const std::string& only,
              const std::vector<std::string>& settings, Figures& figures) {
    cv::setNumThreads(-1);
    bool any = false;
    for (const char* name : {"motorcycle", "aloe", "cones", "tsukuba"}) {
        const auto pair = loadPair(folder, name);
        if (!pair) {
            std::printf("%s: SKIPPED, not in %s\n", name, folder.c_str());
            continue;
        }
        any = true;
        std::printf("\n%-10s %-18s %7s %6s %6s %6s | %7s %6s %6s | %8s %8s %8s\n", name,
                    "(percent)", "matched", "bad1", "bad2", "mean", "matched", "bad1", "bad2",
                    "occluded", "residual", "too near");
        for (const auto& contender : contenders(settings)) {
            if (!only.empty() && contender.name != only) {
                continue;
            }
            DisparityImage found;
            contender.make(pair->numDisparities)->compute(pair->left, pair->right, found);
            const Score s = score(*pair, found);
            const double nearer = invented(*pair, contender, pair->numDisparities / 2);
            std::printf(
                "%-10s %-18s %7.2f %6.2f %6.2f %6.3f | %7.2f %6.2f %6.2f | %8.1f %8.2f %8.2f\n", "",
                contender.name.c_str(), s.matched, s.bad1, s.bad2, s.meanError, s.matchedSteps,
                s.bad1Steps, s.bad2Steps, s.occluded, s.residual, nearer);
            const std::string prefix = std::string(name) + "." + contender.name;
            writeScore(prefix, s, figures);
            figures.add(prefix + ".invented_too_near", nearer, "%");
            if (!pictures.empty()) {
                saveDisparity(pictures + "/" + prefix + ".png", found, pair->numDisparities);
            }
        }
    }
    if (!any) {
        throw std::runtime_error(folder + ": none of the pairs is there");
    }
}

std::string defaultData() {
    const char* data = std::getenv("RIFTMAP_DATA");
    return (data != nullptr ? std::string(data) : RIFTMAP_SOURCE_DIR "/../shared/data") +
           "/middlebury";
}

struct Arguments {
    std::string csv, pictures, only;
    std::string part = "all";
    std::string data = defaultData();
    int rounds = 21;
    std::vector<std::string> settings;
};

constexpr const char* kUsage =
    "bench-matcher [--csv FILE] [--data MIDDLEBURY_FOLDER] [--pictures FOLDER] [--rounds N] "
    "[--part all|times|scores] [--only MATCHER] [--set Stereo.key=value]... (for the scores of "
    "ours)";

int parseRounds(const std::string& text) {
    int n = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), n);
    if (error != std::errc() || end != text.data() + text.size() || n < 1 || n > 10000) {
        throw ConfigError("--rounds " + text + ": allowed: 1 .. 10000");
    }
    return n;
}

/// Throws ConfigError where `value` is none of `allowed`.
void checkOneOf(const std::string& flag, const std::string& value,
                const std::vector<std::string>& allowed) {
    if (std::find(allowed.begin(), allowed.end(), value) == allowed.end()) {
        std::string message = flag + " " + value + ": allowed:";
        for (const auto& name : allowed) {
            message += " " + name;
        }
        throw ConfigError(message);
    }
}

/// Throws ConfigError for what it does not know.
Arguments parse(const std::vector<std::string>& words) {
    Arguments a;
    const std::map<std::string, std::string*> texts = {{"--csv", &a.csv},
                                                       {"--data", &a.data},
                                                       {"--pictures", &a.pictures},
                                                       {"--part", &a.part},
                                                       {"--only", &a.only}};
    for (std::size_t i = 0; i < words.size(); i += 2) {
        const auto text = texts.find(words[i]);
        const bool other = words[i] == "--rounds" || words[i] == "--set";
        if (text == texts.end() && !other) {
            throw ConfigError(words[i] + ": no such option; " + kUsage);
        }
        if (i + 1 == words.size()) {
            throw ConfigError(words[i] + ": needs a value; " + kUsage);
        }
        if (text != texts.end()) {
            *text->second = words[i + 1];
        } else if (words[i] == "--rounds") {
            a.rounds = parseRounds(words[i + 1]);
        } else {
            a.settings.push_back(words[i + 1]);
        }
    }
    checkOneOf("--part", a.part, {"all", "times", "scores"});
    const auto all = contenders(a.settings);
    all.front().make(64);  // the settings are right
    if (!a.only.empty()) {
        std::vector<std::string> names;
        std::transform(all.begin(), all.end(), std::back_inserter(names),
                       [](const Contender& c) { return c.name; });
        checkOneOf("--only", a.only, names);
    }
    return a;
}

void run(const Arguments& a) {
    Figures figures(a.csv);
    if (a.part != "scores") {
        timeAll(a.data, a.rounds, figures);
    }
    if (a.part != "times") {
        scoreAll(a.data, a.pictures, a.only, a.settings, figures);
    }
}

}  // namespace
}  // namespace riftmap::bench

int main(int argc, char** argv) {
    try {
        riftmap::bench::run(riftmap::bench::parse({argv + 1, argv + argc}));
        return 0;
    } catch (const riftmap::ConfigError& e) {
        std::cerr << "bench-matcher: " << e.what() << "\n";
        return 2;
    } catch (const std::exception& e) {
        std::cerr << "bench-matcher: " << e.what() << "\n";
        return 1;
    }
}
