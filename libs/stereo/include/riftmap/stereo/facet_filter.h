// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "riftmap/core/view.h"

namespace riftmap {

/// Takes noise that is independent from pixel to pixel out of disparities that were measured pixel
/// by pixel (a depth camera's, a simulator's). A matcher's windows average by themselves: its
/// errors are common to neighbours.
///
/// The facet model (Haralick and Watson, "A facet model for image data", 1981): around a pixel the
/// disparity is a quadratic function of row and column. It is fitted by least squares to the
/// (2 radius + 1)^2 pixels around; its value in the middle is the new disparity. Where they do not
/// all match, or where a chi-squared test says that they are no such facet (a step, an outlier,
/// finer shape), a plane through one of the nine 3 x 3 windows that hold the pixel takes its place;
/// where none of these is a facet either, the pixel stays as it is.
///
/// How much of the given variance is noise of this kind is measured in every image: the share w by
/// the median residual of planes through 3 x 3 pixels. Only that part shrinks, to what the fit
/// leaves of it (h, of a pixel's variance); what is common to neighbours stays, and residuals
/// beyond chance are added (e): sigma'^2 = sigma^2 (w (h + e) + 1 - w).
/// A pixel's sigma stands for its whole window: where sigma differs much from pixel to pixel, that
/// of the better ones comes out too small.
///
/// A few hundred operations a pixel, rows in parallel. Same bytes for any number of threads. Keeps
/// its buffers: one object is used by one thread at a time.
class FacetFilter {
 public:
    /// `radius` [px]: 1 .. 7, or 0: nothing is done. Nor is it where sigma is at most 0.01 px (as
    /// good as exact), or where less than a tenth of the variance is independent. Pixels without a
    /// match stay without.
    void apply(DisparityImage& image, int radius);

 private:
    /// Of all windows of a size, by the pixel in their middle.
    struct Facets {
        /// Of the residuals, for each degree of freedom [px^2]; infinite: the window is not full.
        std::vector<float> residual;
        std::vector<float> value;        ///< of the facet in the middle [px]
        std::vector<float> column, row;  ///< slopes of a plane [px a pixel]
        int freedom = 1;                 ///< degrees of freedom of the residuals
        double inMiddle = 1;             ///< variance of `value`, of a pixel's
    };
    struct Smoothed;

    static void fit(const DisparityImage& image, int radius, bool quadratic, Facets& facets);
    double independentShare(const DisparityImage& image) const;
    Smoothed smoothed(const DisparityImage& image, int column, int row, double noise) const;
    Smoothed onPlane(const DisparityImage& image, int column, int row, double noise) const;

    Facets quadratics_, planes_;
};

}  // namespace riftmap
