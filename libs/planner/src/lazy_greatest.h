// SPDX-License-Identifier: BSD-3-Clause
// The greatest of values that are costly to find, by bounds that are not.
#pragma once

#include <algorithm>
#include <cstddef>
#include <numeric>
#include <span>
#include <vector>

namespace riftmap {

/// Index of the greatest value above zero, the first of equals; values.size() if there is none.
/// `values` hold upper bounds at first. weigh(indices) puts the values in place of some of them,
/// for several indices at a time; it is asked about those alone that may be the greatest, in an
/// order that depends on the bounds alone.
template <class Weigh>
std::size_t greatestOf(std::vector<double>& values, const Weigh& weigh) {
    constexpr std::size_t kAtOnce = 8;
    std::vector<std::size_t> order(values.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::stable_sort(order.begin(), order.end(),
                     [&](std::size_t a, std::size_t b) { return values[a] > values[b]; });
    std::size_t best = values.size();
    double most = 0;
    const auto mayBe = [&](std::size_t i) { return values[i] > 0 && values[i] >= most; };
    for (std::size_t first = 0, end = 0; first < order.size(); first = end) {
        while (end < order.size() && end < first + kAtOnce && mayBe(order[end])) {
            ++end;
        }
        if (end == first) {
            break;
        }
        const std::span<const std::size_t> some(order.data() + first, end - first);
        weigh(some);
        for (const std::size_t i : some) {
            if (values[i] > most || (values[i] == most && most > 0 && i < best)) {
                most = values[i];
                best = i;
            }
        }
    }
    return best;
}

}  // namespace riftmap
