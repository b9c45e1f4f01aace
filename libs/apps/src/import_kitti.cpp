// SPDX-License-Identifier: BSD-3-Clause
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "import_files.h"
#include "riftmap/apps/importers.h"

namespace riftmap {
namespace {

namespace fs = std::filesystem;

struct Folders {
    fs::path left, right;
    std::size_t leftRow = 0;  ///< of the left camera in the calibration
};

Folders imageFolders(const fs::path& folder) {
    for (const std::size_t row : {std::size_t{0}, std::size_t{2}}) {
        const auto left = folder / ("image_" + std::to_string(row));
        const auto right = folder / ("image_" + std::to_string(row + 1));
        if (fs::is_directory(left) && fs::is_directory(right)) {
            return {left, right, row};
        }
    }
    throw FileError(folder.string() +
                    ": neither image_0 and image_1 nor image_2 and image_3 in it");
}

std::string place(const fs::path& file, std::size_t line) {
    return file.string() + ":" + std::to_string(line);
}

/// Rows of 12 numbers, with or without a name and a colon before them.
std::vector<std::vector<double>> rowsOfTwelve(const fs::path& file) {
    std::vector<std::vector<double>> rows;
    for (const auto& line : readLines(file)) {
        const auto colon = line.text.find(':');
        const auto numbers =
            numbersIn(colon == std::string::npos ? line.text : line.text.substr(colon + 1),
                      place(file, line.number));
        if (numbers.size() != 12) {
            throw FileError(place(file, line.number) + ": " + std::to_string(numbers.size()) +
                            " numbers, not 12");
        }
        rows.push_back(numbers);
    }
    return rows;
}

StereoCamera readCamera(const fs::path& folder, std::size_t leftRow) {
    auto file = folder / "calib.txt";
    if (!fs::exists(file)) {
        file = folder / "calib_orig.txt";
    }
    const auto rows = rowsOfTwelve(file);
    if (rows.size() < leftRow + 2) {
        throw FileError(file.string() + ": no row P" + std::to_string(leftRow + 1));
    }
    const auto& left = rows[leftRow];
    const auto& right = rows[leftRow + 1];
    StereoCamera camera;
    camera.fx = left[0];
    camera.cx = left[2];
    camera.fy = left[5];
    camera.cy = left[6];
    camera.baseline = (left[3] - right[3]) / left[0];
    camera.doffs = right[2] - left[2];
    return camera;
}

/// Poses of the left camera, in the frame of the first one.
std::vector<Pose> readPoses(const fs::path& file) {
    std::vector<Pose> poses;
    for (const auto& row : rowsOfTwelve(file)) {
        poses.push_back(poseOfRows(row));
    }
    return poses;
}

std::vector<std::int64_t> readTimes(const fs::path& file, std::size_t count, double rate) {
    std::vector<std::int64_t> times;
    if (!fs::exists(file)) {
        for (std::size_t i = 0; i < count; ++i) {
            times.push_back(std::llround(static_cast<double>(i) / rate * 1e9));
        }
        return times;
    }
    for (const auto& line : readLines(file)) {
        const auto numbers = numbersIn(line.text, place(file, line.number));
        if (numbers.size() != 1) {
            throw FileError(place(file, line.number) + ": not one time");
        }
        times.push_back(std::llround(numbers[0] * 1e9));
    }
    return times;
}

std::vector<fs::path> imagesIn(const fs::path& folder) {
    std::vector<fs::path> files;
    for (const auto& entry : fs::directory_iterator(folder)) {
        if (entry.path().extension() == ".png") {
            files.push_back(entry.path());
        }
    }
    std::sort(files.begin(), files.end());
    return files;
}

/// The rotation nearest to one of six digits.
Pose orthonormal(const Pose& pose, const std::string& where) {
    const auto& r = pose.rotation;
    if (!pose.translation.allFinite() ||
        !((r * r.transpose() - Eigen::Matrix3d::Identity()).norm() < 1e-3)) {
        throw FileError(where + ": not a rotation and a translation");
    }
    Pose result = pose;
    result.rotation.col(0) = r.col(0).normalized();
    result.rotation.col(2) = r.col(0).cross(r.col(1)).normalized();
    result.rotation.col(1) = result.rotation.col(2).cross(result.rotation.col(0));
    return result;
}

}  // namespace

void KittiOptions::describe(OptionTable& table) {
    table.section("Kitti", "KITTI odometry sequences.");
    table.add("rate", rate, 0.001, 10000.0, "Hz", "Pairs a second where there is no times.txt.");
}

ImportReport importKitti(const fs::path& folder, const KittiOptions& options, RawlogWriter& writer,
                         const OnProgress& progress) {
    if (!fs::is_directory(folder)) {
        throw FileError(folder.string() + ": no such folder");
    }
    const auto folders = imageFolders(folder);
    const auto images = imagesIn(folders.left);
    const auto poses = readPoses(folder / "poses.txt");
    const auto times = readTimes(folder / "times.txt", images.size(), options.rate);
    if (images.empty()) {
        throw FileError(folders.left.string() + ": no .png images in it");
    }

    ImportReport report;
    report.camera = readCamera(folder, folders.leftRow);
    const Pose robot_T_camera = forwardCamera();
    // Image, pose and time i belong together; the shortest list decides.
    const auto count = std::min({images.size(), poses.size(), times.size()});
    for (std::size_t i = 0; i < count; ++i) {
        const auto rightFile = folders.right / images[i].filename();
        StereoObservation observation;
        observation.left = readImage(images[i]);
        observation.right = readImage(rightFile);
        checkSameSize(observation.left, observation.right, images[i], rightFile);
        report.camera.width = observation.left.cols;
        report.camera.height = observation.left.rows;
        validate(report.camera);
        observation.camera = report.camera;
        observation.time_ns = times[i];
        observation.world_T_camera =
            robot_T_camera * orthonormal(poses[i], place(folder / "poses.txt", i + 1));
        writer.write(observation, "kitti");
        ++report.pairs;
        ++report.poses;
        progress(i + 1, count);
    }
    report.absent = std::max({images.size(), poses.size(), times.size()}) - count;
    return report;
}

}  // namespace riftmap
