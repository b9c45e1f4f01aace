// SPDX-License-Identifier: BSD-3-Clause
// Uses one thing of each library, so that all of them are linked and found when it starts.
#include <riftmap/core/options.h>
#include <riftmap/core/pose.h>
#include <riftmap/core/version.h>

#include <cstdio>

int main() {
    const riftmap::Pose camera = riftmap::lookAt({0, 0, 1}, {2, 0, 1});
    const Eigen::Vector3d ahead = camera * Eigen::Vector3d(0, 0, 2);
    std::printf("riftmap %s looks at %.1f %.1f %.1f\n", riftmap::kVersion, ahead.x(), ahead.y(),
                ahead.z());
    return (ahead - Eigen::Vector3d(2, 0, 1)).norm() < 1e-12 ? 0 : 1;
}
