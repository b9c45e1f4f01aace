// SPDX-License-Identifier: BSD-3-Clause
// Random numbers that depend on where they are used, not on what was drawn before: any thread may
// draw any of them. Integer arithmetic only, so every machine draws the same.
#pragma once

#include <cstdint>

namespace riftmap {

/// SplitMix64's finaliser: a bijection that looks random.
inline std::uint64_t mixBits(std::uint64_t x) {
    x += 0x9E3779B97F4A7C15ULL;
    x = (x ^ (x >> 30U)) * 0xBF58476D1CE4E5B9ULL;
    x = (x ^ (x >> 27U)) * 0x94D049BB133111EBULL;
    return x ^ (x >> 31U);
}

/// A seed for item `index` of a stream.
inline std::uint64_t mixBits(std::uint64_t seed, std::uint64_t index) {
    return mixBits(mixBits(seed) ^ index);
}

/// Mean 0, variance 1, |x| <= 6: the sum of twelve uniform numbers.
inline float gaussian(std::uint64_t seed, std::uint64_t index) {
    constexpr std::uint64_t kEven = 0x0000FFFF0000FFFFULL;  // fields of 16 bits, two at once
    const std::uint64_t first = mixBits(seed ^ (index * 0xD1B54A32D192ED03ULL));
    const std::uint64_t second = mixBits(first);
    const std::uint64_t third = mixBits(second);
    std::uint64_t sum = (first & kEven) + ((first >> 16U) & kEven) + (second & kEven) +
                        ((second >> 16U) & kEven) + (third & kEven) + ((third >> 16U) & kEven);
    sum = (sum & 0xFFFFFFFFU) + (sum >> 32U);
    return (static_cast<float>(static_cast<std::int32_t>(sum)) + 6.0F) / 65536.0F - 6.0F;
}

}  // namespace riftmap
