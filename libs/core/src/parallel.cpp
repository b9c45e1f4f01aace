// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/core/parallel.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <stdexcept>

namespace riftmap {

void parallelFor(std::size_t n, std::size_t grain,
                 const std::function<void(std::size_t begin, std::size_t end)>& body) {
    if (grain == 0) {
        throw std::invalid_argument("parallelFor: the grain is 0");
    }
    const std::size_t ranges = n / grain + (n % grain == 0 ? 0 : 1);
    tbb::parallel_for(
        tbb::blocked_range<std::size_t>(0, ranges, 1),
        [&](const tbb::blocked_range<std::size_t>& some) {
            for (std::size_t i = some.begin(); i < some.end(); ++i) {
                body(i * grain, std::min(n, i * grain + grain));
            }
        },
        tbb::simple_partitioner());
}

}  // namespace riftmap
