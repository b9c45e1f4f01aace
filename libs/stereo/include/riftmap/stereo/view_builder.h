// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>

#include "riftmap/core/view.h"
#include "riftmap/stereo/facet_filter.h"
#include "riftmap/stereo/stereo_matcher.h"
#include "riftmap/stereo/stereo_options.h"

namespace riftmap {

/// Turns observations into views: matches the pair, or takes the disparity the observation brings.
/// Keeps buffers from frame to frame: one object is used by one thread at a time.
class ViewBuilder {
 public:
    explicit ViewBuilder(const StereoOptions& options);

    /// A disparity that the observation brings is taken, whatever the matcher: where it has no
    /// sigma, that of the options ([Stereo] sigma_d) is filled in, and noise that is independent
    /// from pixel to pixel is smoothed (FacetFilter, [Stereo] facet_radius). Throws
    /// std::invalid_argument where neither images nor disparity are usable, where the matcher is
    /// `given` and no disparity is there, or where sizes do not agree with the camera's.
    View build(const StereoObservation& observation);

 private:
    StereoOptions options_;
    std::unique_ptr<StereoMatcher> matcher_;
    FacetFilter facets_;
};

}  // namespace riftmap
