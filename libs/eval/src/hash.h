// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>

namespace riftmap {

/// FNV-1a, 64 bits, over the bytes of numbers.
class Fnv {
 public:
    void bytes(const void* data, std::size_t size) {
        const auto* p = static_cast<const unsigned char*>(data);
        for (std::size_t i = 0; i < size; ++i) {
            value_ = (value_ ^ p[i]) * 0x100000001B3ULL;
        }
    }
    template <class T>
    void add(T number) {
        unsigned char raw[sizeof(T)];
        std::memcpy(raw, &number, sizeof(T));
        bytes(raw, sizeof(T));
    }
    std::uint64_t value() const { return value_; }

 private:
    std::uint64_t value_ = 0xCBF29CE484222325ULL;
};

}  // namespace riftmap
