// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/stereo/disparity_filters.h"

#include <tbb/task_arena.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "filter_kernel.h"
#include "riftmap/core/parallel.h"

namespace riftmap {

/// Reads only: strips look for the roots of their runs at the same time.
std::uint32_t IsolatedFilter::root(std::size_t run) const {
    std::uint32_t at = runs_[run].group;
    while (runs_[at].group != at) {
        at = runs_[at].group;
    }
    return at;
}

std::uint32_t IsolatedFilter::halveWay(std::uint32_t run) {
    while (runs_[run].group != run) {
        runs_[run].group = runs_[runs_[run].group].group;  // halves the way for the next one
        run = runs_[run].group;
    }
    return run;
}

void IsolatedFilter::unite(std::uint32_t a, std::uint32_t b) {
    a = halveWay(a);
    b = halveWay(b);
    if (a != b) {
        const auto [low, high] = std::minmax(a, b);
        runs_[high].group = low;
        runs_[low].size += runs_[high].size;
    }
}

void IsolatedFilter::findRuns(const DisparityImage& image, int row, float maxDifference,
                              Strip& strip) {
    const auto width = static_cast<std::size_t>(image.width);
    const float* d = image.disparity.data() + image.index(0, row);
    std::size_t count = kernel::findEnds(d, width, maxDifference, strip.ends.data());
    strip.ends[count] = image.width;
    for (std::size_t i = 0; i < count; ++i) {
        const int first = strip.ends[i];
        if (d[first] < kNoDisparity) {
            const int last = strip.ends[i + 1];
            runs_[strip.end] = {.row = row,
                                .first = first,
                                .last = last,
                                .group = static_cast<std::uint32_t>(strip.end),
                                .size = static_cast<std::uint32_t>(last - first)};
            ++strip.end;
        }
    }
}

void IsolatedFilter::joinRows(const DisparityImage& image, std::size_t above, std::size_t aboveEnd,
                              std::size_t here, std::size_t end, float maxDifference) {
    for (std::size_t a = above, b = here; a < aboveEnd && b < end;) {
        const Run& upper = runs_[a];
        const Run& lower = runs_[b];
        const int last = std::min(upper.last, lower.last);
        for (int c = std::max(upper.first, lower.first); c < last; ++c) {
            if (std::abs(image.at(c, upper.row) - image.at(c, lower.row)) <= maxDifference) {
                unite(static_cast<std::uint32_t>(a), static_cast<std::uint32_t>(b));
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
    strip.ends.resize(static_cast<std::size_t>(image.width) + kernel::kEndsRoom + 1);
    strip.begin = strip.end = strip.lastRow = image.index(0, first);
    for (int row = first; row < last; ++row) {
        const std::size_t above = strip.lastRow;
        strip.lastRow = strip.end;
        findRuns(image, row, maxDifference, strip);
        joinRows(image, above, strip.lastRow, strip.lastRow, strip.end, maxDifference);
        if (row == first) {
            strip.secondRow = strip.end;
        }
    }
    for (std::size_t i = strip.begin; i < strip.end; ++i) {
        runs_[i].group = runs_[runs_[i].group].group;  // an earlier one or itself: at the root
    }
}

void IsolatedFilter::discardSmall(const Strip& strip, int minSize, DisparityImage& image) const {
    for (std::size_t i = strip.begin; i < strip.end; ++i) {
        if (runs_[root(i)].size < static_cast<std::uint32_t>(minSize)) {
            const Run& run = runs_[i];
            float* d = image.disparity.data() + image.index(0, run.row);
            std::fill(d + run.first, d + run.last, kNoDisparity);
        }
    }
}

void IsolatedFilter::apply(DisparityImage& image, int minSize, float maxDifference) {
    if (minSize <= 1 || image.height == 0) {
        return;
    }
    if (image.disparity.size() > room_) {
        room_ = image.disparity.size();
        runs_.reset(new Run[room_]);  // not std::make_unique, which would write to all of it
    }
    const int strips = std::clamp(tbb::this_task_arena::max_concurrency(), 1, image.height);
    strips_.resize(std::max(strips_.size(), static_cast<std::size_t>(strips)));
    const auto strip = [&](int i) -> Strip& { return strips_[static_cast<std::size_t>(i)]; };
    parallelForEach(strips, 1, [&](int i) {
        label(image, i * image.height / strips, (i + 1) * image.height / strips, maxDifference,
              strip(i));
    });
    for (int i = 1; i < strips; ++i) {
        joinRows(image, strip(i - 1).lastRow, strip(i - 1).end, strip(i).begin, strip(i).secondRow,
                 maxDifference);
    }
    parallelForEach(strips, 1, [&](int i) { discardSmall(strip(i), minSize, image); });
}

void discardSilhouettes(DisparityImage& image, int reach, int rows, float step,
                        std::vector<float>& scratch) {
    if (reach <= 0 || image.width == 0) {
        return;
    }
    const auto width = static_cast<std::size_t>(image.width);
    // Least disparity of the columns within reach, row by row; infinity never wins.
    scratch.resize(image.disparity.size());
    parallelForEach(image.height, 16, [&](int row) {
        kernel::leastAlong(image.disparity.data() + image.index(0, row), width,
                           static_cast<std::size_t>(reach), scratch.data() + image.index(0, row));
    });
    parallelForEach(image.height, 16, [&](int row) {
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
    parallelForEach(image.height, 16, [&](int row) {
        const auto rowOf = [&](int r) { return image.disparity.data() + image.index(0, r); };
        const float* d = rowOf(row);
        const float* up = row >= kReach ? rowOf(row - kReach) : d;
        const float* down = row + kReach < image.height ? rowOf(row + kReach) : d;
        kernel::growSigma(d, up, down, static_cast<std::size_t>(image.width), slope,
                          image.sigma.data() + image.index(0, row));
    });
}

}  // namespace riftmap
