// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/apps/import_program.h"

#include <cstdio>

namespace riftmap {

ImportProgram::ImportProgram()
    : Program("riftmap-import", "Turns a public stereo data set into a rawlog.",
              Config::kOptional) {}

void ImportProgram::describe(OptionTable& table) {
    kitti_.describe(table);
    pair_.describe(table);
}

void ImportProgram::arguments(CommandLine& line) {
    line.positional("FORMAT", "kitti, euroc or pair");
    line.positional("INPUT", "a folder (kitti, euroc), or the left and the right image (pair)",
                    CommandLine::Count::kMany);
    line.value("calib", 0, "FILE", calibration_,
               "calib.txt of Middlebury 2014, for a pair, in place of [Pair]");
    line.flag("external-images", 0, external_, "images as PNG files beside the rawlog");
}

void ImportProgram::run() {
    const auto& given = positionals();
    const auto& format = given[0];
    const std::size_t wanted = format == "pair" ? 2 : 1;
    if (format != "kitti" && format != "euroc" && format != "pair") {
        throw ConfigError("FORMAT is '" + format + "'; allowed: kitti, euroc, pair");
    }
    if (given.size() != wanted + 1) {
        throw ConfigError(format + " takes " + std::to_string(wanted) + " INPUT, " +
                          std::to_string(given.size() - 1) + " given");
    }
    checkMayWrite(requiredOut());
    if (!calibration_.empty()) {
        pair_ = readMiddleburyCalibration(calibration_);
    }

    RawlogWriter writer(
        out(), external_ ? RawlogWriter::Images::kExternal : RawlogWriter::Images::kEmbedded);
    if (format == "pair") {
        report = importPair(given[1], given[2], pair_, writer);
    } else {
        const auto show = progressOf("importing", "pairs");
        report = format == "kitti" ? importKitti(given[1], kitti_, writer, show)
                                   : importEuroc(given[1], writer, show);
    }
    writer.finish();

    const auto& c = report.camera;
    std::printf("%s: %zu pairs of %dx%d px, %s, baseline %.6g m, %zu poses\n",
                out().string().c_str(), report.pairs, c.width, c.height,
                report.rectified ? "rectified" : "raw", c.baseline, report.poses);
    if (report.absent > 0) {
        std::printf("%zu listed pairs left out: images, times or poses are not there\n",
                    report.absent);
    }
}

}  // namespace riftmap
