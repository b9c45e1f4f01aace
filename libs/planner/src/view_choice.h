// SPDX-License-Identifier: BSD-3-Clause
// The work of RiftPlanner on one plan.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <random>
#include <vector>

#include "riftmap/planner/view_planner.h"

namespace riftmap {

struct Candidate {
    Pose pose;
    double path = 0;  ///< [m]
    ViewScore score;
    double utility = 0;  ///< gain for a metre
    std::shared_ptr<const ViewScorer::Drawing> drawing =
        nullptr;  ///< of its estimate, until it is scored
};

/// A unit vector at a right angle to `n`.
Eigen::Vector3d anyPerpendicular(const Eigen::Vector3d& n);

/// The i-th of n directions that are spread evenly over the sphere, on a spiral from up to down.
Eigen::Vector3d evenDirection(int i, int n);

/// One plan: makes candidates, scores them, picks.
class Choice {
 public:
    Choice(Knowledge& knowledge, std::vector<Pose>& pool, ObjectMemory& memory);

    std::optional<ViewPlan> make();

 private:
    friend struct ChoiceTwin;  ///< of the tests

    double uniform(double a, double b) {
        return a + (b - a) * static_cast<double>(random_()) / 4294967296.0;
    }
    bool add(const Eigen::Vector3d& eye, const Eigen::Vector3d& target);
    void addAround(const RiftRecord& record, int directions);
    void addInSight(const RiftRecord& record, int directions, std::size_t most);
    void thinOut();
    void addTurns();
    void addPlaces();
    void addPool();
    void keepPool();
    bool alike(const Pose& a, const Pose& b) const;
    using Value = double (*)(const Candidate& candidate);
    std::vector<std::size_t> bestApart(std::size_t most, Value valueOf) const;
    void vary(const Candidate& view, int count, double scale);
    ViewScore scoreAround(const Pose& pose) const;
    ViewScore scoreOf(const ViewScorer::Seen& seen) const;
    void keepBestAround();
    void rate(Candidate& candidate, const ViewScore& score) const;
    void scoreFrom(std::size_t first);
    void preselect();
    void climb();
    void climbAround();
    const Candidate* best() const;
    std::vector<Eigen::Vector3d> frontierSeen(const Pose& pose) const;
    std::optional<ViewPlan> planFor(const Candidate& candidate) const;
    std::optional<Eigen::Vector3d> lookOut(const RiftRecord& record, const Eigen::Vector3d& out,
                                           bool anywhere) const;
    template <int kDirections, class F>
    void forEachInSight(const RiftRecord& record, bool anywhere, const F& f) const;
    bool mayBeSeen(const RiftRecord& record) const;
    bool inRange(const Eigen::Vector3d& place);
    void addAllInSight(const RiftRecord& record, std::size_t most);
    void giveUp(const RiftRecord& record, bool reachable, bool visible);
    std::optional<ViewPlan> lastResorts();
    bool lineOfSight(const Eigen::Vector3d& eye, const Eigen::Vector3d& target) const;
    std::vector<Eigen::Vector3d> inTheWayOut() const;
    std::optional<ViewPlan> wayOut();
    std::optional<ViewPlan> makeAround(const Eigen::AlignedBox3d& box);
    void addPlacesAround(const Eigen::AlignedBox3d& box);

    Knowledge& k_;
    std::vector<Pose>& pool_;
    ObjectMemory& memory_;
    ViewScorer scorer_;
    std::mt19937 random_;
    double good_;
    std::vector<Candidate> candidates_;
    std::vector<float> worth_;                ///< of the items of a tour
    std::vector<Eigen::Vector3d> reachable_;  ///< places, once they were asked for
};

}  // namespace riftmap
