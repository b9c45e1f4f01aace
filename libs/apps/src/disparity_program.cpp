// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/apps/disparity_program.h"

#include <algorithm>
#include <charconv>
#include <chrono>
#include <filesystem>
#include <iostream>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <stdexcept>
#include <string>
#include <vector>

#include "riftmap/apps/pictures.h"
#include "riftmap/core/pfm.h"
#include "riftmap/stereo/stereo_matcher.h"

namespace riftmap {
namespace {

cv::Mat readImage(const std::string& file) {
    if (!std::filesystem::is_regular_file(file)) {
        throw std::runtime_error(file + ": no such file");
    }
    cv::Mat image = cv::imread(file, cv::IMREAD_UNCHANGED);
    if (image.empty()) {
        throw std::runtime_error(file + ": not an image that can be read");
    }
    return image;
}

int parseRepeats(const std::string& text) {
    int n = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), n);
    if (error != std::errc() || end != text.data() + text.size() || n < 1 || n > 10000) {
        throw ConfigError("--time '" + text + "': allowed: 1 .. 10000");
    }
    return n;
}

double medianMilliseconds(StereoMatcher& matcher, const cv::Mat& left, const cv::Mat& right,
                          int repeats, DisparityImage& out) {
    std::vector<double> times;
    for (int i = 0; i < repeats; ++i) {
        const auto start = std::chrono::steady_clock::now();
        matcher.compute(left, right, out);
        const std::chrono::duration<double, std::milli> ms =
            std::chrono::steady_clock::now() - start;
        times.push_back(ms.count());
    }
    std::nth_element(times.begin(), times.begin() + repeats / 2, times.end());
    return times[static_cast<std::size_t>(repeats / 2)];
}

}  // namespace

DisparityProgram::DisparityProgram()
    : Program("riftmap-disparity", "matches a rectified stereo pair", Config::kOptional) {}

void DisparityProgram::describe(OptionTable& table) {
    stereo_.describe(table);
}

void DisparityProgram::arguments(CommandLine& line) {
    line.positional("LEFT", "left image, rectified; 8 or 16 bit, grey or colour");
    line.positional("RIGHT", "right image of the same size");
    line.value("matcher", 0, "NAME", matcher_, "short for --set Stereo.matcher=NAME");
    line.value("time", 0, "N", repeat_, "match N times and print the median time");
}

void DisparityProgram::run() {
    const std::filesystem::path pfm = requiredOut();
    if (pfm.extension() != ".pfm") {
        throw ConfigError("--out " + pfm.string() + ": allowed: a name that ends in .pfm");
    }
    const std::filesystem::path png = std::filesystem::path(pfm).replace_extension(".png");
    checkMayWrite(pfm);
    checkMayWrite(png);
    if (!matcher_.empty()) {
        OptionTable table;
        stereo_.describe(table);
        table.set("Stereo.matcher=" + matcher_);
    }
    const int repeats = repeat_.empty() ? 1 : parseRepeats(repeat_);
    const auto matcher = makeStereoMatcher(stereo_);
    if (!matcher) {
        throw ConfigError(
            "[Stereo] matcher = given; allowed here: paper | opencv_bm | opencv_sgbm");
    }
    const cv::Mat left = readImage(argument(0));
    const cv::Mat right = readImage(argument(1));
    DisparityImage disparity;
    double ms = 0;
    try {
        ms = medianMilliseconds(*matcher, left, right, repeats, disparity);
    } catch (const std::invalid_argument& e) {
        throw std::runtime_error(argument(0) + ", " + argument(1) + ": " + e.what());
    }
    writePfm(pfm, {disparity.width, disparity.height, disparity.disparity});
    writePicture(png, disparityPicture(disparity));
    const auto matched = std::count_if(disparity.disparity.begin(), disparity.disparity.end(),
                                       [](float d) { return d != kNoDisparity; });
    std::cout << "size: " << disparity.width << " x " << disparity.height << "\nmatched: "
              << 100.0 * static_cast<double>(matched) /
                     static_cast<double>(disparity.disparity.size())
              << " %\n";
    if (!repeat_.empty()) {
        std::cout << "time: " << ms << " ms (median of " << repeats << ", " << threads()
                  << " threads)\n";
    }
}

}  // namespace riftmap
