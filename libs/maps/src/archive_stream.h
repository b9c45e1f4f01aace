// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <mrpt/serialization/CArchive.h>

#include <cstdint>
#include <limits>
#include <stdexcept>
#include <streambuf>
#include <vector>

namespace riftmap {

/// A std::ostream into an archive of MRPT, in pieces of at most 1 MiB with their length before
/// them and one of length 0 at the end: a map is never in memory twice.
class ArchiveOutput : public std::streambuf {
 public:
    explicit ArchiveOutput(mrpt::serialization::CArchive& archive)
        : archive_(archive), buffer_(std::size_t{1} << 20) {
        setp(buffer_.data(), buffer_.data() + buffer_.size());
    }
    /// After the last byte.
    void finish() {
        flushPiece();
        archive_.WriteAs<std::uint32_t>(0);
    }

 protected:
    int_type overflow(int_type c) override {
        flushPiece();
        if (c != traits_type::eof()) {
            *pptr() = traits_type::to_char_type(c);
            pbump(1);
        }
        return traits_type::not_eof(c);
    }
    int sync() override { return 0; }

 private:
    void flushPiece() {
        const auto n = static_cast<std::size_t>(pptr() - pbase());
        if (n > 0) {
            archive_.WriteAs<std::uint32_t>(n);
            archive_.WriteBuffer(pbase(), n);
            setp(buffer_.data(), buffer_.data() + buffer_.size());
        }
    }

    mrpt::serialization::CArchive& archive_;
    std::vector<char> buffer_;
};

/// The std::istream for what ArchiveOutput wrote.
class ArchiveInput : public std::streambuf {
 public:
    explicit ArchiveInput(mrpt::serialization::CArchive& archive) : archive_(archive) {}
    /// Skips to behind the end mark.
    void finish() {
        while (!ended_) {
            nextPiece();
        }
    }

 protected:
    int_type underflow() override {
        if (!ended_) {
            nextPiece();
        }
        return ended_ ? traits_type::eof() : traits_type::to_int_type(*gptr());
    }

 private:
    void nextPiece() {
        const auto n = archive_.ReadAs<std::uint32_t>();
        if (n > (1U << 20)) {
            throw std::runtime_error("a piece of " + std::to_string(n) + " bytes; allowed: 1 MiB");
        }
        ended_ = n == 0;
        buffer_.resize(n);
        if (n > 0) {
            archive_.ReadBuffer(buffer_.data(), n);
        }
        setg(buffer_.data(), buffer_.data(), buffer_.data() + n);
    }

    mrpt::serialization::CArchive& archive_;
    std::vector<char> buffer_;
    bool ended_ = false;
};

}  // namespace riftmap
