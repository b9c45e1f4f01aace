// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/stereo/disparity_filters.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

namespace riftmap {

std::uint32_t IsolatedFilter::root(std::uint32_t run) {
    while (runs_[run].group != run) {
        runs_[run].group = runs_[runs_[run].group].group;  // halves the way for the next one
        run = runs_[run].group;
    }
    return run;
}

void IsolatedFilter::unite(std::uint32_t a, std::uint32_t b) {
    a = root(a);
    b = root(b);
    if (a != b) {
        const auto [low, high] = std::minmax(a, b);
        runs_[high].group = low;
        runs_[low].size += runs_[high].size;
    }
}

void IsolatedFilter::findRuns(const DisparityImage& image, int row, float maxDifference) {
    const float* d = image.disparity.data() + image.index(0, row);
    for (int c = 0; c < image.width;) {
        if (!std::isfinite(d[c])) {
            ++c;
            continue;
        }
        const int first = c++;
        // Infinity differs by more than any limit.
        while (c < image.width && std::abs(d[c] - d[c - 1]) <= maxDifference) {
            ++c;
        }
        runs_.push_back({.row = row,
                         .first = first,
                         .last = c,
                         .group = static_cast<std::uint32_t>(runs_.size()),
                         .size = static_cast<std::uint32_t>(c - first)});
    }
}

void IsolatedFilter::joinRows(const DisparityImage& image, std::size_t above, std::size_t here,
                              float maxDifference) {
    const std::size_t end = runs_.size();
    for (std::size_t a = above, b = here; a < here && b < end;) {
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

void IsolatedFilter::apply(DisparityImage& image, int minSize, float maxDifference) {
    if (minSize <= 1) {
        return;
    }
    runs_.clear();
    std::size_t above = 0;
    for (int row = 0; row < image.height; ++row) {
        const std::size_t here = runs_.size();
        findRuns(image, row, maxDifference);
        if (row > 0) {
            joinRows(image, above, here, maxDifference);
        }
        above = here;
    }
    for (std::uint32_t i = 0; i < runs_.size(); ++i) {
        const Run& run = runs_[i];
        if (runs_[root(i)].size < static_cast<std::uint32_t>(minSize)) {
            float* d = image.disparity.data() + image.index(0, run.row);
            std::fill(d + run.first, d + run.last, kNoDisparity);
        }
    }
}

void discardSilhouettes(DisparityImage& image, int reach, float step, std::vector<float>& scratch) {
    if (reach <= 0 || image.width == 0) {
        return;
    }
    const auto width = static_cast<std::size_t>(image.width);
    const auto r = static_cast<std::size_t>(reach);
    // Least disparity of the columns within reach, row by row; infinity never wins.
    scratch.resize(image.disparity.size());
    tbb::parallel_for(0, image.height, [&](int row) {
        const float* d = image.disparity.data() + image.index(0, row);
        float* least = scratch.data() + image.index(0, row);
        std::copy(d, d + width, least);
        for (std::size_t k = 1; k <= r && k < width; ++k) {
            for (std::size_t c = 0; c + k < width; ++c) {
                least[c] = std::min(least[c], d[c + k]);
            }
            for (std::size_t c = k; c < width; ++c) {
                least[c] = std::min(least[c], d[c - k]);
            }
        }
    });
    tbb::parallel_for(0, image.height, [&](int row) {
        float* d = image.disparity.data() + image.index(0, row);
        const int last = std::min(image.height - 1, row + reach);
        for (int other = std::max(0, row - reach); other <= last; ++other) {
            const float* least = scratch.data() + image.index(0, other);
            for (std::size_t c = 0; c < width; ++c) {
                d[c] = d[c] - least[c] > step ? kNoDisparity : d[c];
            }
        }
    });
}

}  // namespace riftmap
