// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/apps/rawlog_reader.h"

#include <mrpt/maps/CSimpleMap.h>
#include <mrpt/obs/CActionCollection.h>
#include <mrpt/obs/CObservationRobotPose.h>
#include <mrpt/obs/CSensoryFrame.h>
#include <mrpt/poses/CPose3DQuat.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <opencv2/imgcodecs.hpp>
#include <utility>

#include "riftmap/apps/stored_disparity.h"
#include "riftmap/core/mrpt_time.h"
#include "riftmap/core/text.h"
#include "riftmap/core/tum.h"
#include "riftmap/stereo/rectifier.h"

namespace riftmap {
namespace {

using mrpt::obs::CObservation;
using mrpt::obs::CObservationRobotPose;
using mrpt::obs::CObservationStereoImages;
using mrpt::serialization::CSerializable;

/// The parts of an observation or file that make no sense, as a cause to be put behind a place.
class Nonsense : public std::runtime_error {
 public:
    using std::runtime_error::runtime_error;
};

std::string labelled(const CObservation& o) {
    return std::string(o.GetRuntimeClass()->className) + " '" + o.sensorLabel + "'";
}

Pose checkedPose(const mrpt::poses::CPose3D& mean, const std::string& whose) {
    const Pose pose = fromMrpt(mean);
    if (!isValid(pose)) {
        throw Nonsense("the pose of " + whose + " is not finite");
    }
    return pose;
}

/// Pose of the left camera on the robot as recorded, its quaternion checked before MRPT turns it
/// into angles.
Pose recordedCameraPose(const CObservationStereoImages& o) {
    const auto& q = o.cameraPose.quat();
    const double norm = std::sqrt(q.r() * q.r() + q.x() * q.x() + q.y() * q.y() + q.z() * q.z());
    if (!(std::abs(norm - 1.0) < 1e-3)) {
        throw Nonsense("the camera pose of " + labelled(o) + " has a quaternion of length " +
                       toText(norm));
    }
    return checkedPose(mrpt::poses::CPose3D(o.cameraPose), "the camera of " + labelled(o));
}

/// Takes a rawlog's objects apart; sees the observations of all formats in order, each with the
/// robot's pose where the file's format knows it.
class Dissector {
 public:
    /// What comes out of one object.
    struct Part {
        CObservation::Ptr observation;
        std::optional<Pose> world_T_robot;
    };

    std::vector<Part> parts(const CSerializable::Ptr& object) {
        std::vector<Part> result;
        if (auto map = std::dynamic_pointer_cast<mrpt::maps::CSimpleMap>(object)) {
            for (std::size_t i = 0; i < map->size(); ++i) {
                const auto pair = map->getAsPair(i);
                mrpt::poses::CPose3D mean;
                pair.pose->getMean(mean);
                addFrame(*pair.sf, checkedPose(mean, "keyframe " + std::to_string(i)), result);
            }
        } else if (auto actions = std::dynamic_pointer_cast<mrpt::obs::CActionCollection>(object)) {
            mrpt::poses::CPose3D step;
            if (actions->getFirstMovementEstimationMean(step)) {
                const Pose moved = checkedPose(step, "the robot's movement");
                odometry_ = odometry_ ? *odometry_ * moved : moved;
                ++actionCount_;
            }
        } else if (auto frame = std::dynamic_pointer_cast<mrpt::obs::CSensoryFrame>(object)) {
            addFrame(*frame, odometry_, result);
        } else if (auto observation = std::dynamic_pointer_cast<CObservation>(object)) {
            result.push_back({observation, std::nullopt});
        }
        return result;
    }

    std::size_t actionCount() const { return actionCount_; }

 private:
    static void addFrame(const mrpt::obs::CSensoryFrame& frame, const std::optional<Pose>& pose,
                         std::vector<Part>& result) {
        for (const auto& observation : frame) {
            result.push_back({observation, pose});
        }
    }

    std::optional<Pose> odometry_;  ///< the sum of the actions so far
    std::size_t actionCount_ = 0;
};

std::int64_t timeOf(const CObservation& o) {
    if (o.timestamp == INVALID_TIMESTAMP) {
        throw Nonsense(labelled(o) + " has no time");
    }
    return fromMrptTime(o.timestamp);
}

Pose robotPose(const CObservationRobotPose& o, RawlogOptions::PoseOf meaning) {
    const Pose pose = checkedPose(o.pose.mean, labelled(o));
    const Pose robot_T_sensor = checkedPose(o.sensorPose, "the sensor of " + labelled(o));
    const bool identity =
        robot_T_sensor.translation.norm() < 1e-9 && angleBetween(robot_T_sensor, Pose{}) < 1e-9;
    if (identity || meaning == RawlogOptions::PoseOf::kRobot) {
        return pose;
    }
    if (meaning == RawlogOptions::PoseOf::kRefuse) {
        throw ConfigError(
            labelled(o) +
            " has a sensor pose: say with Input.robot_pose_of = robot or sensor whose "
            "pose it holds");
    }
    return pose * robot_T_sensor.inverse();
}

/// Adds up what a scan sees.
class Scan {
 public:
    Scan(RawlogContents& contents, const RawlogOptions& options)
        : contents_(contents), options_(options) {}

