// SPDX-License-Identifier: BSD-3-Clause
// Maps one view of a wall. A wall wider than the image is torn at the image's border, so it has a
// rift there; that is what this checks.
#include <riftmap/core/version.h>
#include <riftmap/core/view.h>
#include <riftmap/graph/pixel_graph.h>

#include <cstdio>

int main() {
    riftmap::View view;
    view.camera = {.width = 64,
                   .height = 48,
                   .fx = 60,
                   .fy = 60,
                   .cx = 31.5,
                   .cy = 23.5,
                   .baseline = 0.1,
                   .doffs = 0};
    view.world_T_camera = riftmap::lookAt({0, 0, 1}, {2, 0, 1});
    view.disparity.resize(view.camera.width, view.camera.height);
    view.disparity.disparity.assign(view.disparity.disparity.size(),
                                    static_cast<float>(view.camera.disparity(2.0)));
    view.disparity.sigma.assign(view.disparity.sigma.size(), 0.05F);
    view.image = cv::Mat::zeros(view.camera.height, view.camera.width, CV_8UC1);

    riftmap::PixelGraph graph;
    graph.merge(view);
    std::printf("riftmap %s: %zu vertices, %zu edges, %.2f m2, %zu rifts\n", riftmap::kVersion,
                graph.vertexCount(), graph.edgeCount(), graph.surfaceArea(), graph.rifts().size());
    return graph.vertexCount() == 64 * 48 && !graph.rifts().empty() ? 0 : 1;
}
