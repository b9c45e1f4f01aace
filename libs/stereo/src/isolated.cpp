// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/stereo/isolated.h"

#include <cmath>
#include <cstddef>
#include <vector>

namespace riftmap {

void removeIsolated(DisparityImage& image, int minSize, float maxDifference) {
    if (minSize <= 1) {
        return;
    }
    const auto near = [&](std::size_t a, std::size_t b) {
        return std::isfinite(image.disparity[b]) &&
               std::abs(image.disparity[a] - image.disparity[b]) <= maxDifference;
    };
    std::vector<char> seen(image.disparity.size(), 0);
    std::vector<std::size_t> group;
    const auto width = static_cast<std::size_t>(image.width);
    for (std::size_t seed = 0; seed < image.disparity.size(); ++seed) {
        if (seen[seed] != 0 || !std::isfinite(image.disparity[seed])) {
            continue;
        }
        group.assign(1, seed);
        seen[seed] = 1;
        const auto visit = [&](std::size_t from, std::size_t to) {
            if (seen[to] == 0 && near(from, to)) {
                seen[to] = 1;
                group.push_back(to);
            }
        };
        for (std::size_t i = 0; i < group.size(); ++i) {
            const std::size_t p = group[i];
            if (p % width != 0) {
                visit(p, p - 1);
            }
            if (p % width != width - 1) {
                visit(p, p + 1);
            }
            if (p >= width) {
                visit(p, p - width);
            }
            if (p + width < image.disparity.size()) {
                visit(p, p + width);
            }
        }
        if (group.size() < static_cast<std::size_t>(minSize)) {
            for (const std::size_t p : group) {
                image.disparity[p] = kNoDisparity;
            }
        }
    }
}

}  // namespace riftmap
