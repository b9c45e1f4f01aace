// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

namespace riftmap {

/// Share, in (0, 1], of what there is to see of an item that one view shows.
struct Sight {
    std::uint32_t item;  ///< index into the items' worth
    float share;
};

/// A view that may become a stop of a tour.
struct TourView {
    std::vector<Sight> sights;  ///< each item at most once
    double fromStart = 0;       ///< length of the way to it from where the camera is [m]
    /// Ascending positions in `sights` of what it may not show after all.
    std::vector<std::uint32_t> uncertain = {};
};

/// Takes out of the sights at the uncertain positions those that keep(sight) denies.
template <class Keep>
void settleSights(std::vector<Sight>& sights, std::vector<std::uint32_t>& uncertain,
                  const Keep& keep) {
    auto next = uncertain.begin();
    std::size_t kept = 0;
    for (std::size_t i = 0; i < sights.size(); ++i) {
        const bool isUncertain = next != uncertain.end() && *next == i;
        next += isUncertain ? 1 : 0;
        if (!isUncertain || keep(sights[i])) {
            sights[kept++] = sights[i];
        }
    }
    sights.resize(kept);
    uncertain.clear();
}

struct TourOptions {
    double viewCost = 1.0;      ///< of a view, as length of path [m], > 0
    double minGain = 0.0;       ///< a view that adds no more than this is left out
    std::size_t maxViews = 10;  ///< stops at most; the order is exact: 2^n n^2 steps, n <= 16
    /// Candidates that `settle` is asked about, see planTour(); of the others nothing uncertain
    /// counts.
    std::size_t maxSettled = 190;
    /// Cost of a metre (or a view) once nothing is left to see, >= 0; while there is, the share
    /// R(k) of tourCost() is added. 0 = early gain alone counts, large = the length alone.
    double tail = 0.2;
    /// What there is to see counts against this and itself [m^2], >= 0: once little is left the
    /// order goes by the length of the way.
    double settled = 0;
};

/// Views in the order in which they are to be taken.
struct ViewTour {
    std::vector<std::size_t> views;  ///< indices of the candidates
    std::vector<double> gains;       ///< what each adds to those before it
    double length = 0;               ///< of the way through all [m]
    double cost = 0;                 ///< as tourCost() has it
};

/// What a set of views shows together: shares of an item add up, to 1 at most, times its worth.
class SeenItems {
 public:
    explicit SeenItems(const std::vector<float>& worth)
        : worth_(&worth), seen_(worth.size(), 0.0F) {}
    /// What the view would add.
    double gain(const TourView& view) const;
    /// Adds it; returns its gain.
    double add(const TourView& view);

 private:
    const std::vector<float>* worth_;
    std::vector<float> seen_;
};

/// Length of the way between two candidates [m]. Called from several threads at a time.
using WayLength = std::function<double(std::size_t, std::size_t)>;

/// Settles the uncertain sights of the candidate with this index, as settleSights() does. It is
/// called once at most for each, for several candidates at a time from several threads.
using SightsSettle = std::function<void(std::size_t, TourView&)>;

/// Cost of taking these views in this order: every stretch of path and every view is paid in
/// proportion to what was still to be seen before it, plus `tail`. With R(k) = the gain that is
/// missing before stop k over (the tour's whole gain + settled), and l(k) the way to it,
/// sum over k of (R(k) + tail) * (viewCost + l(k)): the area over the curve of what was seen.
double tourCost(const std::vector<TourView>& views, const std::vector<float>& worth,
                const WayLength& between, const TourOptions& options,
                const std::vector<std::size_t>& order);

/// Picks views that complement each other, each the best gain for its cost given those picked
/// before it (cost: view and detour), until none adds more than `minGain`; then orders them with
/// least tourCost(), exactly. Views with uncertain sights are settled before they are picked, best
/// first, `maxSettled` at most: but for that limit the tour is the one that settling all of them
/// beforehand leads to. Without `settle` nothing uncertain counts. Deterministic; time grows with
/// views * items * maxViews.
ViewTour planTour(std::vector<TourView> views, const std::vector<float>& worth,
                  const WayLength& between, const TourOptions& options,
                  const SightsSettle& settle = {});

}  // namespace riftmap