    void add(const CSerializable::Ptr& object) {
        for (const auto& part : dissector_.parts(object)) {
            if (auto pair = std::dynamic_pointer_cast<CObservationStereoImages>(part.observation)) {
                addPair(*pair);
                if (part.world_T_robot) {
                    framePoses_.add(timeOf(*pair), *part.world_T_robot);
                }
            } else if (auto pose =
                           std::dynamic_pointer_cast<CObservationRobotPose>(part.observation)) {
                contents_.poses.add(timeOf(*pose), robotPose(*pose, options_.robotPoseOf));
            }
        }
        ++contents_.objects;
        ++contents_.classes[object->GetRuntimeClass()->className];
    }

    /// Poses of their own go before those of the frames.
    void finish() {
        if (contents_.poses.empty()) {
            contents_.poses = std::move(framePoses_);
            contents_.actions = dissector_.actionCount();
        }
    }

 private:
    void addPair(const CObservationStereoImages& pair) {
        const auto time = timeOf(pair);
        auto& sensor = contents_.sensors[pair.sensorLabel];
        if (sensor.pairs++ == 0) {
            sensor.first_ns = time;
            sensor.calibration = pair.getStereoCameraParams();
            sensor.rectified = pair.areImagesRectified();
            sensor.external = pair.imageLeft.isExternallyStored();
        }
        sensor.last_ns = time;
    }

