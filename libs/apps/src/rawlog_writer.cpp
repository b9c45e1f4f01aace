// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/apps/rawlog_writer.h"

#include <mrpt/io/CFileGZOutputStream.h>
#include <mrpt/obs/CObservationComment.h>
#include <mrpt/obs/CObservationRobotPose.h>
#include <mrpt/poses/CPose3DQuat.h>
#include <mrpt/serialization/CArchive.h>

#include <cstdio>
#include <numbers>
#include <opencv2/imgcodecs.hpp>
#include <system_error>
#include <utility>

#include "riftmap/apps/rawlog_objects.h"
#include "riftmap/apps/stored_disparity.h"
#include "riftmap/core/mrpt_time.h"
#include "riftmap/core/text.h"

namespace riftmap {
namespace {

mrpt::obs::CObservationRobotPose poseObservation(std::int64_t time_ns, const Pose& world_T_robot) {
    mrpt::obs::CObservationRobotPose observation;
    observation.sensorLabel = "pose";
    observation.timestamp = toMrptTime(time_ns);
    observation.pose.mean = toMrpt(world_T_robot);
    return observation;
}

mrpt::img::CImage copyOf(const cv::Mat& mat) {
    // A view into a larger image would be written with the wrong bytes.
    return mrpt::img::CImage(mat.isContinuous() ? mat : mat.clone(), mrpt::img::DEEP_COPY);
}

std::filesystem::path partOf(const std::filesystem::path& file) {
    return file.string() + ".part";
}

/// Through the bytes of the file and back.
template <class T>
T asRead(const T& object) {
    std::vector<std::uint8_t> bytes;
    mrpt::serialization::ObjectToOctetVector(&object, bytes);
    mrpt::serialization::CSerializable::Ptr copy;
    mrpt::serialization::OctetVectorToObject(bytes, copy);
    return dynamic_cast<const T&>(*copy);
}

}  // namespace

Pose forwardCamera() {
    constexpr double kQuarter = std::numbers::pi / 2;
    return fromMrpt(mrpt::poses::CPose3D(0, 0, 0, -kQuarter, 0, -kQuarter));
}

mrpt::obs::CObservationStereoImages::Ptr toMrpt(const StereoObservation& observation,
                                                const Pose& robot_T_camera,
                                                const std::string& label) {
    const auto& camera = observation.camera;
    auto pair = mrpt::obs::CObservationStereoImages::Create();
    pair->sensorLabel = label;
    pair->timestamp = toMrptTime(observation.time_ns);
    pair->imageLeft = copyOf(observation.left);
    pair->hasImageRight = !observation.right.empty();
    if (pair->hasImageRight) {
        pair->imageRight = copyOf(observation.right);
    }
    if (observation.disparity) {
        storeDisparity(*observation.disparity, *pair);
    }
    for (auto* side : {&pair->leftCamera, &pair->rightCamera}) {
        side->ncols = static_cast<std::uint32_t>(camera.width);
        side->nrows = static_cast<std::uint32_t>(camera.height);
        const double cx = side == &pair->leftCamera ? camera.cx : camera.cx + camera.doffs;
        side->setIntrinsicParamsFromValues(camera.fx, camera.fy, cx, camera.cy);
    }
    pair->cameraPose = mrpt::poses::CPose3DQuat(toMrpt(robot_T_camera));
    pair->rightCameraPose =
        mrpt::poses::CPose3DQuat(mrpt::poses::CPose3D(camera.baseline, 0, 0, 0, 0, 0));
    return pair;
}

class RawlogWriter::Impl {
 public:
    Impl(std::filesystem::path file, Images images, Mode mode)
        : file_(std::move(file)), part_(partOf(file_)), images_(images) {
        mrpt::img::CImage::DISABLE_JPEG_COMPRESSION(true);
        if (mode == Mode::kAppend && std::filesystem::exists(file_)) {
            count_ = objectsIn(file_);
            const std::filesystem::path copy = file_.string() + ".copy";  // no part of it is seen
            std::filesystem::copy_file(file_, copy,
                                       std::filesystem::copy_options::overwrite_existing);
            std::filesystem::rename(copy, part_);
        } else {
            open(mrpt::io::OpenMode::TRUNCATE);
        }
        if (images_ == Images::kExternal) {
            folder_ = file_.parent_path() / (file_.stem().string() + "_Images");
            std::filesystem::create_directories(folder_);
        }
    }

    ~Impl() {
        stream_.close();
        std::error_code ignored;  // it is gone after finish()
        if (!holdsViews_) {
            std::filesystem::remove(part_, ignored);
        }
    }
    Impl(const Impl&) = delete;
    Impl& operator=(const Impl&) = delete;

    void put(const mrpt::serialization::CSerializable& object) {
        if (!stream_.fileOpenCorrectly()) {
            open(mrpt::io::OpenMode::APPEND);
        }
        try {
            mrpt::serialization::archiveFrom(stream_) << object;
        } catch (const std::exception& e) {
            throw FileError(file_.string() + ": cannot be written: " + oneLine(e.what()));
        }
        ++count_;
    }

