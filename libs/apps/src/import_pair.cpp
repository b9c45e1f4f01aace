// SPDX-License-Identifier: BSD-3-Clause

#include "import_files.h"
#include "riftmap/apps/importers.h"
#include "riftmap/core/text.h"

namespace riftmap {
namespace {

namespace fs = std::filesystem;

/// The text behind `key=` in a calib.txt.
std::string valueOf(const std::vector<TextLine>& lines, const std::string& key,
                    const fs::path& file) {
    for (const auto& line : lines) {
        const auto equals = line.text.find('=');
        if (equals != std::string::npos && trimmed(line.text.substr(0, equals)) == key) {
            auto value = trimmed(line.text.substr(equals + 1));
            if (!value.empty() && value.front() == '[' && value.back() == ']') {
                value = value.substr(1, value.size() - 2);
            }
            return value;
        }
    }
    throw FileError(file.string() + ": no " + key);
}

}  // namespace

void PairOptions::describe(OptionTable& table) {
    table.section("Pair", "Calibration of one rectified pair of images.");
    table.add("f", f, 0.0, 1e6, "px", "Focal length.");
    table.add("cx", cx, -1e6, 1e6, "px", "Column of the left camera's principal point.");
    table.add("cy", cy, -1e6, 1e6, "px", "Row of the principal points.");
    table.add("doffs", doffs, -1e6, 1e6, "px", "Right principal point minus left one.");
    table.add("baseline", baseline, 0.0, 1e3, "m", "Distance between the cameras.");
}

PairOptions readMiddleburyCalibration(const fs::path& file) {
    const auto lines = readLines(file);
    const auto number = [&](const std::string& key) {
        const auto value = toDouble(valueOf(lines, key, file));
        if (!value) {
            throw FileError(file.string() + ": " + key + ": not a number");
        }
        return *value;
    };
    const auto cam0 = numbersIn(valueOf(lines, "cam0", file), file.string() + ": cam0");
    if (cam0.size() != 9) {
        throw FileError(file.string() + ": cam0: not 9 numbers");
    }
    PairOptions options;
    options.f = cam0[0];
    options.cx = cam0[2];
    options.cy = cam0[5];
    options.doffs = number("doffs");
    options.baseline = number("baseline") * 1e-3;
    return options;
}

ImportReport importPair(const fs::path& left, const fs::path& right, const PairOptions& options,
                        RawlogWriter& writer) {
    if (options.f <= 0 || options.baseline <= 0) {
        throw ConfigError(
            "the pair's calibration: give --calib FILE, or Pair.f, Pair.cx, Pair.cy and "
            "Pair.baseline (see config/cameras)");
    }
    StereoObservation observation;
    observation.left = readImage(left);
    observation.right = readImage(right);
    checkSameSize(observation.left, observation.right, left, right);
    auto& camera = observation.camera;
    camera.width = observation.left.cols;
    camera.height = observation.left.rows;
    camera.fx = camera.fy = options.f;
    camera.cx = options.cx;
    camera.cy = options.cy;
    camera.doffs = options.doffs;
    camera.baseline = options.baseline;
    validate(camera);
    observation.world_T_camera = forwardCamera();
    writer.write(observation, "pair");

    ImportReport report;
    report.pairs = report.poses = 1;
    report.camera = camera;
    return report;
}

}  // namespace riftmap
