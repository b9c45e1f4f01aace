// SPDX-License-Identifier: BSD-3-Clause
#include <mrpt/poses/CPose3DQuat.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "import_files.h"
#include "riftmap/apps/importers.h"
#include "riftmap/core/mrpt_time.h"
#include "riftmap/core/text.h"

namespace riftmap {
namespace {

namespace fs = std::filesystem;

/// One camera of the rig as its sensor.yaml tells it.
struct RawCamera {
    mrpt::img::TCamera intrinsics;
    Pose body_T_camera;
};

/// The numbers of `key: [a, b, ...]`. OpenCV's YAML reader wants a first line that half of these
/// files do not have, so the one form they use is read here.
std::vector<double> list(const std::string& yaml, const std::string& key, std::size_t count,
                         const fs::path& file) {
    const auto where = file.string() + ": " + key;
    const auto at = yaml.find(key + ":");
    const auto open = at == std::string::npos ? at : yaml.find('[', at);
    const auto close = open == std::string::npos ? open : yaml.find(']', open);
    if (close == std::string::npos) {
        throw FileError(where + ": not found");
    }
    auto numbers = numbersIn(yaml.substr(open + 1, close - open - 1), where);
    if (numbers.size() != count) {
        throw FileError(where + ": " + std::to_string(numbers.size()) + " numbers, not " +
                        std::to_string(count));
    }
    return numbers;
}

RawCamera readCamera(const fs::path& file) {
    const auto yaml = readFile(file);
    if (yaml.find("radial-tangential") == std::string::npos) {
        throw FileError(file.string() + ": distortion_model: not radial-tangential");
    }
    const auto size = list(yaml, "resolution", 2, file);
    const auto k = list(yaml, "intrinsics", 4, file);
    const auto d = list(yaml, "distortion_coefficients", 4, file);
    const auto t = list(yaml, "data", 16, file);

    RawCamera camera;
    camera.intrinsics.ncols = static_cast<std::uint32_t>(size[0]);
    camera.intrinsics.nrows = static_cast<std::uint32_t>(size[1]);
    camera.intrinsics.setIntrinsicParamsFromValues(k[0], k[1], k[2], k[3]);
    camera.intrinsics.setDistortionPlumbBob(d[0], d[1], d[2], d[3], 0);
    camera.body_T_camera = poseOfRows(t);
    if (!isValid(camera.body_T_camera)) {
        throw FileError(file.string() + ": T_BS: not a rotation and a translation");
    }
    return camera;
}

/// Time -> image file, as data.csv lists them.
std::map<std::int64_t, fs::path> readImageList(const fs::path& camera) {
    const auto file = camera / "data.csv";
    std::map<std::int64_t, fs::path> images;
    for (const auto& line : readLines(file)) {
        const auto comma = line.text.find(',');
        const auto time = toInteger(trimmed(line.text.substr(0, comma)));
        if (comma == std::string::npos || !time) {
            throw FileError(file.string() + ":" + std::to_string(line.number) +
                            ": not 'time [ns],file'");
        }
        images[*time] = camera / "data" / trimmed(line.text.substr(comma + 1));
    }
    return images;
}

/// The file with the body's poses; empty if there is none.
fs::path groundTruthFile(const fs::path& mav) {
    auto own = mav / "state_groundtruth_estimate0" / "data.csv";
    if (fs::exists(own)) {
        return own;
    }
    std::vector<fs::path> beside;
    for (const auto& entry : fs::directory_iterator(mav.parent_path())) {
        if (entry.path().extension() == ".csv") {
            beside.push_back(entry.path());
        }
    }
    return beside.size() == 1 ? beside.front() : fs::path();
}

/// Rows `time [ns], x, y, z, qw, qx, qy, qz, ...`.
std::map<std::int64_t, Pose> readGroundTruth(const fs::path& file) {
    std::map<std::int64_t, Pose> poses;
    for (const auto& line : readLines(file)) {
        const auto where = file.string() + ":" + std::to_string(line.number);
        const auto v = numbersIn(line.text, where);
        // As text: a double does not hold nanoseconds since 1970.
        const auto time = toInteger(trimmed(line.text.substr(0, line.text.find(','))));
        if (v.size() < 8 || !time) {
            throw FileError(where + ": not 'time [ns], x, y, z, qw, qx, qy, qz'");
        }
        const double norm = std::sqrt(v[4] * v[4] + v[5] * v[5] + v[6] * v[6] + v[7] * v[7]);
        if (!(std::abs(norm - 1) < 1e-3)) {
            throw FileError(where + ": a quaternion of length " + toText(norm));
        }
        const mrpt::math::CQuaternionDouble q(v[4] / norm, v[5] / norm, v[6] / norm, v[7] / norm);
        const Pose pose =
            fromMrpt(mrpt::poses::CPose3D(mrpt::poses::CPose3DQuat(v[1], v[2], v[3], q)));
        if (!isValid(pose)) {
            throw FileError(where + ": not a finite pose");
        }
        poses[*time] = pose;
    }
    return poses;
}

mrpt::obs::CObservationStereoImages rawPair(const RawCamera& left, const RawCamera& right) {
    mrpt::obs::CObservationStereoImages pair;
    pair.sensorLabel = "euroc";
    pair.hasImageRight = true;
    pair.leftCamera = left.intrinsics;
    pair.rightCamera = right.intrinsics;
    pair.cameraPose = mrpt::poses::CPose3DQuat(toMrpt(left.body_T_camera));
    pair.rightCameraPose =
        mrpt::poses::CPose3DQuat(toMrpt(left.body_T_camera.inverse() * right.body_T_camera));
    return pair;
}

}  // namespace

ImportReport importEuroc(const fs::path& folder, RawlogWriter& writer, const OnProgress& progress) {
    // With a trailing slash the parent would be the folder itself.
    const auto given = (folder / ".").lexically_normal().parent_path();
    const auto mav = fs::is_directory(given / "mav0") ? given / "mav0" : given;
    if (!fs::is_directory(mav / "cam0") || !fs::is_directory(mav / "cam1")) {
        throw FileError(folder.string() + ": no mav0/cam0 and mav0/cam1 in it");
    }
    const auto left = readCamera(mav / "cam0" / "sensor.yaml");
    const auto right = readCamera(mav / "cam1" / "sensor.yaml");
    const auto leftImages = readImageList(mav / "cam0");
    const auto rightImages = readImageList(mav / "cam1");
    const auto truth = groundTruthFile(mav);
    auto poses = truth.empty() ? std::map<std::int64_t, Pose>() : readGroundTruth(truth);

    ImportReport report;
    report.rectified = false;
    const auto common = rawPair(left, right);
    report.camera.width = static_cast<int>(common.leftCamera.ncols);
    report.camera.height = static_cast<int>(common.leftCamera.nrows);
    report.camera.baseline =
        (left.body_T_camera.inverse() * right.body_T_camera).translation.norm();

    auto pose = poses.begin();
    const auto posesUpTo = [&](std::int64_t time) {
        for (; pose != poses.end() && pose->first <= time; ++pose, ++report.poses) {
            writer.robotPose(pose->first, pose->second);
        }
    };
    std::size_t done = 0;
    for (const auto& [time, leftFile] : leftImages) {
        progress(++done, leftImages.size());
        const auto partner = rightImages.find(time);
        if (partner == rightImages.end() || !fs::exists(leftFile) || !fs::exists(partner->second)) {
            ++report.absent;
            continue;
        }
        posesUpTo(time);
        auto pair = common;
        pair.timestamp = toMrptTime(time);
        const cv::Mat l = readImage(leftFile);
        const cv::Mat r = readImage(partner->second);
        checkSameSize(l, r, leftFile, partner->second);
        pair.imageLeft = mrpt::img::CImage(l, mrpt::img::DEEP_COPY);
        pair.imageRight = mrpt::img::CImage(r, mrpt::img::DEEP_COPY);
        writer.pair(pair);
        ++report.pairs;
    }
    posesUpTo(std::numeric_limits<std::int64_t>::max());
    if (report.pairs == 0) {
        throw FileError(mav.string() + ": none of the images that data.csv lists is there");
    }
    return report;
}

}  // namespace riftmap