    void put(mrpt::obs::CObservationStereoImages& pair) {
        if (images_ == Images::kExternal) {
            moveOut(pair.imageLeft, pair, "left");
            if (pair.hasImageRight) {
                moveOut(pair.imageRight, pair, "right");
            }
        }
        put(static_cast<const mrpt::serialization::CSerializable&>(pair));
    }

    /// What is written so far gets to the disk. The compressor would keep a hundred views to
    /// itself; a file of several compressed members is one file to all who read it.
    void flush() {
        holdsViews_ = true;
        stream_.close();
    }

    void finish() {
        stream_.close();
        const std::size_t arrived = objectsIn(part_);
        if (arrived != count_) {
            throw FileError(file_.string() + ": " + std::to_string(count_) + " objects written, " +
                            std::to_string(arrived) + " arrived: is the disk full?");
        }
        std::error_code error;
        std::filesystem::rename(part_, file_, error);
        if (error) {
            throw FileError(file_.string() + ": cannot be written: " + error.message());
        }
    }

 private:
    static std::size_t objectsIn(const std::filesystem::path& file) {
        RawlogObjects objects(file);
        while (objects.next()) {
        }
        return objects.count();
    }

    void open(mrpt::io::OpenMode mode) {
        std::string why;
        if (!stream_.open(part_.string(), 1, why, mode)) {
            throw FileError(file_.string() + ": cannot be written: " + oneLine(why));
        }
    }

    void moveOut(mrpt::img::CImage& image, const mrpt::obs::CObservationStereoImages& pair,
                 const char* side) const {
        if (image.isExternallyStored()) {
            return;
        }
        const auto name =
            pair.sensorLabel + "_" + toText(fromMrptTime(pair.timestamp)) + "_" + side + ".png";
        if (!cv::imwrite((folder_ / name).string(), image.asCvMatRef())) {
            throw FileError((folder_ / name).string() + ": cannot be written");
        }
        image.setExternalStorage(name);
    }

    std::filesystem::path file_, part_, folder_;
    Images images_;
    mrpt::io::CFileGZOutputStream stream_;
    bool holdsViews_ = false;  ///< that whoever salvages the file can read
    std::size_t count_ = 0;
};

RawlogWriter::RawlogWriter(const std::filesystem::path& file, Images images, Mode mode)
    : impl_(std::make_unique<Impl>(file, images, mode)) {}
RawlogWriter::~RawlogWriter() = default;

void RawlogWriter::comment(std::int64_t time_ns, const std::string& text) {
    mrpt::obs::CObservationComment note;
    note.timestamp = toMrptTime(time_ns);
    note.text = text;
    impl_->put(note);
}

void RawlogWriter::robotPose(std::int64_t time_ns, const Pose& world_T_robot) {
    impl_->put(poseObservation(time_ns, world_T_robot));
}

void RawlogWriter::pair(mrpt::obs::CObservationStereoImages& observation) {
    impl_->put(observation);
}

void RawlogWriter::view(const mrpt::obs::CObservationRobotPose& pose,
                        mrpt::obs::CObservationStereoImages& pair) {
    impl_->put(pose);
    impl_->put(pair);
    impl_->flush();
}

Pose RawlogWriter::write(const StereoObservation& observation, const std::string& label) {
    const Pose robot_T_camera = forwardCamera();
    const auto pose =
        poseObservation(observation.time_ns, observation.world_T_camera * robot_T_camera.inverse());
    const auto pair = toMrpt(observation, robot_T_camera, label);
    view(pose, *pair);
    return fromMrpt(asRead(pose).pose.mean) * fromMrpt(mrpt::poses::CPose3D(pair->cameraPose));
}

void RawlogWriter::finish() {
    impl_->finish();
}

namespace {

/// The whole views of a recording that may be cut, into another file; returns how many. Without
/// any there is no other file.
std::size_t copyViews(const std::filesystem::path& from, const std::filesystem::path& to) {
    using mrpt::obs::CObservationRobotPose;
    using mrpt::obs::CObservationStereoImages;
    std::size_t views = 0;
    RawlogWriter out(to);
    try {
        RawlogObjects in(from);
        CObservationRobotPose::Ptr pose;
        while (const auto object = in.next()) {
            const auto pair = std::dynamic_pointer_cast<CObservationStereoImages>(object);
            if (pair && pose) {
                out.view(*pose, *pair);
                ++views;
            }
            pose = std::dynamic_pointer_cast<CObservationRobotPose>(object);
        }
    } catch (const RawlogError&) {  // here it was cut
    }
    if (views > 0) {
        out.finish();
    }
    return views;
}

}  // namespace

std::size_t salvageRawlog(const std::filesystem::path& file, bool someExpected) {
    namespace fs = std::filesystem;
    const fs::path part = partOf(file);
    const fs::path whole = file.string() + ".whole";
    const std::size_t views = copyViews(fs::exists(part) ? part : file, whole);
    if (views == 0 && someExpected) {
        throw FileError(file.string() +
                        ": missing, or no view of it can be read; nothing is changed");
    }
    if (views > 0) {
        fs::rename(whole, file);
    } else {
        fs::remove(file);
    }
    fs::remove(part);
    return views;
}

}  // namespace riftmap
