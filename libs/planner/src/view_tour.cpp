// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/planner/view_tour.h"

#include <algorithm>
#include <limits>
#include <span>

#include "lazy_greatest.h"
#include "riftmap/core/parallel.h"

namespace riftmap {

namespace {

constexpr double kNever = std::numeric_limits<double>::infinity();

/// Cheapest place for one more stop in an open tour.
struct Insertion {
    std::size_t position = 0;
    double detour = kNever;  ///< [m]
};

Insertion cheapestInsertion(const std::vector<TourView>& views, const WayLength& between,
                            const std::vector<std::size_t>& tour, std::size_t view) {
    Insertion best;
    for (std::size_t i = 0; i <= tour.size(); ++i) {
        const auto to = [&](std::size_t v) {
            return i == 0 ? views[v].fromStart : between(tour[i - 1], v);
        };
        double detour = to(view);
        if (i < tour.size()) {
            detour += between(view, tour[i]) - to(tour[i]);
        }
        if (detour < best.detour) {
            best = {i, detour};
        }
    }
    return best;
}

/// What a metre costs while `missing` of the tour's whole gain is still to be seen.
double weightOf(double missing, double whole, const TourOptions& options) {
    const double all = whole + options.settled;
    return options.tail + (all > 0 ? missing / all : 0.0);
}

/// Gain of every subset of the stops; bit i of the index stands for stops[i].
std::vector<double> gainsOfSubsets(const std::vector<TourView>& views,
                                   const std::vector<float>& worth,
                                   const std::vector<std::size_t>& stops) {
    std::vector<double> gains(std::size_t{1} << stops.size(), 0.0);
    const auto extend = [&](const auto& self, const SeenItems& seen, std::size_t set,
                            std::size_t first) -> void {
        for (std::size_t i = first; i < stops.size(); ++i) {
            SeenItems more = seen;
            const std::size_t larger = set | std::size_t{1} << i;
            gains[larger] = gains[set] + more.add(views[stops[i]]);
            self(self, more, larger, i + 1);
        }
    };
    extend(extend, SeenItems(worth), 0, 0);
    return gains;
}

/// Order of the stops with least tourCost(), by dynamic programming over subsets.
std::vector<std::size_t> bestOrder(const std::vector<TourView>& views,
                                   const std::vector<float>& worth, const WayLength& between,
                                   const TourOptions& options,
                                   const std::vector<std::size_t>& stops) {
    const std::size_t n = stops.size();
    const std::size_t all = (std::size_t{1} << n) - 1;
    const std::vector<double> gains = gainsOfSubsets(views, worth, stops);
    const auto weight = [&](std::size_t seen) {
        return weightOf(gains[all] - gains[seen], gains[all], options);
    };
    std::vector<double> way(n * n);
    for (std::size_t i = 0; i < n * n; ++i) {
        way[i] = between(stops[i / n], stops[i % n]);
    }
    // cost[set * n + last]: of the cheapest order of a set that ends there.
    std::vector<double> cost((all + 1) * n, kNever);
    std::vector<std::uint8_t> before((all + 1) * n, 0);
    for (std::size_t set = 1; set <= all; ++set) {
        for (std::size_t last = 0; last < n; ++last) {
            if ((set >> last & 1U) == 0) {
                continue;
            }
            const std::size_t rest = set & ~(std::size_t{1} << last);
            double& best = cost[set * n + last];
            if (rest == 0) {
                best = weight(0) * (options.viewCost + views[stops[last]].fromStart);
            }
            for (std::size_t from = 0; from < n; ++from) {
                const double c = cost[rest * n + from] +
                                 weight(rest) * (options.viewCost + way[from * n + last]);
                if ((rest >> from & 1U) != 0 && c < best) {
                    best = c;
                    before[set * n + last] = static_cast<std::uint8_t>(from);
                }
            }
        }
    }
    const auto end = cost.begin() + static_cast<std::ptrdiff_t>(all * n);
    auto last =
        static_cast<std::size_t>(std::min_element(end, end + static_cast<std::ptrdiff_t>(n)) - end);
    std::vector<std::size_t> order;
    for (std::size_t set = all; set != 0;) {
        order.push_back(stops[last]);
        const std::size_t from = before[set * n + last];
        set &= ~(std::size_t{1} << last);
        last = from;
    }
    std::reverse(order.begin(), order.end());
    return order;
}

/// Picks one view after the other; what is not certain of their sights is settled as far as that
/// takes.
class Picker {
 public:
    Picker(std::vector<TourView>& views, const std::vector<float>& worth, const WayLength& between,
           const TourOptions& options, const SightsSettle& settle)
        : views_(&views),
          between_(&between),
          options_(options),
          settle_(&settle),
          seen_(worth),
          left_(settle ? options.maxSettled : 0),
          gains_(views.size()) {
        parallelForEach(views.size(), 16, [&](std::size_t v) { gains_[v] = seen_.gain(views[v]); });
    }

