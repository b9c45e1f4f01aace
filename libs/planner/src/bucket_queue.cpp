// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/planner/bucket_queue.h"

#include <limits>

namespace riftmap {

void BucketQueue::clear() {
    for (auto& bucket : buckets_) {
        bucket.clear();
    }
    waiting_.clear();
    start_ = end_ = 0;
    bucketsPerKey_ = 1;
    current_ = last_ = 0;
}

bool BucketQueue::advance() {
    buckets_[at(current_)].clear();
    while (current_ < last_) {
        ++current_;
        if (!bucket().empty()) {
            return true;
        }
    }
    if (waiting_.empty()) {
        return false;
    }
    spread();
    return !bucket().empty();  // so that the search ends on keys that are not finite, too
}

/// Of some of the waiting keys, evenly taken: of any such choice it is near enough.
double BucketQueue::middleKey() {
    constexpr std::size_t kEnough = 64;
    sample_.clear();
    const std::size_t step = waiting_.size() / kEnough + 1;
    for (std::size_t i = 0; i < waiting_.size(); i += step) {
        sample_.push_back(waiting_[i].key);
    }
    const auto middle = sample_.begin() + static_cast<std::ptrdiff_t>(sample_.size() / 2);
    std::nth_element(sample_.begin(), middle, sample_.end());
    return *middle;
}

/// The buckets reach from the smallest waiting key to as far beyond the middle one. So about half
/// of the keys find a place, whatever the others are: none is looked at here more than twice or so,
/// and a few long edges, such as those across a tear, do not widen the buckets for all.
void BucketQueue::spread() {
    double least = std::numeric_limits<double>::infinity();
    for (const Waiting& w : waiting_) {
        least = std::min(least, w.key);
    }
    constexpr double kSmall = 1e-15, kSmallest = 1e-300;  // so that the range is never empty
    start_ = least;
    end_ = std::max(2.0 * middleKey() - least, least + std::max(kSmall * least, kSmallest));
    const std::size_t buckets =
        std::clamp(waiting_.size() / kPerBucket, std::size_t{1}, kMostBuckets);
    bucketsPerKey_ = static_cast<double>(buckets) / (end_ - start_);
    current_ = 0;
    last_ = static_cast<std::int32_t>(buckets) - 1;
    std::size_t kept = 0;
    for (const Waiting w : waiting_) {
        if (w.key < end_) {
            push(w.key, w.id);
        } else {
            waiting_[kept++] = w;
        }
    }
    waiting_.resize(kept);
}

}  // namespace riftmap
