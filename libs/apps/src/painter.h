// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

#include "riftmap/core/pose.h"

namespace riftmap {

/// A pinhole camera that draws into an image, with a depth buffer, at twice the size of the result
/// so that points and lines come out smooth. Colours are BGR.
class Painter {
 public:
    /// @param focal [px of the result]
    Painter(int width, int height, const Pose& world_T_view, double focal);

    /// A square that faces the viewer. `size` is its side [m]; at least a pixel is drawn.
    void point(const Eigen::Vector3d& p, double size, const cv::Scalar& colour);
    /// A filled triangle, of one colour.
    void triangle(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c,
                  const cv::Scalar& colour);
    /// A line hidden by what is nearer by more than `slack` [m].
    void line(const Eigen::Vector3d& a, const Eigen::Vector3d& b, double thickness,
              const cv::Scalar& colour, double slack);

    // These are drawn over everything, with a white rim, thickness in pixels of the result.
    void overlayLine(const Eigen::Vector3d& a, const Eigen::Vector3d& b, double thickness,
                     const cv::Scalar& colour);
    void overlayArrow(const Eigen::Vector3d& from, const Eigen::Vector3d& to, double thickness,
                      const cv::Scalar& colour);
    /// The pyramid of a camera, `size` deep [m].
    void overlayCamera(const Pose& world_T_camera, double size, double thickness,
                       const cv::Scalar& colour);
    /// White text on a dark strip at the bottom.
    void caption(const std::string& text);

    /// Metres at depth z that one pixel of the result covers.
    double metresPerPixel(const Eigen::Vector3d& p) const;
    cv::Mat result() const;

 private:
    /// x, y [px of the canvas], z [m]; z <= 0 behind the viewer.
    Eigen::Vector3d project(const Eigen::Vector3d& p) const;
    bool clip(Eigen::Vector3d& a, Eigen::Vector3d& b) const;
    void set(int x, int y, double z, const cv::Vec3b& bgr);
    void stroke(const Eigen::Vector3d& a, const Eigen::Vector3d& b, double thickness,
                const cv::Scalar& colour);

    Pose view_T_world_;
    double focal_;  ///< [px of the canvas]
    cv::Mat canvas_, depth_;
};

}  // namespace riftmap
