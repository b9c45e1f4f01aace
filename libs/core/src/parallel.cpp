// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/core/parallel.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <stdexcept>

#ifdef __SANITIZE_THREAD__
#include <atomic>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>
#endif

namespace riftmap {
namespace {

#ifdef __SANITIZE_THREAD__
/// The thread sanitizer cannot see how oneTBB, which is not instrumented, orders its tasks: every
/// loop would be reported. Threads that it does see let it watch what our bodies do to each other.
template <class Run>
void runRanges(std::size_t ranges, const Run& run) {
    constexpr std::size_t kThreads = 4;
    std::atomic<std::size_t> next{0};
    std::exception_ptr error;
    std::mutex mutex;
    const auto work = [&] {
        for (std::size_t i = next.fetch_add(1); i < ranges; i = next.fetch_add(1)) {
            try {
                run(i);
            } catch (...) {
                const std::lock_guard lock(mutex);
                error = error ? error : std::current_exception();
            }
        }
    };
    std::vector<std::thread> threads;
    for (std::size_t t = 1; t < std::min(kThreads, ranges); ++t) {
        threads.emplace_back(work);
    }
    work();
    for (std::thread& thread : threads) {
        thread.join();
    }
    if (error) {
        std::rethrow_exception(error);
    }
}
#else
template <class Run>
void runRanges(std::size_t ranges, const Run& run) {
    tbb::parallel_for(
        tbb::blocked_range<std::size_t>(0, ranges, 1),
        [&](const tbb::blocked_range<std::size_t>& some) {
            for (std::size_t i = some.begin(); i < some.end(); ++i) {
                run(i);
            }
        },
        tbb::simple_partitioner());
}
#endif

}  // namespace

void parallelFor(std::size_t n, std::size_t grain,
                 const std::function<void(std::size_t begin, std::size_t end)>& body) {
    if (grain == 0) {
        throw std::invalid_argument("parallelFor: the grain is 0");
    }
    const std::size_t ranges = n / grain + (n % grain == 0 ? 0 : 1);
    runRanges(ranges, [&](std::size_t i) { body(i * grain, std::min(n, i * grain + grain)); });
}

}  // namespace riftmap