    RawlogContents& contents_;
    const RawlogOptions& options_;
    Dissector dissector_;
    PoseTrack framePoses_;
};

cv::Mat pixels(const mrpt::img::CImage& image, const std::filesystem::path& folder) {
    cv::Mat result;
    if (image.isExternallyStored()) {
        std::filesystem::path file = image.getExternalStorageFile();
        if (file.is_relative()) {
            file = folder / file;
        }
        result = cv::imread(file.string(), cv::IMREAD_UNCHANGED);
        if (result.empty()) {
            throw Nonsense("the image " + file.string() + " cannot be read");
        }
    } else if (!image.isEmpty()) {
        result = image.asCvMatRef();
    }
    if (result.empty()) {
        throw Nonsense("an image is empty");
    }
    if (result.type() != CV_8UC1 && result.type() != CV_8UC3) {
        throw Nonsense("an image is neither 8-bit grey nor 8-bit colour");
    }
    return result;
}

}  // namespace

void RawlogOptions::describe(OptionTable& table) {
    table.section("Input", "What is taken from a rawlog or simplemap.");
    table.add("sensor", sensor, "Label of the stereo camera; empty where there is only one.");
    table.add("first_view", firstView, 0, 1'000'000'000, "", "Index of the first pair taken.");
    table.add("every_view", everyView, 1, 1'000'000, "", "Then every so many pairs.");
    table.add("max_views", maxViews, 0, 1'000'000'000, "", "At most so many pairs; 0 = all.");
    table.add("max_pose_gap", maxPoseGap, 0.0, 3600.0, "s",
              "Longest time between two recorded poses to interpolate over.");
    table.addChoice<FileOf>("poses_of", posesOf,
                            {{"camera", FileOf::kCamera}, {"robot", FileOf::kRobot}},
                            "What the poses of --poses are of: left optical frame, or robot.");
    table.addChoice<PoseOf>(
        "robot_pose_of", robotPoseOf,
        {{"refuse", PoseOf::kRefuse}, {"robot", PoseOf::kRobot}, {"sensor", PoseOf::kSensor}},
        "Whose pose a CObservationRobotPose with a sensor pose holds.");
    table.add("camera_xyz", cameraXyz, 0, "m",
              "Position of the left camera on the robot, 3 numbers; empty = as recorded.");
    table.add("camera_ypr_deg", cameraYpr_deg, 0, "deg",
              "Yaw, pitch, roll of its optical frame, 3 numbers; empty = as recorded.");
}

RawlogContents scanRawlog(const std::filesystem::path& file, const RawlogOptions& options) {
    RawlogContents contents;
    RawlogObjects objects(file);
    Scan scan(contents, options);
    try {
        while (const auto object = objects.next()) {
            scan.add(object);
        }
    } catch (const Nonsense& e) {
        contents.damage = objects.place() + ": " + e.what();
    } catch (const RawlogError& e) {
        if (objects.count() == 0) {
            throw;
        }
        contents.damage = e.what();
    }
    scan.finish();
    return contents;
}

class RawlogReader::Impl {
 public:
    Impl(const std::filesystem::path& file, const RawlogOptions& options,
         const std::filesystem::path& posesFile)
        : file_(file),
          options_(options),
          contents_(scanRawlog(file, options)),
          objects_(file),
          images_(imagesDirectory(file)) {
        checkCameraOverride();
        chooseSensor();
        if (posesFile.empty()) {
            poses_ = contents_.poses;
        } else {
            posesOfCamera_ = options.posesOf == RawlogOptions::FileOf::kCamera;
            for (const auto& stamped : readTum(posesFile)) {
                poses_.add(stamped.time_ns, stamped.pose);
            }
        }
        if (poses_.empty()) {
            fail(file.string() +
                 ": no poses in it, neither CObservationRobotPose nor actions; "
                 "give some with --poses FILE.tum");
        }
    }

    std::optional<StereoObservation> next() {
        while (const auto pair = nextSelected()) {
            try {
                if (auto observation = convert(*pair)) {
                    return observation;
                }
            } catch (const Nonsense& e) {
                throw RawlogError(objects_.place() + ": " + e.what());
            } catch (const std::invalid_argument& e) {
                throw RawlogError(objects_.place() + ": " + e.what());
            }
        }
        return std::nullopt;
    }

    std::size_t expectedViews() const {
        const auto all = contents_.sensors.at(sensor_).pairs;
        const auto first = static_cast<std::size_t>(options_.firstView);
        const auto step = static_cast<std::size_t>(options_.everyView);
        const auto selected = all > first ? (all - first + step - 1) / step : 0;
        return options_.maxViews > 0
                   ? std::min(selected, static_cast<std::size_t>(options_.maxViews))
                   : selected;
    }

    const RawlogContents& contents() const { return contents_; }
    std::size_t withoutPose() const { return withoutPose_; }

 private:
    /// The file is unusable: the damage, where there is some, is the better explanation.
    [[noreturn]] void fail(const std::string& why) const {
        throw RawlogError(contents_.damage.empty() ? why : contents_.damage);
    }

    void checkCameraOverride() const {
        for (const auto& [key, list] : {std::pair{"camera_xyz", &options_.cameraXyz},
                                        std::pair{"camera_ypr_deg", &options_.cameraYpr_deg}}) {
            if (!list->empty() && list->size() != 3) {
                throw ConfigError(std::string("Input.") + key + ": " +
                                  std::to_string(list->size()) + " numbers; allowed: none, or 3");
            }
        }
    }

    void chooseSensor() {
        const auto& sensors = contents_.sensors;
        if (sensors.empty()) {
            fail(file_.string() + ": no stereo images in it");
        }
        std::string names;
        for (const auto& [label, sensor] : sensors) {
            names += (names.empty() ? "'" : ", '") + label + "'";
        }
        sensor_ = options_.sensor;
        if (sensor_.empty() && sensors.size() == 1) {
            sensor_ = sensors.begin()->first;
        } else if (sensors.count(sensor_) == 0) {
            throw ConfigError("Input.sensor = '" + sensor_ + "': " + file_.string() +
                              " has the stereo cameras " + names);
        }
    }

    /// The next pair of the sensor that firstView, everyView and maxViews select.
    CObservationStereoImages::Ptr nextSelected() {
        while (options_.maxViews == 0 || taken_ < static_cast<std::size_t>(options_.maxViews)) {
            const auto pair = nextPair();
            if (!pair) {
                return nullptr;
            }
            const auto first = static_cast<std::size_t>(options_.firstView);
            const auto index = index_++;
            if (index >= first &&
                (index - first) % static_cast<std::size_t>(options_.everyView) == 0) {
                ++taken_;
                return pair;
            }
        }
        return nullptr;
    }

    CObservationStereoImages::Ptr nextPair() {
        while (pending_.empty()) {
            // The scan found nonsense in the object that comes next.
            if (objects_.count() == contents_.objects && !contents_.damage.empty()) {
                throw RawlogError(contents_.damage);
            }
            const auto object = objects_.next();
            if (!object) {
                return nullptr;
            }
            for (const auto& part : dissector_.parts(object)) {
                auto pair = std::dynamic_pointer_cast<CObservationStereoImages>(part.observation);
                if (pair && pair->sensorLabel == sensor_) {
                    pending_.push_back(std::move(pair));
                }
            }
        }
        auto pair = pending_.front();
        pending_.pop_front();
        return pair;
    }

    /// Nothing where no pose is known at the pair's time.
    std::optional<StereoObservation> convert(const CObservationStereoImages& pair) {
        const auto time = timeOf(pair);
        if (time < lastTime_) {
            throw Nonsense("time runs backwards, by " +
                           toText(static_cast<double>(lastTime_ - time) * 1e-9) + " s");
        }
        lastTime_ = time;
        const auto pose = poses_.at(time, std::llround(options_.maxPoseGap * 1e9));
        if (!pose) {
            ++withoutPose_;
            return std::nullopt;
        }
        StereoObservation observation;
        observation.time_ns = time;
        const Pose robot_T_camera = cameraOnRobot(pair) * rectify(pair, observation);
        observation.world_T_camera = posesOfCamera_ ? *pose : *pose * robot_T_camera;
        return observation;
    }

    /// Pose of the raw left camera.
    Pose cameraOnRobot(const CObservationStereoImages& pair) const {
        const Pose recorded = recordedCameraPose(pair);
        const auto& xyz = options_.cameraXyz;
        const auto& ypr = options_.cameraYpr_deg;
        if (xyz.empty() && ypr.empty()) {
            return recorded;
        }
        auto pose = toMrpt(recorded);
        if (!xyz.empty()) {
            pose.x(xyz[0]);
            pose.y(xyz[1]);
            pose.z(xyz[2]);
        }
        if (!ypr.empty()) {
            constexpr double kRadians = std::numbers::pi / 180.0;
            pose.setYawPitchRoll(ypr[0] * kRadians, ypr[1] * kRadians, ypr[2] * kRadians);
        }
        return fromMrpt(pose);
    }

    /// Sets images and camera. Returns the pose of the rectified camera in the raw one.
    Pose rectify(const CObservationStereoImages& pair, StereoObservation& observation) {
        if (takeMeasured(pair, observation)) {
            return {};
        }
        if (!pair.hasImageRight) {
            throw Nonsense(labelled(pair) + " has no right image");
        }
        const cv::Mat left = pixels(pair.imageLeft, images_);
        const cv::Mat right = pixels(pair.imageRight, images_);
        RectifiedPair rectified;
        rectifier_.rectify(pair.getStereoCameraParams(), left, right, rectified);
        observation.left = rectified.left;
        observation.right = rectified.right;
        observation.camera = rectified.camera;
        validate(observation.camera);
        return rectified.raw_T_rectified;
    }

    /// A pair whose disparity was measured when it was recorded needs no right image.
    bool takeMeasured(const CObservationStereoImages& pair, StereoObservation& observation) {
        try {
            observation.disparity = loadDisparity(pair);
        } catch (const std::runtime_error& error) {
            throw Nonsense(error.what());
        }
        if (!observation.disparity) {
            return false;
        }
        if (!pair.areImagesRectified()) {
            throw Nonsense(labelled(pair) + " has disparity of images that are not rectified");
        }
        observation.left = pixels(pair.imageLeft, images_);
        const mrpt::img::TCamera& left = pair.leftCamera;
        if (observation.left.cols != static_cast<int>(left.ncols) ||
            observation.left.rows != static_cast<int>(left.nrows)) {
            throw Nonsense(labelled(pair) + ": its image does not have its calibration's size");
        }
        observation.camera = {static_cast<int>(left.ncols),
                              static_cast<int>(left.nrows),
                              left.fx(),
                              left.fy(),
                              left.cx(),
                              left.cy(),
                              pair.rightCameraPose.x(),
                              pair.rightCamera.cx() - left.cx()};
        validate(observation.camera);
        return true;
    }

    std::filesystem::path file_;
    RawlogOptions options_;
    RawlogContents contents_;
    RawlogObjects objects_;
    std::filesystem::path images_;  ///< where relative external images are
    std::string sensor_;
    PoseTrack poses_;             ///< of the robot, or of the camera
    bool posesOfCamera_ = false;  ///< what poses_ are of

    Dissector dissector_;
    std::deque<CObservationStereoImages::Ptr> pending_;
    std::size_t index_ = 0, taken_ = 0, withoutPose_ = 0;
    std::int64_t lastTime_ = std::numeric_limits<std::int64_t>::min();
    Rectifier rectifier_;
};

RawlogReader::RawlogReader(const std::filesystem::path& file, const RawlogOptions& options,
                           const std::filesystem::path& posesFile)
    : impl_(std::make_unique<Impl>(file, options, posesFile)) {}
RawlogReader::~RawlogReader() = default;
RawlogReader::RawlogReader(RawlogReader&&) noexcept = default;
RawlogReader& RawlogReader::operator=(RawlogReader&&) noexcept = default;

std::optional<StereoObservation> RawlogReader::next() {
    return impl_->next();
}
std::size_t RawlogReader::expectedViews() const {
    return impl_->expectedViews();
}
std::size_t RawlogReader::withoutPose() const {
    return impl_->withoutPose();
}
const RawlogContents& RawlogReader::contents() const {
    return impl_->contents();
}

}  // namespace riftmap
