// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/stereo/disparity_filters.h"

#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "filter_kernel.h"

namespace riftmap {

std::uint32_t IsolatedFilter::root(Runs& runs, std::uint32_t run) {
    while (runs[run].group != run) {
        runs[run].group = runs[runs[run].group].group;  // halves the way for the next one
        run = runs[run].group;
    }
    return run;
}

void IsolatedFilter::unite(Runs& runs, std::uint32_t a, std::uint32_t b) {
    a = root(runs, a);
    b = root(runs, b);
    if (a != b) {
        const auto [low, high] = std::minmax(a, b);
        runs[high].group = low;
        runs[low].size += runs[high].size;
    }
}

void IsolatedFilter::findRuns(const DisparityImage& image, int row, float maxDifference,
                              Strip& strip) {
    const auto width = static_cast<std::size_t>(image.width);
    strip.ends.resize(width + kernel::kEndsRoom + 1);
    const float* d = image.disparity.data() + image.index(0, row);
    std::size_t count = kernel::findEnds(d, width, maxDifference, strip.ends.data());
    strip.ends[count] = image.width;
    for (std::size_t i = 0; i < count; ++i) {
        const int first = strip.ends[i];
        if (d[first] < kNoDisparity) {
            const int last = strip.ends[i + 1];
            strip.runs.push_back({.row = row,
                                  .first = first,
                                  .last = last,
                                  .group = static_cast<std::uint32_t>(strip.runs.size()),
                                  .size = static_cast<std::uint32_t>(last - first)});
        }
    }
}

void IsolatedFilter::joinRows(const DisparityImage& image, std::size_t above, std::size_t here,
                              std::size_t end, float maxDifference, Runs& runs) {
    for (std::size_t a = above, b = here; a < here && b < end;) {
        const Run& upper = runs[a];
        const Run& lower = runs[b];
        const int last = std::min(upper.last, lower.last);
        for (int c = std::max(upper.first, lower.first); c < last; ++c) {
            if (std::abs(image.at(c, upper.row) - image.at(c, lower.row)) <= maxDifference) {
                unite(runs, static_cast<std::uint32_t>(a), static_cast<std::uint32_t>(b));
                break;
            }
        }
        if (upper.last < lower.last) {
            ++a;
        } else {
            ++b;
        }
    }
}

void IsolatedFilter::label(const DisparityImage& image, int first, int last, float maxDifference,
                           Strip& strip) {
    strip.runs.clear();
    std::size_t above = 0;
    for (int row = first; row < last; ++row) {
        const std::size_t here = strip.runs.size();
        findRuns(image, row, maxDifference, strip);
        joinRows(image, above, here, strip.runs.size(), maxDifference, strip.runs);
        above = here;
    }
}

void IsolatedFilter::joinStrips(const DisparityImage& image, float maxDifference) {
    runs_.swap(strips_.front().runs);  // the others follow it
    for (std::size_t i = 1; i < strips_.size(); ++i) {
        const Runs& strip = strips_[i].runs;
        const std::size_t here = runs_.size();
        for (Run run : strip) {
            run.group += static_cast<std::uint32_t>(here);
            runs_.push_back(run);
        }
        if (here == 0 || strip.empty() || runs_[here - 1].row + 1 != strip.front().row) {
            continue;
        }
        std::size_t above = here;
        while (above > 0 && runs_[above - 1].row == runs_[here - 1].row) {
            --above;
        }
        std::size_t end = here;
        while (end < runs_.size() && runs_[end].row == runs_[here].row) {
            ++end;
        }
        joinRows(image, above, here, end, maxDifference, runs_);
    }
}

void IsolatedFilter::apply(DisparityImage& image, int minSize, float maxDifference) {
    if (minSize <= 1 || image.height == 0) {
        return;
    }
    const int strips = std::clamp(tbb::this_task_arena::max_concurrency(), 1, image.height);
    strips_.resize(static_cast<std::size_t>(strips));
    tbb::parallel_for(0, strips, [&](int i) {
        label(image, i * image.height / strips, (i + 1) * image.height / strips, maxDifference,
              strips_[static_cast<std::size_t>(i)]);
    });
    joinStrips(image, maxDifference);
    for (Run& run : runs_) {
        run.group = runs_[run.group].group;  // an earlier run or itself: the root is there already
        if (runs_[run.group].size < static_cast<std::uint32_t>(minSize)) {
            float* d = image.disparity.data() + image.index(0, run.row);
            std::fill(d + run.first, d + run.last, kNoDisparity);
        }
    }
}

void discardSilhouettes(DisparityImage& image, int reach, int rows, float step,
                        std::vector<float>& scratch) {
    if (reach <= 0 || image.width == 0) {
        return;
    }
    const auto width = static_cast<std::size_t>(image.width);
    // Least disparity of the columns within reach, row by row; infinity never wins.
    scratch.resize(image.disparity.size());
    tbb::parallel_for(0, image.height, [&](int row) {
        kernel::leastAlong(image.disparity.data() + image.index(0, row), width,
                           static_cast<std::size_t>(reach), scratch.data() + image.index(0, row));
    });
    tbb::parallel_for(0, image.height, [&](int row) {
        const int first = std::max(0, row - rows);
        const int last = std::min(image.height - 1, row + rows);
        std::array<const float*, 2 * kMaxSilhouetteRows + 1> least{};
        std::size_t count = 0;
        for (int other = first; other <= last; ++other) {
            least.at(count++) = scratch.data() + image.index(0, other);
        }
        kernel::discardAbove(least.data(), count, width, step,
                             image.disparity.data() + image.index(0, row));
    });
}

void growSigmaWithSlope(DisparityImage& image, float slope) {
    if (slope <= 0) {
        return;
    }
    constexpr int kReach = static_cast<int>(kernel::kSlopeReach);
    tbb::parallel_for(0, image.height, [&](int row) {
        const auto rowOf = [&](int r) { return image.disparity.data() + image.index(0, r); };
        const float* d = rowOf(row);
        const float* up = row >= kReach ? rowOf(row - kReach) : d;
        const float* down = row + kReach < image.height ? rowOf(row + kReach) : d;
        kernel::growSigma(d, up, down, static_cast<std::size_t>(image.width), slope,
                          image.sigma.data() + image.index(0, row));
    });
}

}  // namespace riftmap
