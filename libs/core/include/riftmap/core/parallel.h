// SPDX-License-Identifier: BSD-3-Clause
// Parallel loops whose result does not depend on the number of threads.
#pragma once

#include <cstddef>
#include <functional>
#include <type_traits>
#include <vector>

namespace riftmap {

/// Calls body(begin, end) for [0, n) cut into ranges of `grain` (the last may be shorter), many at
/// once, in any order; the cuts depend on n and grain alone. Returns when all are done; throws what
/// a body threw. `grain` > 0. A body writes only to what belongs to its range.
void parallelFor(std::size_t n, std::size_t grain,
                 const std::function<void(std::size_t begin, std::size_t end)>& body);

/// Calls body(i) for every i of [0, n) in the same way; `grain`: so many one after the other. Takes
/// no memory of its own.
template <class Index, class Body>
void parallelForEach(Index n, std::size_t grain, const Body& body) {
    static_assert(std::is_integral_v<Index>);
    const auto run = [&body](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            body(static_cast<Index>(i));
        }
    };
    parallelFor(n > 0 ? static_cast<std::size_t>(n) : 0, grain, run);
}

/// combine(...combine(combine(initial, map(0, grain)), map(grain, 2 grain))..., map(..., n)): the
/// maps run at once, the combining in this order, so that sums of floats come out the same for any
/// number of threads.
template <class T, class Map, class Combine>
T parallelReduce(std::size_t n, std::size_t grain, T initial, const Map& map,
                 const Combine& combine) {
    static_assert(!std::is_same_v<T, bool>, "neighbours in a vector of bool share a byte");
    std::vector<T> parts((n + grain - 1) / grain, initial);
    parallelFor(n, grain, [&](std::size_t begin, std::size_t end) {
        parts[begin / grain] = map(begin, end);
    });
    for (const T& part : parts) {
        initial = combine(initial, part);
    }
    return initial;
}

}  // namespace riftmap