    /// Puts the view that is worth most for its cost into the tour; false if none is worth it.
    bool pick(std::vector<std::size_t>& stops) {
        std::vector<Insertion> places(views_->size());
        std::vector<double> costs(views_->size());
        // What a view adds only shrinks as others are picked: the last value is an upper bound.
        std::vector<double> utilities(views_->size(), 0.0);
        parallelForEach(views_->size(), 16, [&](std::size_t v) {
            if (gains_[v] > options_.minGain) {
                places[v] = cheapestInsertion(*views_, *between_, stops, v);
                costs[v] = options_.viewCost + std::max(0.0, places[v].detour);
                utilities[v] = gains_[v] / costs[v];
            }
        });
        const std::size_t best = greatestOf(utilities, [&](std::span<const std::size_t> some) {
            leaveOutWhatIsTooMany(some);
            parallelForEach(some.size(), 1, [&](std::size_t i) {
                const std::size_t v = some[i];
                TourView& view = (*views_)[v];
                if (!view.uncertain.empty()) {
                    (*settle_)(v, view);
                }
                gains_[v] = seen_.gain(view);
                utilities[v] = gains_[v] > options_.minGain ? gains_[v] / costs[v] : 0.0;
            });
        });
        if (best == views_->size()) {
            return false;
        }
        seen_.add((*views_)[best]);
        gains_[best] = 0;  // the same view once more shows nothing new
        stops.insert(stops.begin() + static_cast<std::ptrdiff_t>(places[best].position), best);
        return true;
    }

 private:
    void leaveOutWhatIsTooMany(std::span<const std::size_t> some) {
        for (const std::size_t v : some) {
            TourView& view = (*views_)[v];
            if (view.uncertain.empty()) {
                continue;
            }
            if (left_ > 0) {
                --left_;
            } else {
                settleSights(view.sights, view.uncertain, [](const Sight&) { return false; });
            }
        }
    }

    std::vector<TourView>* views_;
    const WayLength* between_;
    TourOptions options_;
    const SightsSettle* settle_;
    SeenItems seen_;
    std::size_t left_;           ///< views that may still be settled
    std::vector<double> gains_;  ///< at most, of views not picked
};

}  // namespace

double SeenItems::gain(const TourView& view) const {
    double sum = 0;
    for (const Sight& s : view.sights) {
        const float missing = 1.0F - seen_[s.item];
        sum += static_cast<double>((*worth_)[s.item] * std::min(missing, s.share));
    }
    return sum;
}

double SeenItems::add(const TourView& view) {
    const double sum = gain(view);
    for (const Sight& s : view.sights) {
        seen_[s.item] = std::min(1.0F, seen_[s.item] + s.share);
    }
    return sum;
}

double tourCost(const std::vector<TourView>& views, const std::vector<float>& worth,
                const WayLength& between, const TourOptions& options,
                const std::vector<std::size_t>& order) {
    SeenItems everything(worth);
    double whole = 0;
    for (const std::size_t v : order) {
        whole += everything.add(views[v]);
    }
    SeenItems seen(worth);
    double missing = whole;
    double cost = 0;
    for (std::size_t i = 0; i < order.size(); ++i) {
        const double way = i == 0 ? views[order[i]].fromStart : between(order[i - 1], order[i]);
        cost += weightOf(missing, whole, options) * (options.viewCost + way);
        missing -= seen.add(views[order[i]]);
    }
    return cost;
}

ViewTour planTour(std::vector<TourView> views, const std::vector<float>& worth,
                  const WayLength& between, const TourOptions& options,
                  const SightsSettle& settle) {
    std::vector<std::size_t> stops;
    Picker picker(views, worth, between, options, settle);
    while (stops.size() < options.maxViews && picker.pick(stops)) {
    }
    ViewTour tour;
    if (stops.empty()) {
        return tour;
    }
    tour.views = bestOrder(views, worth, between, options, stops);
    tour.cost = tourCost(views, worth, between, options, tour.views);
    SeenItems again(worth);
    for (std::size_t i = 0; i < tour.views.size(); ++i) {
        const std::size_t v = tour.views[i];
        tour.gains.push_back(again.add(views[v]));
        tour.length += i == 0 ? views[v].fromStart : between(tour.views[i - 1], v);
    }
    return tour;
}

}  // namespace riftmap
