// SPDX-License-Identifier: BSD-3-Clause
// The first steps: what a camera sees is a pyramid, which near its tip is narrower than the room
// that the camera itself takes.
#include <algorithm>
#include <iterator>

#include "riftmap/core/parallel.h"
#include "view_choice.h"

namespace riftmap {

/// The unknown voxels that stand in the way of a camera that cannot leave its place, on the
/// straight way out that has fewest of them; empty if there is none.
std::vector<Eigen::Vector3d> Choice::inTheWayOut() const {
    constexpr int kWays = 200;
    const Eigen::Vector3d eye = k_.camera().translation;
    const double radius = k_.clearance() + 1.5 * k_.space().voxelSize();
    std::vector<Eigen::Vector3d> fewest;
    // So far that the pyramid is wide enough; less where the room is too small for that.
    for (const double length : {5.0, 3.5, 2.5}) {
        for (int i = 0; i < kWays; ++i) {
            const Eigen::Vector3d to = eye + length * k_.clearance() * evenDirection(i, kWays);
            if (!k_.cameraBox().contains(to)) {
                continue;
            }
            auto voxels = k_.space().toBeLookedAt(eye, to, radius);
            if (!voxels.empty() && (fewest.empty() || voxels.size() < fewest.size())) {
                fewest = std::move(voxels);
            }
        }
        if (!fewest.empty()) {
            break;
        }
    }
    return fewest;
}

/// Where the camera cannot leave its place: of the views that free most of what may stand in its
/// way, by sight and by being there, the one that shows most else.
std::optional<ViewPlan> Choice::wayOut() {
    if (k_.surfaceBox() || !k_.confined()) {  // around an object all is free
        return std::nullopt;
    }
    std::vector<Eigen::Vector3d> eyes = k_.space().reachable(1);
    if (eyes.size() >= Knowledge::kFew) {  // by passages
        return std::nullopt;
    }
    if (eyes.empty()) {
        eyes.push_back(k_.camera().translation);
    }
    const std::vector<Eigen::Vector3d> inTheWay = inTheWayOut();
    if (inTheWay.empty()) {
        return std::nullopt;
    }
    const StereoCamera& camera = k_.sensor().camera;
    const auto isFreed = [&](const Pose& camera_T_world, const Eigen::Vector3d& voxel) {
        const Eigen::Vector3d p = camera_T_world * voxel;
        if (p.z() < k_.space().voxelSize() || p.norm() < k_.freeAround()) {
            return p.norm() < k_.freeAround();
        }
        const Eigen::Vector2d uv = camera.project(p);
        return uv.x() >= k_.sensor().firstColumn && uv.y() >= 0 && uv.x() <= camera.width - 1 &&
               uv.y() <= camera.height - 1;
    };
    constexpr int kViews = 200;
    for (const Eigen::Vector3d& eye : eyes) {
        for (int i = 0; i < kViews; ++i) {
            add(eye, eye + evenDirection(i, kViews));
        }
    }
    std::vector<std::ptrdiff_t> freed(candidates_.size());
    parallelForEach(freed.size(), 16, [&](std::size_t i) {
        const Pose camera_T_world = candidates_[i].pose.inverse();
        freed[i] = std::count_if(inTheWay.begin(), inTheWay.end(),
                                 [&](const auto& v) { return isFreed(camera_T_world, v); });
    });
    const std::ptrdiff_t most = freed.empty() ? 0 : *std::max_element(freed.begin(), freed.end());
    std::vector<Candidate> good;
    for (std::size_t i = 0; i < freed.size(); ++i) {
        if (most > 0 && 10 * freed[i] >= 9 * most) {
            good.push_back(candidates_[i]);
        }
    }
    candidates_ = std::move(good);
    preselect();
    scoreFrom(0);
    std::erase_if(candidates_, [](const Candidate& c) { return c.score.nearShare > 0.3; });
    const Candidate* b = best();
    auto plan = b != nullptr ? planFor(*b) : std::nullopt;
    if (plan) {
        plan->unknown.clear();
        const Pose camera_T_world = plan->path.back().inverse();
        std::copy_if(inTheWay.begin(), inTheWay.end(), std::back_inserter(plan->unknown),
                     [&](const auto& v) { return isFreed(camera_T_world, v); });
    }
    candidates_.clear();
    return plan;
}

}  // namespace riftmap
