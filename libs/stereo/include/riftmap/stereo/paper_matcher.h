// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <opencv2/core/mat.hpp>

#include "riftmap/core/view.h"
#include "riftmap/stereo/stereo_matcher.h"
#include "riftmap/stereo/stereo_options.h"

namespace riftmap {

/// The paper's matcher (sections IV.A and IX.B): prefilter, sums of absolute differences over
/// several supporting windows (Hirschmueller, Innocent, Garibaldi 2002), left/right check (Fua),
/// rejection of minima that are not sharp, parabola, removal of isolated disparities.
///
/// Each stage is an option of [Stereo] and can be switched off. The same bytes for any number of
/// threads and any instruction set. Rows are matched in parallel (oneTBB, the caller's arena);
/// nothing is allocated after the first frame of a size and format, whatever it shows, but for the
/// tasks that oneTBB keeps in pools of its own and for `out` where it is not the frame before's.
class PaperMatcher : public StereoMatcher {
 public:
    /// Throws ConfigError where the window is even.
    explicit PaperMatcher(const StereoOptions& options);
    ~PaperMatcher() override;

    void compute(const cv::Mat& left, const cv::Mat& right, DisparityImage& out) override;

 private:
    struct Buffers;
    StereoOptions options_;
    std::unique_ptr<Buffers> buffers_;
};

}  // namespace riftmap
