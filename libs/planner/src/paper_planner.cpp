// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/planner/paper_planner.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace riftmap {

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// The surface under a path: positions and normals with the length walked so far.
struct SurfaceLine {
    std::vector<double> length;
    std::vector<Eigen::Vector3d> position, normal;
};

std::optional<VertexId> nearestVertex(const PixelGraph& graph, const Eigen::Vector3d& point) {
    for (float radius = 0.25F; radius < 1e4F; radius *= 2.0F) {
        if (const auto id = graph.nearest(point.cast<float>(), radius)) {
            return id;
        }
    }
    return std::nullopt;
}

/// Distance through the graph to each rift's vertex, which hangs at its centre by an edge from
/// each of the rift's vertices (sec. V).
std::vector<double> distancesToRifts(const PixelGraph& graph, VertexId start, GraphSearch& search) {
    std::vector<VertexId> targets;
    for (const Rift& rift : graph.rifts()) {
        targets.insert(targets.end(), rift.vertices.begin(), rift.vertices.end());
    }
    const std::vector<double> toVertex = search.distances(graph, start, targets);
    std::vector<double> result;
    std::size_t next = 0;
    for (const Rift& rift : graph.rifts()) {
        double best = kInfinity;
        for (const VertexId id : rift.vertices) {
            const double last = static_cast<double>((graph.position(id) - rift.centre).norm());
            best = std::min(best, toVertex[next++] + last);
        }
        result.push_back(best);
    }
    return result;
}

VertexId vertexNearestCentre(const PixelGraph& graph, const Rift& rift) {
    VertexId best = kNoVertex;
    float bestDistance = std::numeric_limits<float>::infinity();
    for (const VertexId id : rift.vertices) {
        const float d = (graph.position(id) - rift.centre).squaredNorm();
        if (d < bestDistance) {
            bestDistance = d;
            best = id;
        }
    }
    return best;
}

/// Where a way can begin when the vertex nearest to the camera lies on a splinter without a rift.
VertexId nearestOfLargestRift(const PixelGraph& graph, const Eigen::Vector3d& point) {
    const auto& rifts = graph.rifts();
    const auto largest = std::max_element(
        rifts.begin(), rifts.end(),
        [](const Rift& a, const Rift& b) { return a.vertices.size() < b.vertices.size(); });
    const auto nearer = [&](VertexId a, VertexId b) {
        return (graph.position(a).cast<double>() - point).squaredNorm() <
               (graph.position(b).cast<double>() - point).squaredNorm();
    };
    return *std::min_element(largest->vertices.begin(), largest->vertices.end(), nearer);
}

SurfaceLine surfaceUnder(const PixelGraph& graph, const GraphPath& path) {
    SurfaceLine line;
    double length = 0;
    for (const VertexId id : path.vertices) {
        const Vertex v = graph.vertex(id);
        const Eigen::Vector3d p = v.position.cast<double>();
        if (!line.position.empty()) {
            length += (p - line.position.back()).norm();
        }
        line.length.push_back(length);
        line.position.push_back(p);
        line.normal.push_back(v.normal.cast<double>());
    }
    return line;
}

/// Means over [at - reach, at + reach]: normals of single pixels shake, and the camera at the end
/// of a metre of normal shakes with them.
bool smoothedAt(const SurfaceLine& line, double at, double reach, Eigen::Vector3d& position,
                Eigen::Vector3d& normal) {
    Eigen::Vector3d p = Eigen::Vector3d::Zero();
    Eigen::Vector3d n = Eigen::Vector3d::Zero();
    double sum = 0;
    for (std::size_t i = 0; i < line.length.size(); ++i) {
        const double off = std::abs(line.length[i] - at);
        if (off <= reach) {
            const double w = 1.0 - off / (reach + 1e-9) + 1e-6;
            p += w * line.position[i];
            n += w * line.normal[i];
            sum += w;
        }
    }
    if (sum <= 0 || n.norm() < 1e-3 * sum) {
        return false;
    }
    position = p / sum;
    normal = n.normalized();
    return true;
}

Pose above(const Eigen::Vector3d& point, const Eigen::Vector3d& normal, double height) {
    return lookAt(point + height * normal, point);
}

}  // namespace

void PaperPlannerOptions::describe(OptionTable& table) {
    table.section("PaperPlanner", "The planner of the paper (sec. VIII.B)");
    table.add("alpha", alpha, -1e6, 1e6, "1/m", "Weight of the distance to a rift in eq. (12)");
    table.add("beta", beta, -1e6, 1e6, "", "Weight of the number of edges of a rift in eq. (12)");
    table.add("height", height, 0.01, 100, "m", "Height of the camera above the surface");
    table.add("step", step, 0.001, 100, "m", "Length on the surface between two poses of a path");
    table.add("smoothing", smoothing, 0, 100, "m",
              "Normals along a path are averaged over this length to both sides");
}

PaperPlan planPaper(const PixelGraph& graph, const Pose& camera, const PaperPlannerOptions& options,
                    GraphSearch& search) {
    if (!isValid(camera)) {
        throw std::invalid_argument("planPaper: the camera's pose is not valid");
    }
    PaperPlan plan;
    const std::vector<Rift>& rifts = graph.rifts();
    auto start = nearestVertex(graph, camera.translation);
    if (rifts.empty() || !start) {
        return plan;
    }
    std::vector<double> distance = distancesToRifts(graph, *start, search);
    if (std::none_of(distance.begin(), distance.end(), [](double d) { return std::isfinite(d); })) {
        start = nearestOfLargestRift(graph, camera.translation);
        distance = distancesToRifts(graph, *start, search);
    }
    double best = -kInfinity;
    for (std::size_t i = 0; i < rifts.size(); ++i) {
        const double severity = static_cast<double>(rifts[i].highEdges);
        plan.cost.push_back(std::isfinite(distance[i])
                                ? options.alpha * distance[i] + options.beta * severity
                                : -kInfinity);
        if (plan.cost[i] > best) {
            best = plan.cost[i];
            plan.dominant = i;
        }
    }
    if (plan.dominant == PaperPlan::kNone) {
        return plan;
    }
    const Rift& rift = rifts[plan.dominant];
    if (auto path = search.shortestPath(graph, *start, vertexNearestCentre(graph, rift))) {
        plan.overGraph = std::move(*path);
    }
    const SurfaceLine line = surfaceUnder(graph, plan.overGraph);
    const double total = line.length.empty() ? 0.0 : line.length.back();
    const int steps = static_cast<int>(std::floor(total / options.step));
    for (int i = 1; i <= steps; ++i) {
        Eigen::Vector3d p, n;
        const double at = i * options.step;
        const double reach = std::max(options.smoothing, options.step / 2);
        if (total - at > options.step / 2 && smoothedAt(line, at, reach, p, n)) {
            plan.poses.push_back(above(p, n, options.height));
        }
    }
    const Eigen::Vector3d centre = rift.centre.cast<double>();
    const Eigen::Vector3d back = camera.translation - centre;
    if (rift.normal.norm() > 0.5F) {
        plan.poses.push_back(above(centre, rift.normal.cast<double>(), options.height));
    } else if (back.norm() > 1e-3) {  // too small to have a normal: from the side it was seen from
        plan.poses.push_back(above(centre, back.normalized(), options.height));
    }
    return plan;
}

PaperPlan planPaper(const PixelGraph& graph, const Pose& camera,
                    const PaperPlannerOptions& options) {
    GraphSearch search;
    return planPaper(graph, camera, options, search);
}

}  // namespace riftmap
