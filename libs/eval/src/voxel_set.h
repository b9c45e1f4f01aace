// SPDX-License-Identifier: BSD-3-Clause
// Voxels of an OctoMap's finest level, and sets of them.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace riftmap {

/// Three coordinates of 16 bits, as OctoMap's keys.
struct Voxel {
    std::uint64_t code = 0;

    static Voxel of(std::size_t x, std::size_t y, std::size_t z) {
        return {(static_cast<std::uint64_t>(z & 0xFFFFU) << 32U) |
                (static_cast<std::uint64_t>(y & 0xFFFFU) << 16U) | (x & 0xFFFFU)};
    }
    std::uint16_t at(int axis) const { return static_cast<std::uint16_t>(code >> (16 * axis)); }
    bool operator==(const Voxel&) const = default;

    /// Whether f holds for one of the 26 voxels around.
    template <class F>
    bool anyAround(F&& f) const {
        for (std::size_t i = 0; i < 27; ++i) {
            if (i != 13 && f(of(at(0) + i % 3 - 1, at(1) + i / 3 % 3 - 1, at(2) + i / 9 - 1))) {
                return true;
            }
        }
        return false;
    }
};

/// To be filled by add(), then finish(); then read.
class VoxelSet {
 public:
    void add(Voxel voxel) {
        if (voxels_.empty() || !(voxels_.back() == voxel)) {
            voxels_.push_back(voxel);
        }
        if (voxels_.size() > 2 * distinct_ + (1U << 22U)) {
            finish();  // many of them twice: memory stays in bounds
        }
    }
    void finish() {
        std::sort(voxels_.begin(), voxels_.end(), [](Voxel a, Voxel b) { return a.code < b.code; });
        voxels_.erase(std::unique(voxels_.begin(), voxels_.end()), voxels_.end());
        distinct_ = voxels_.size();
    }
    bool contains(Voxel voxel) const {
        const auto at = std::lower_bound(voxels_.begin(), voxels_.end(), voxel,
                                         [](Voxel a, Voxel b) { return a.code < b.code; });
        return at != voxels_.end() && *at == voxel;
    }
    std::size_t size() const { return voxels_.size(); }
    bool empty() const { return voxels_.empty(); }
    auto begin() const { return voxels_.begin(); }
    auto end() const { return voxels_.end(); }

 private:
    std::vector<Voxel> voxels_;
    std::size_t distinct_ = 0;
};

}  // namespace riftmap
