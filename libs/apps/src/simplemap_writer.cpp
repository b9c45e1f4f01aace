// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/apps/simplemap_writer.h"

#include <mrpt/io/CFileGZOutputStream.h>
#include <mrpt/maps/CSimpleMap.h>
#include <mrpt/obs/CSensoryFrame.h>
#include <mrpt/poses/CPose3DPDFGaussian.h>
#include <mrpt/serialization/CArchive.h>

#include <algorithm>
#include <cstdint>
#include <fstream>
#include <system_error>
#include <utility>
#include <vector>

#include "riftmap/apps/rawlog_writer.h"
#include "riftmap/core/file.h"
#include "riftmap/core/text.h"

namespace riftmap {
namespace {

/// Images hardly shrink, and compressing them costs more than mapping them.
constexpr int kCompression = 0;

void openForWriting(mrpt::io::CFileGZOutputStream& stream, const std::filesystem::path& file) {
    std::string why;
    if (!stream.open(file.string(), kCompression, why)) {
        throw FileError(file.string() + ": cannot be written: " + oneLine(why));
    }
}

/// What MRPT writes before the number of keyframes, and after the last one.
struct Framing {
    std::vector<std::uint8_t> head, tail;
};

/// Taken from an empty map, so that nothing about MRPT's format is written down here.
Framing framingOfSimpleMap() {
    std::vector<std::uint8_t> bytes;
    const mrpt::maps::CSimpleMap empty;
    mrpt::serialization::ObjectToOctetVector(&empty, bytes);
    constexpr std::size_t kCount = sizeof(std::uint32_t);
    constexpr std::size_t kTail = 1;
    const auto count = bytes.end() - kCount - kTail;
    if (std::any_of(count, count + kCount, [](std::uint8_t b) { return b != 0; })) {
        throw FileError("this version of MRPT writes .simplemap files in another way");
    }
    return {{bytes.begin(), count}, {count + kCount, bytes.end()}};
}

}  // namespace

class SimpleMapWriter::Impl {
 public:
    explicit Impl(std::filesystem::path file)
        : file_(std::move(file)), frames_(file_.string() + ".frames") {
        openForWriting(stream_, frames_);
    }

    ~Impl() {
        stream_.close();
        std::error_code ignored;  // nothing to be done about a file that stays
        std::filesystem::remove(frames_, ignored);
    }
    Impl(const Impl&) = delete;
    Impl& operator=(const Impl&) = delete;

    void add(const StereoObservation& observation) {
        const Pose robot_T_camera = forwardCamera();
        mrpt::poses::CPose3DPDFGaussian pose;
        pose.mean = toMrpt(observation.world_T_camera * robot_T_camera.inverse());
        mrpt::obs::CSensoryFrame frame;
        frame.insert(toMrpt(observation, robot_T_camera, "stereo"));
        mrpt::serialization::archiveFrom(stream_) << pose << frame;
        ++count_;
    }

    /// The keyframes were written before their number is known; a gzip file may be made of parts
    /// one after the other.
    void finish() {
        stream_.close();
        const auto framing = framingOfSimpleMap();
        writeBesideAndRename(file_, [&](const std::filesystem::path& part) {
            writePart(part, framing.head, count_, false);
            appendFrames(part);
            writePart(part, framing.tail, std::nullopt, true);
        });
    }

 private:
    static void writePart(const std::filesystem::path& file, const std::vector<std::uint8_t>& bytes,
                          std::optional<std::uint32_t> count, bool append) {
        mrpt::io::CFileGZOutputStream stream;
        std::string why;
        if (!stream.open(file.string(), kCompression, why,
                         append ? mrpt::io::OpenMode::APPEND : mrpt::io::OpenMode::TRUNCATE)) {
            throw FileError(file.string() + ": cannot be written: " + oneLine(why));
        }
        auto archive = mrpt::serialization::archiveFrom(stream);
        archive.WriteBuffer(bytes.data(), bytes.size());
        if (count) {
            archive << *count;
        }
    }

    void appendFrames(const std::filesystem::path& file) const {
        std::ifstream in(frames_, std::ios::binary);
        std::ofstream out(file, std::ios::binary | std::ios::app);
        if (count_ > 0) {
            out << in.rdbuf();
        }
        out.flush();
        if (!in || !out) {
            throw FileError(file.string() + ": cannot be written; is the disk full?");
        }
    }

    std::filesystem::path file_, frames_;
    mrpt::io::CFileGZOutputStream stream_;
    std::uint32_t count_ = 0;
};

SimpleMapWriter::SimpleMapWriter(const std::filesystem::path& file)
    : impl_(std::make_unique<Impl>(file)) {}
SimpleMapWriter::~SimpleMapWriter() = default;

void SimpleMapWriter::add(const StereoObservation& observation) {
    impl_->add(observation);
}

void SimpleMapWriter::finish() {
    impl_->finish();
}

}  // namespace riftmap
