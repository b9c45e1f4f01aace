// SPDX-License-Identifier: BSD-3-Clause
#include "observable_cache.h"

#include <cstdio>
#include <cstring>
#include <fstream>
#include <ostream>

#include "hash.h"
#include "riftmap/core/file.h"

namespace riftmap {

namespace {

struct Header {
    char magic[8] = {'R', 'M', 'O', 'B', 'S', '0', '2', '\n'};
    std::uint64_t key = 0;
    std::uint64_t count = 0;
    std::uint64_t checksum = 0;  ///< of the sides
};

std::filesystem::path fileOf(const std::filesystem::path& directory, std::uint64_t key) {
    char name[40];
    std::snprintf(name, sizeof name, "observable-%016llx.bin",
                  static_cast<unsigned long long>(key));
    return directory / name;
}

std::uint64_t checksum(const std::vector<std::int8_t>& sides) {
    Fnv hash;
    hash.bytes(sides.data(), sides.size());
    return hash.value();
}

}  // namespace

bool readObservable(const std::filesystem::path& directory, std::uint64_t key, std::size_t count,
                    std::vector<std::int8_t>& sides) {
    std::ifstream in(fileOf(directory, key), std::ios::binary);
    Header header;
    const Header expected;
    if (!in.read(reinterpret_cast<char*>(&header), sizeof header) ||
        std::memcmp(header.magic, expected.magic, sizeof header.magic) != 0 || header.key != key ||
        header.count != count) {
        return false;
    }
    std::vector<std::int8_t> read(count);
    if (!in.read(reinterpret_cast<char*>(read.data()), static_cast<std::streamsize>(count)) ||
        checksum(read) != header.checksum) {
        return false;
    }
    sides.swap(read);
    return true;
}

void writeObservable(const std::filesystem::path& directory, std::uint64_t key,
                     const std::vector<std::int8_t>& sides) {
    std::filesystem::create_directories(directory);
    Header header;
    header.key = key;
    header.count = sides.size();
    header.checksum = checksum(sides);
    writeAtomically(fileOf(directory, key), [&](std::ostream& out) {
        out.write(reinterpret_cast<const char*>(&header), sizeof header);
        out.write(reinterpret_cast<const char*>(sides.data()),
                  static_cast<std::streamsize>(sides.size()));
    });
}

}  // namespace riftmap
