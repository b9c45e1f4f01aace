// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

namespace riftmap {

/// A line of a diagram.
struct ReportCurve {
    std::string name;
    std::vector<double> x, y;
};

struct ReportDiagram {
    std::string title, xLabel, yLabel;
    std::vector<ReportCurve> curves;
};

/// What `report.html` shows of an exploring run. Map frame, metres.
struct ExploreReport {
    std::string title;
    std::vector<std::pair<std::string, std::string>> facts;  ///< name, value: the table
    std::vector<ReportDiagram> diagrams;
    std::vector<std::filesystem::path> pictures;  ///< PNG files, taken into the page
    std::vector<Eigen::Vector3f> points;          ///< of the map
    std::vector<std::array<std::uint8_t, 3>> colours;
    std::vector<Eigen::Vector3f> path;   ///< camera positions
    std::vector<Eigen::Vector3f> rifts;  ///< tears that are left
};

/// One page that needs no network: table, diagrams (SVG), pictures, and the map with the camera's
/// path in a view that can be turned (WebGL). Of more than `maxPoints` points every n-th is
/// shown. Atomic. Throws FileError, or std::invalid_argument where sizes do not fit.
void writeExploreReport(const std::filesystem::path& file, const ExploreReport& report,
                        std::size_t maxPoints = 150000);

}  // namespace riftmap
