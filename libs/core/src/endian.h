// SPDX-License-Identifier: BSD-3-Clause
// Numbers as bytes, of either order.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstring>
#include <string>

namespace riftmap {

static_assert(std::endian::native == std::endian::little ||
              std::endian::native == std::endian::big);

/// The number whose bytes start at `bytes`.
template <class T>
T fromBytes(const char* bytes, std::endian order) {
    std::array<char, sizeof(T)> raw{};
    std::copy_n(bytes, sizeof(T), raw.begin());
    if (order != std::endian::native) {
        std::reverse(raw.begin(), raw.end());
    }
    return std::bit_cast<T>(raw);
}

/// Appends the little-endian bytes of a number.
template <class T>
void appendLittleEndian(std::string& out, T value) {
    auto raw = std::bit_cast<std::array<char, sizeof(T)>>(value);
    if constexpr (std::endian::native == std::endian::big) {
        std::reverse(raw.begin(), raw.end());
    }
    out.append(raw.data(), raw.size());
}

}  // namespace riftmap
