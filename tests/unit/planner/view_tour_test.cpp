// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/planner/view_tour.h"

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <algorithm>
#include <atomic>
#include <numeric>
#include <random>

namespace riftmap {
namespace {

/// Views at random places in the plane, each of which sees some of the items a little or in full.
struct Scene {
    explicit Scene(unsigned seed, std::size_t viewCount, std::size_t itemCount = 40) {
        std::mt19937 random(seed);
        const auto uniform = [&] { return static_cast<double>(random()) / 4294967296.0; };
        for (std::size_t i = 0; i < itemCount; ++i) {
            worth.push_back(static_cast<float>(0.1 + uniform()));
        }
        for (std::size_t v = 0; v < viewCount; ++v) {
            places.emplace_back(4 * uniform(), 4 * uniform());
            TourView view;
            view.fromStart = places.back().norm();
            for (std::uint32_t i = 0; i < itemCount; ++i) {
                if (uniform() < 0.3) {
                    view.sights.push_back({i, static_cast<float>(0.05 + 0.95 * uniform())});
                }
            }
            views.push_back(std::move(view));
        }
    }
    WayLength between() const {
        return [this](std::size_t a, std::size_t b) { return (places[a] - places[b]).norm(); };
    }
    /// The definition, word by word.
    double cost(const TourOptions& options, const std::vector<std::size_t>& order) const {
        const auto seen = [&](std::size_t count) {
            double sum = 0;
            for (std::uint32_t i = 0; i < worth.size(); ++i) {
                double share = 0;
                for (std::size_t k = 0; k < count; ++k) {
                    for (const Sight& s : views[order[k]].sights) {
                        share += s.item == i ? static_cast<double>(s.share) : 0.0;
                    }
                }
                sum += static_cast<double>(worth[i]) * std::min(1.0, share);
            }
            return sum;
        };
        const double whole = seen(order.size());
        double sum = 0;
        for (std::size_t k = 0; k < order.size(); ++k) {
            const double way = k == 0 ? views[order[0]].fromStart
                                      : (places[order[k - 1]] - places[order[k]]).norm();
            sum += ((whole - seen(k)) / (whole + options.settled) + options.tail) *
                   (options.viewCost + way);
        }
        return sum;
    }

