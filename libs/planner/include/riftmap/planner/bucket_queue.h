// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "riftmap/graph/graph_storage.h"

namespace riftmap {

/// Vertices in the order of their keys, but only as far as a search needs it: by buckets, each a
/// range of keys, and within a bucket as they came. Pushing and taking cost a constant, not the
/// logarithm of a heap, and what comes next is known early enough to be fetched from memory.
///
/// Keys beyond the buckets wait in no order. When the buckets are empty, these are made anew over
/// the lower part of what waits, as many as there are vertices for. So their width follows the
/// front of the search: it needs neither the scale of the graph nor short edges only. Serves one
/// thread; keeps its memory.
class BucketQueue {
 public:
    void clear();

    /// `key` is finite and >= 0. One below floor(), as rounding may give, joins the current bucket.
    void push(double key, VertexId id) {
        if (key < end_) {
            const double index = std::max(0.0, (key - start_) * bucketsPerKey_);
            buckets_[at(std::clamp(static_cast<std::int32_t>(index), current_, last_))].push_back(
                id);
        } else {
            waiting_.push_back({key, id});
        }
    }

    /// Leaves the current bucket for the next one with vertices in it; false if there is none.
    bool advance();

    /// No key outside of the current bucket and of those left before is smaller, up to rounding.
    double floor() const { return start_ + current_ / bucketsPerKey_; }

    /// The current bucket; it grows at its end by keys that fall into it while it is worked off.
    const std::vector<VertexId>& bucket() const { return buckets_[at(current_)]; }

 private:
    struct Waiting {
        double key;
        VertexId id;
    };
    static constexpr std::size_t kMostBuckets = 1024;
    static constexpr std::size_t kPerBucket = 128;  ///< enough to fetch ahead

    static std::size_t at(std::int32_t bucket) { return static_cast<std::size_t>(bucket); }
    double middleKey();
    void spread();

    std::vector<std::vector<VertexId>> buckets_ = std::vector<std::vector<VertexId>>(kMostBuckets);
    std::vector<Waiting> waiting_;  ///< keys from end_ on
    std::vector<double> sample_;
    double start_ = 0, end_ = 0;  ///< range of keys of the buckets
    double bucketsPerKey_ = 1;
    std::int32_t current_ = 0, last_ = 0;  ///< of the buckets in use
};

}  // namespace riftmap
