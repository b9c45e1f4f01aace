// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/eval/baselines.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>

#include "riftmap/eval/coverage.h"
#include "shapes.h"

namespace riftmap {
namespace {

/// A world with an ideal depth camera in it, and a loop that follows a view source.
class Loop {
 public:
    Loop(TriangleMesh mesh, const Eigen::AlignedBox3d& box, const Eigen::Vector3d& start)
        : mesh_(std::move(mesh)), caster_(mesh_) {
        camera_.width = 80;
        camera_.height = 60;
        camera_.fx = camera_.fy = 65;
        camera_.cx = 39.5;
        camera_.cy = 29.5;
        camera_.baseline = 0.12;
        limits_.boxMin = box.min();
        limits_.boxMax = box.max();
        limits_.nearLimit = 0.4;
        limits_.farLimit = 6;
        limits_.clearance = 0.15;
        pose_ = lookAt(start, box.center());
    }

    /// Follows the source; every way must be clear and in the box.
    void run(ViewSource& source, int maxViews) {
        look();
        while (static_cast<int>(views_.size()) < maxViews) {
            const auto path = source.next(state());
            if (!path) {
                ended_ = true;
                return;
            }
            ASSERT_FALSE(path->empty());
            for (const Pose& p : *path) {
                ASSERT_TRUE(isValid(p));
                ASSERT_TRUE(clear(pose_.translation, p.translation));
                metres_ += (p.translation - pose_.translation).norm();
                pose_ = p;
            }
            look();
        }
    }

    CoverageJudge judge(double delta) const {
        EvalOptions options;
        options.samples = 5000;
        options.deltas = {delta};
        options.headline = delta;
        const Eigen::Vector3d start = views_.empty() ? pose_.translation : views_[0].translation;
        return {mesh_, caster_, viewSpaceOf(limits_, camera_, start), options};
    }
    double coverage(double delta) const { return judge(delta).coverage(map_)[0].cObs; }
    /// After every view.
    std::vector<double> curve(double delta) const {
        const CoverageJudge judge = this->judge(delta);
        std::vector<double> curve;
        for (const std::size_t end : mapSizes_) {
            curve.push_back(judge.coverage(std::span(map_).first(end))[0].cObs);
        }
        return curve;
    }
    const RayCaster& caster() const { return caster_; }
    const std::vector<Pose>& views() const { return views_; }
    bool ended() const { return ended_; }
    double metres() const { return metres_; }
    PlatformLimits& limits() { return limits_; }

 private:
    bool clear(const Eigen::Vector3d& a, const Eigen::Vector3d& b) const {
        const Eigen::AlignedBox3d box(limits_.boxMin, limits_.boxMax);
        return box.contains(b) && caster_.sweptClear(a, b, limits_.clearance);
    }
    BaselineState state() const {
        return {pose_, camera_, limits_, cloud_,
                [this](const Eigen::Vector3d& a, const Eigen::Vector3d& b) { return clear(a, b); }};
    }
    void look() {
        cloud_.clear();
        for (int r = 0; r < camera_.height; ++r) {
            for (int c = 0; c < camera_.width; ++c) {
                const Eigen::Vector3d d((c - camera_.cx) / camera_.fx,
                                        (r - camera_.cy) / camera_.fy, 1);
                const auto hit = caster_.cast(pose_.translation, pose_.rotation * d, 6.0);
                if (hit && hit->t > limits_.nearLimit) {
                    cloud_.push_back((pose_ * Eigen::Vector3d(hit->t * d)).cast<float>());
                }
            }
        }
        map_.insert(map_.end(), cloud_.begin(), cloud_.end());
        views_.push_back(pose_);
        mapSizes_.push_back(map_.size());
    }

