// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/apps/rawlog_objects.h"

#include <system_error>

#include "riftmap/core/text.h"

namespace riftmap {

RawlogObjects::RawlogObjects(const std::filesystem::path& file) : file_(file) {
    std::error_code error;
    const auto status = std::filesystem::status(file, error);
    if (!std::filesystem::exists(status)) {
        throw RawlogError(file.string() + ": no such file");
    }
    if (!std::filesystem::is_regular_file(status)) {
        throw RawlogError(file.string() + ": not a file");
    }
    if (std::filesystem::file_size(file, error) == 0) {
        throw RawlogError(file.string() + ": empty");
    }
    std::string why;
    if (!stream_.open(file.string(), why)) {
        throw RawlogError(file.string() + ": cannot be read: " + oneLine(why));
    }
}

mrpt::serialization::CSerializable::Ptr RawlogObjects::next() {
    start_ = stream_.getPosition();  // MRPT says "compressed", but it is the uncompressed one
    auto archive = mrpt::serialization::archiveFrom(stream_);
    try {
        auto object = archive.ReadObject();
        ++count_;
        return object;
    } catch (const std::exception& e) {
        // MRPT says "end of file" for some cuts in the middle of an object, too.
        const bool ended = dynamic_cast<const mrpt::serialization::CExceptionEOF*>(&e) != nullptr &&
                           stream_.getPosition() == start_;
        if (ended && count_ == 0) {
            throw RawlogError(file_.string() + ": no objects in it");
        }
        if (ended) {
            return nullptr;
        }
        if (count_ == 0) {
            throw RawlogError(file_.string() + ": not a rawlog: " + oneLine(e.what()));
        }
        throw RawlogError(file_.string() + ": damaged after object " + std::to_string(count_) +
                          " (byte " + std::to_string(start_) +
                          " uncompressed): " + oneLine(e.what()));
    }
}

std::string RawlogObjects::place() const {
    return file_.string() + ": object " + std::to_string(count_) + " (byte " +
           std::to_string(start_) + " uncompressed)";
}

std::filesystem::path imagesDirectory(const std::filesystem::path& rawlog) {
    auto folder = rawlog.parent_path();
    if (folder.empty()) {
        folder = ".";
    }
    for (const auto* suffix : {"_Images", "_images", "_IMAGES"}) {
        const auto candidate = folder / (rawlog.stem().string() + suffix);
        if (std::filesystem::is_directory(candidate)) {
            return candidate;
        }
    }
    return folder / "Images";
}

}  // namespace riftmap