    std::vector<Eigen::Vector2d> places;
    std::vector<TourView> views;
    std::vector<float> worth;
};

TEST(ViewTour, CostIsTheAreaOverTheCurve) {
    const Scene scene(7, 5);
    TourOptions options;
    options.tail = 0.3;
    options.settled = 1.7;
    const std::vector<std::size_t> order = {3, 0, 4, 1};
    EXPECT_NEAR(tourCost(scene.views, scene.worth, scene.between(), options, order),
                scene.cost(options, order), 1e-4);
}

TEST(ViewTour, NoOrderIsCheaper) {
    for (unsigned seed = 0; seed < 12; ++seed) {
        const Scene scene(seed, 30);
        TourOptions options;
        options.maxViews = 6;
        options.tail = seed % 3 == 0 ? 0.0 : 0.4;
        options.settled = seed % 2 == 0 ? 0.0 : 3.0;
        const ViewTour tour = planTour(scene.views, scene.worth, scene.between(), options);
        ASSERT_EQ(tour.views.size(), 6U);
        EXPECT_NEAR(tour.cost, scene.cost(options, tour.views), 1e-4) << "seed " << seed;
        std::vector<std::size_t> order = tour.views;
        std::sort(order.begin(), order.end());
        do {
            ASSERT_LE(tour.cost, scene.cost(options, order) + 1e-4) << "seed " << seed;
        } while (std::next_permutation(order.begin(), order.end()));
    }
}

/// Gain and detour of every view, anew for every pick; ascending.
std::vector<std::size_t> slowPick(const Scene& scene, const TourOptions& options) {
    std::vector<std::size_t> tour;
    SeenItems seen(scene.worth);
    const auto length = [&](const std::vector<std::size_t>& t) {
        double sum = t.empty() ? 0.0 : scene.views[t[0]].fromStart;
        for (std::size_t i = 1; i < t.size(); ++i) {
            sum += (scene.places[t[i - 1]] - scene.places[t[i]]).norm();
        }
        return sum;
    };
    while (tour.size() < options.maxViews) {
        double best = 0;
        std::vector<std::size_t> next;
        std::size_t pick = 0;
        for (std::size_t v = 0; v < scene.views.size(); ++v) {
            if (std::find(tour.begin(), tour.end(), v) != tour.end()) {
                continue;
            }
            const double gain = seen.gain(scene.views[v]);
            double shortest = 1e9;
            std::vector<std::size_t> where;
            for (std::size_t i = 0; i <= tour.size(); ++i) {
                std::vector<std::size_t> t = tour;
                t.insert(t.begin() + static_cast<std::ptrdiff_t>(i), v);
                if (length(t) < shortest) {
                    shortest = length(t);
                    where = t;
                }
            }
            const double utility = gain / (options.viewCost + shortest - length(tour));
            if (gain > options.minGain && utility > best + 1e-12) {
                best = utility;
                next = where;
                pick = v;
            }
        }
        if (best == 0) {
            break;
        }
        seen.add(scene.views[pick]);
        tour = next;
    }
    std::sort(tour.begin(), tour.end());
    return tour;
}

TEST(ViewTour, PicksAsTheSlowGreedyDoes) {
    for (unsigned seed = 100; seed < 160; ++seed) {
        const Scene scene(seed, seed < 120 ? 60 : 5 + seed % 16);
        TourOptions options;
        options.minGain = seed < 120 ? 0.5 : 0.1;
        options.maxViews = seed < 120 ? 7 : 10;
        std::vector<std::size_t> a =
            planTour(scene.views, scene.worth, scene.between(), options).views;
        std::sort(a.begin(), a.end());
        EXPECT_EQ(a, slowPick(scene, options)) << "seed " << seed;
    }
}

TEST(ViewTour, GainsAddUpAndWhatWasSeenCountsNoMore) {
    // Two views of the same item, one of another: the second of the same brings nothing.
    const std::vector<float> worth = {2.0F, 1.0F};
    const std::vector<TourView> views = {
        {{{0, 1.0F}}, 1.0}, {{{0, 0.9F}}, 0.5}, {{{1, 0.5F}}, 3.0}};
    const WayLength between = [](std::size_t, std::size_t) { return 1.0; };
    TourOptions options;
    options.minGain = 0.25;
    const ViewTour tour = planTour(views, worth, between, options);
    ASSERT_EQ(tour.views.size(), 2U);
    EXPECT_EQ(tour.views[0], 1U);  // nearer, and nearly as good
    EXPECT_EQ(tour.views[1], 2U);
    EXPECT_NEAR(tour.gains[0], 1.8, 1e-5);
    EXPECT_NEAR(tour.gains[1], 0.5, 1e-5);
    EXPECT_NEAR(tour.length, 1.5, 1e-9);
    // Shares add up to the whole at most.
    SeenItems seen(worth);
    EXPECT_NEAR(seen.add(views[1]), 1.8, 1e-5);
    EXPECT_NEAR(seen.add(views[0]), 0.2, 1e-5);
    EXPECT_NEAR(seen.add(views[0]), 0.0, 1e-6);
}

TEST(ViewTour, LargeGainsComeFirstAndRemainsOnTheShortestWay) {
    // A view beside the camera with a little to see, one far off with much.
    const std::vector<float> worth = {1.0F, 9.0F};
    const std::vector<TourView> views = {{{{0, 1.0F}}, 1.0}, {{{1, 1.0F}}, 2.0}};
    const WayLength between = [](std::size_t, std::size_t) { return 3.0; };
    TourOptions options;
    options.viewCost = 0.5;
    EXPECT_EQ(planTour(views, worth, between, options).views, (std::vector<std::size_t>{1, 0}));
    options.settled = 1000;  // the same ten square metres where a thousand are known
    EXPECT_EQ(planTour(views, worth, between, options).views, (std::vector<std::size_t>{0, 1}));
}

TEST(ViewTour, EmptyWhereNothingIsWorthAView) {
    const Scene scene(5, 20);
    TourOptions options;
    options.minGain = 1e3;
    EXPECT_TRUE(planTour(scene.views, scene.worth, scene.between(), options).views.empty());
    EXPECT_TRUE(planTour({}, scene.worth, scene.between(), options).views.empty());
}

/// Views of which some sights are uncertain, and what is true of them.
struct UncertainScene : Scene {
    UncertainScene(unsigned seed, std::size_t viewCount) : Scene(seed, viewCount) {
        std::mt19937 random(seed);
        for (TourView& view : views) {
            for (std::uint32_t i = 0; i < view.sights.size(); ++i) {
                if (random() % 4 > 0) {
                    view.uncertain.push_back(i);
                }
            }
        }
    }
    static bool isTrue(std::size_t index, const Sight& s) {
        return (std::size_t{7} * s.item + index) % 3 > 0;
    }
    static void settle(std::size_t index, TourView& view) {
        settleSights(view.sights, view.uncertain, [&](const Sight& s) { return isTrue(index, s); });
    }
    /// With nothing but what is true of the first views, and what is certain of the others.
    Scene settled(std::size_t first) const {
        Scene scene = *this;
        for (std::size_t v = 0; v < views.size(); ++v) {
            TourView& view = scene.views[v];
            view.sights.clear();
            view.uncertain.clear();
            for (std::uint32_t i = 0; i < views[v].sights.size(); ++i) {
                const auto& u = views[v].uncertain;
                const bool certain = std::find(u.begin(), u.end(), i) == u.end();
                if (certain || (v < first && isTrue(v, views[v].sights[i]))) {
                    view.sights.push_back(views[v].sights[i]);
                }
            }
        }
        return scene;
    }
};

TEST(ViewTour, OfUncertainViewsIsThatOfTheSameSettledBefore) {
    std::size_t asked = 0;
    std::size_t all = 0;
    for (unsigned seed = 200; seed < 260; ++seed) {
        SCOPED_TRACE("seed " + std::to_string(seed));
        const UncertainScene scene(seed, seed % 2 == 0 ? 80 : 12);
        TourOptions options;
        options.maxViews = seed % 2 == 0 ? 3 : 10;
        options.minGain = 0.2;
        std::vector<std::atomic<int>> times(scene.views.size());
        const ViewTour tour = planTour(scene.views, scene.worth, scene.between(), options,
                                       [&](std::size_t v, TourView& view) {
                                           ++times[v];
                                           UncertainScene::settle(v, view);
                                       });
        const Scene settled = scene.settled(scene.views.size());
        const ViewTour eager = planTour(settled.views, scene.worth, scene.between(), options);
        EXPECT_EQ(tour.views, eager.views);
        EXPECT_EQ(tour.gains, eager.gains);
        std::vector<std::size_t> a = tour.views;
        std::sort(a.begin(), a.end());
        EXPECT_EQ(a, slowPick(settled, options));
        for (const auto& t : times) {
            EXPECT_LE(t, 1);
            asked += seed % 2 == 0 ? static_cast<std::size_t>(t) : 0;
        }
        all += seed % 2 == 0 ? times.size() : 0;
    }
    EXPECT_LT(asked, all);
}

TEST(ViewTour, SettlesNoMoreViewsThanItMayAndGoesByWhatIsCertainOfTheOthers) {
    const UncertainScene scene(300, 80);
    TourOptions options;
    options.maxViews = 10;
    options.maxSettled = 13;
    std::atomic<std::size_t> asked = 0;
    const ViewTour tour = planTour(scene.views, scene.worth, scene.between(), options,
                                   [&](std::size_t v, TourView& view) {
                                       ++asked;
                                       UncertainScene::settle(v, view);
                                   });
    EXPECT_EQ(asked, 13U);
    EXPECT_EQ(tour.views.size(), 10U);
    options.maxSettled = 0;
    const auto never = [](std::size_t, TourView&) { FAIL(); };
    std::vector<std::size_t> a =
        planTour(scene.views, scene.worth, scene.between(), options, never).views;
    std::sort(a.begin(), a.end());
    EXPECT_EQ(a, slowPick(scene.settled(0), options));
}

}  // namespace
}  // namespace riftmap
