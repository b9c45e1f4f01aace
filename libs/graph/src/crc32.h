// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>

namespace riftmap {

/// CRC-32 (the polynomial of zlib and PNG), eight bytes at a time.
class Crc32 {
 public:
    static std::uint32_t of(const char* data, std::size_t size) {
        static const Crc32 tables;
        std::uint32_t crc = 0xFFFFFFFFU;
        for (; size >= 8; data += 8, size -= 8) {
            std::array<std::uint32_t, 2> word{};
            std::memcpy(word.data(), data, 8);
            const std::uint32_t low = word[0] ^ crc, high = word[1];
            crc = tables.at(7, low) ^ tables.at(6, low >> 8U) ^ tables.at(5, low >> 16U) ^
                  tables.at(4, low >> 24U) ^ tables.at(3, high) ^ tables.at(2, high >> 8U) ^
                  tables.at(1, high >> 16U) ^ tables.at(0, high >> 24U);
        }
        for (; size > 0; ++data, --size) {
            crc = (crc >> 8U) ^ tables.at(0, crc ^ static_cast<unsigned char>(*data));
        }
        return ~crc;
    }

 private:
    Crc32() {
        for (std::uint32_t i = 0; i < 256; ++i) {
            std::uint32_t c = i;
            for (int bit = 0; bit < 8; ++bit) {
                c = (c & 1U) != 0 ? (c >> 1U) ^ 0xEDB88320U : c >> 1U;
            }
            table_[0][i] = c;
        }
        for (std::size_t t = 1; t < table_.size(); ++t) {
            for (std::size_t i = 0; i < 256; ++i) {
                const std::uint32_t before = table_[t - 1][i];
                table_[t][i] = (before >> 8U) ^ table_[0][before & 0xFFU];
            }
        }
    }
    std::uint32_t at(std::size_t t, std::uint32_t byte) const { return table_[t][byte & 0xFFU]; }

    std::array<std::array<std::uint32_t, 256>, 8> table_{};
};

}  // namespace riftmap
