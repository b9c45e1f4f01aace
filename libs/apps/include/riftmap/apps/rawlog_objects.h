// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <mrpt/io/CFileGZInputStream.h>
#include <mrpt/serialization/CArchive.h>
#include <mrpt/serialization/CSerializable.h>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>

#include "riftmap/core/file.h"

namespace riftmap {

/// A rawlog that cannot be read, or not to its end; the text names file, object and byte.
class RawlogError : public FileError {
 public:
    using FileError::FileError;
};

/// The objects of a rawlog (gzip or plain) one by one, so that a set larger than memory is no
/// matter. MRPT's own loaders say "end of file" to a file that was cut; this one tells the two
/// apart. Not thread-safe.
class RawlogObjects {
 public:
    /// Throws RawlogError: no such file, a directory, not readable, empty.
    explicit RawlogObjects(const std::filesystem::path& file);

    /// The next object; nullptr at the end of the file. Throws RawlogError where the file is
    /// damaged: nothing behind that place can be read.
    mrpt::serialization::CSerializable::Ptr next();

    /// How many objects next() has returned.
    std::size_t count() const { return count_; }
    /// "FILE: object 12 (byte 3456 uncompressed)": the object that next() returned last, counted
    /// from 1, and where it begins.
    std::string place() const;

 private:
    std::filesystem::path file_;
    mrpt::io::CFileGZInputStream stream_;
    std::uint64_t start_ = 0;  ///< where the last object begins [byte of the uncompressed stream]
    std::size_t count_ = 0;
};

/// Where a rawlog's external images are: FILE_Images beside FILE.rawlog, then _images, _IMAGES,
/// and Images. (MRPT 2.5.8's own search loses the slash of a path.)
std::filesystem::path imagesDirectory(const std::filesystem::path& rawlog);

}  // namespace riftmap