    TriangleMesh mesh_;
    RayCaster caster_;
    StereoCamera camera_;
    PlatformLimits limits_;
    Pose pose_;
    std::vector<Eigen::Vector3f> cloud_, map_;
    std::vector<Pose> views_;
    std::vector<std::size_t> mapSizes_;  ///< after each view
    double metres_ = 0;
    bool ended_ = false;
};

Loop roomLoop() {
    TriangleMesh room = shapes::box({0, 0, 0}, {4, 3, 2.5F}, true);
    append(room, shapes::box({2, 1, 0}, {3, 2, 1}));
    return {room, Eigen::AlignedBox3d(Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(4, 3, 2.5)),
            Eigen::Vector3d(0.8, 0.8, 1.2)};
}

Loop sphereLoop() {
    return {shapes::sphere(0.5, 40),
            Eigen::AlignedBox3d(Eigen::Vector3d(-2, -2, -2), Eigen::Vector3d(2, 2, 2)),
            Eigen::Vector3d(1.6, 0, 0)};
}

const Eigen::AlignedBox3d kSphereBox(Eigen::Vector3d(-0.5, -0.5, -0.5),
                                     Eigen::Vector3d(0.5, 0.5, 0.5));
const Eigen::AlignedBox3d kNoTarget;

TEST(Baselines, FrontierCoversTheRoomAndEnds) {
    Loop loop = roomLoop();
    loop.run(*makeBaseline("octomap_frontier", {}, kNoTarget, 1), 60);
    EXPECT_TRUE(loop.ended());
    EXPECT_GT(loop.coverage(0.1), 0.97) << loop.views().size() << " views";
}

/// Number of views until so much is covered; 1000 if it never is.
std::size_t viewsTo(const std::vector<double>& curve, double coverage) {
    const auto it =
        std::find_if(curve.begin(), curve.end(), [&](double c) { return c >= coverage; });
    return it == curve.end() ? 1000 : static_cast<std::size_t>(it - curve.begin()) + 1;
}

TEST(Baselines, WithForesightFewViewsCoverTheRoomTheLargestFirst) {
    Loop loop = roomLoop();
    const CoverageJudge judge = loop.judge(0.1);
    BaselineOptions options;
    options.poses = 3000;
    loop.run(*makeForesight(judge, loop.caster(), options, 1), 100);
    EXPECT_TRUE(loop.ended());
    const std::vector<double> curve = loop.curve(0.1);
    EXPECT_GT(curve.back(), 0.995) << curve.size() << " views";
    for (const char* name : {"random", "octomap_frontier"}) {
        Loop other = roomLoop();
        other.run(*makeBaseline(name, {}, kNoTarget, 1), 60);
        EXPECT_LT(viewsTo(curve, 0.9), viewsTo(other.curve(0.1), 0.9)) << name;
    }
    // What is picked by its gain cannot gain more later on; places it is picked by are a sample.
    for (std::size_t i = 3; i < curve.size(); ++i) {
        EXPECT_LT(curve[i] - curve[i - 1], curve[i - 1] - curve[i - 2] + 0.02) << "view " << i;
    }
}

TEST(Baselines, ForesightIsTheSameForTheSameSeedAndAnyNumberOfThreads) {
    std::vector<std::vector<Pose>> runs;
    for (const std::size_t threads : {1U, 2U}) {
        const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
        Loop loop = roomLoop();
        const CoverageJudge judge = loop.judge(0.1);
        BaselineOptions options;
        options.poses = 300;
        loop.run(*makeForesight(judge, loop.caster(), options, 5), 8);
        runs.push_back(loop.views());
    }
    ASSERT_EQ(runs[0].size(), runs[1].size());
    for (std::size_t i = 0; i < runs[0].size(); ++i) {
        EXPECT_EQ(runs[0][i].translation, runs[1][i].translation);
        EXPECT_EQ(runs[0][i].rotation, runs[1][i].rotation);
    }
}

TEST(Baselines, RandomViewsCoverTheRoomInTheEnd) {
    Loop loop = roomLoop();
    loop.run(*makeBaseline("random", {}, kNoTarget, 1), 60);
    EXPECT_GT(loop.coverage(0.1), 0.9);
}

TEST(Baselines, TheLawnMowerEndsAfterSixViewsAStop) {
    Loop loop = roomLoop();
    loop.run(*makeBaseline("lawnmower", {}, kNoTarget, 1), 100);
    EXPECT_TRUE(loop.ended());
    EXPECT_EQ(loop.views().size(), 1U + 3 * 2 * 6);
}

TEST(Baselines, TenViewsOnASphereSeeTheWholeBall) {
    Loop loop = sphereLoop();
    loop.run(*makeBaseline("sphere", {}, kSphereBox, 1), 100);
    EXPECT_TRUE(loop.ended());
    EXPECT_EQ(loop.views().size(), 11U);
    EXPECT_GT(loop.coverage(0.03), 0.98);
    EXPECT_LT(loop.metres(), 25.0);
}

TEST(Baselines, OrbitRandomAndFrontierLookAtTheTarget) {
    for (const char* name : {"orbit", "random", "octomap_frontier"}) {
        Loop loop = sphereLoop();
        loop.run(*makeBaseline(name, {}, kSphereBox, 7), 30);
        EXPECT_GT(loop.coverage(0.03), 0.75) << name << " " << loop.views().size();
    }
}

TEST(Baselines, TheSameSeedGivesTheSameViews) {
    for (const std::string& name : baselineNames()) {
        std::vector<std::vector<Pose>> runs;
        for (int i = 0; i < 2; ++i) {
            Loop loop = sphereLoop();
            loop.run(*makeBaseline(name, {}, kSphereBox, 3), 6);
            runs.push_back(loop.views());
        }
        ASSERT_EQ(runs[0].size(), runs[1].size()) << name;
        for (std::size_t i = 0; i < runs[0].size(); ++i) {
            EXPECT_EQ(runs[0][i].translation, runs[1][i].translation) << name;
            EXPECT_EQ(runs[0][i].rotation, runs[1][i].rotation) << name;
        }
    }
}

TEST(Baselines, AGroundPlatformKeepsItsHorizonAndTilt) {
    Loop loop = roomLoop();
    loop.limits().kind = PlatformLimits::Kind::kGroundPanTilt;
    loop.limits().minHeight = 1.0;
    loop.limits().maxHeight = 1.4;
    loop.limits().minTilt = -0.5;
    loop.limits().maxTilt = 0.5;
    loop.run(*makeBaseline("random", {}, kNoTarget, 5), 20);
    ASSERT_EQ(loop.views().size(), 20U);
    for (std::size_t i = 1; i < loop.views().size(); ++i) {
        const Pose& p = loop.views()[i];
        EXPECT_NEAR(p.rotation(2, 0), 0, 1e-9) << "the image's rows are level";
        EXPECT_LE(std::abs(std::asin(p.rotation(2, 2))), 0.5 + 1e-9);
        EXPECT_GE(p.translation.z(), 1.0);
        EXPECT_LE(p.translation.z(), 1.4);
    }
}

TEST(Baselines, UnknownNamesAndASphereWithoutTargetAreRefused) {
    EXPECT_THROW(makeBaseline("greedy", {}, kNoTarget, 1), std::invalid_argument);
    EXPECT_THROW(makeBaseline("sphere", {}, kNoTarget, 1), std::invalid_argument);
}

TEST(FindWay, GoesRoundAnObstacle) {
    const RayCaster caster(shapes::sphere(0.5, 40));
    BaselineState state;
    state.limits.boxMin = Eigen::Vector3d::Constant(-2);
    state.limits.boxMax = Eigen::Vector3d::Constant(2);
    state.segmentClear = [&](const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
        return caster.sweptClear(a, b, 0.2);
    };
    const Eigen::Vector3d a(-1.5, 0.03, 0);
    const Eigen::Vector3d b(1.5, 0, 0.1);
    const auto way = findWay(state, a, b);
    ASSERT_TRUE(way);
    EXPECT_EQ(way->back(), b);
    double length = 0;
    Eigen::Vector3d here = a;
    for (const auto& p : *way) {
        EXPECT_TRUE(state.segmentClear(here, p));
        length += (p - here).norm();
        here = p;
    }
    EXPECT_LT(length, 4.5);
    EXPECT_FALSE(findWay(state, a, {0, 0, 0}, 0.25, 3000)) << "inside the ball";
}

}  // namespace
}  // namespace riftmap
