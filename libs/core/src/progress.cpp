// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/core/progress.h"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <iostream>
#include <utility>

namespace riftmap {
namespace {

constexpr auto kRefresh = std::chrono::milliseconds(200);
constexpr std::size_t kStepsWithoutTotal = 100;  ///< a line for so many where no share is known

std::string threeDigits(double value) {
    char buffer[32];
    std::snprintf(buffer, sizeof(buffer), "%.3g", value);
    return buffer;
}

}  // namespace

std::string durationText(double seconds) {
    const auto s = static_cast<long>(std::ceil(seconds));
    if (s < 60) {
        return std::to_string(s) + " s";
    }
    if (s < 3600) {
        return std::to_string(s / 60) + " min " + std::to_string(s % 60) + " s";
    }
    return std::to_string(s / 3600) + " h " + std::to_string(s / 60 % 60) + " min";
}

Progress::Progress(std::string what, std::string unit, std::size_t total, bool enabled)
    : what_(std::move(what)),
      unit_(std::move(unit)),
      total_(total),
      out_(enabled ? &std::cerr : nullptr),
      isTerminal_(isatty(STDERR_FILENO) == 1) {}

Progress::Progress(std::string what, std::string unit, std::size_t total, std::ostream& out,
                   bool isTerminal)
    : what_(std::move(what)),
      unit_(std::move(unit)),
      total_(total),
      out_(&out),
      isTerminal_(isTerminal) {}

Progress::~Progress() {
    if (out_ != nullptr && isTerminal_ && printed_) {
        print(done_, true);
    }
}

void Progress::update(std::size_t done) {
    done_ = done;
    if (out_ == nullptr) {
        return;
    }
    if (isTerminal_) {
        const auto now = Clock::now();
        if (!printed_ || now - *printed_ >= kRefresh) {
            printed_ = now;
            print(done, false);
        }
        return;
    }
    const std::size_t tenth = total_ > 0 ? done * 10 / total_ : done / kStepsWithoutTotal;
    if (tenth > printedTenth_) {
        printedTenth_ = tenth;
        print(done, true);
    }
}

void Progress::print(std::size_t done, bool last) {
    const double elapsed = std::chrono::duration<double>(Clock::now() - start_).count();
    std::string text = line(done, elapsed);
    const std::size_t width = text.size();
    if (isTerminal_) {  // blanks over what a longer line left
        text = "\r" + text + std::string(width_ > width ? width_ - width : 0, ' ');
    }
    width_ = width;
    *out_ << text << (last ? "\n" : "") << std::flush;
}

std::string Progress::line(std::size_t done, double elapsedSeconds) const {
    std::string text = what_ + " " + std::to_string(done);
    if (total_ > 0) {
        const std::size_t percent = std::min<std::size_t>(100, done * 100 / total_);
        text += "/" + std::to_string(total_) + " " + unit_ + " (" + std::to_string(percent) + " %)";
    } else {
        text += " " + unit_;
    }
    if (done > 0 && elapsedSeconds > 0) {
        const double rate = static_cast<double>(done) / elapsedSeconds;
        text += ", " + threeDigits(rate) + " " + unit_ + "/s";
        if (total_ > done) {
            text += ", " + durationText(static_cast<double>(total_ - done) / rate) + " left";
        } else {
            text += ", took " + durationText(elapsedSeconds);
        }
    }
    return text;
}

}  // namespace riftmap
