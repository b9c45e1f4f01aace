// SPDX-License-Identifier: BSD-3-Clause
#include "normals.h"

#include <Eigen/Eigenvalues>

namespace riftmap {

Eigen::Vector3f planeNormal(const GraphStorage& storage, VertexId id, const Eigen::Vector3f& camera,
                            bool acrossHigh) {
    // Relative to the vertex itself, so that single precision is enough far from the origin.
    const Eigen::Vector3f origin = storage.position(id);
    Eigen::Vector3f sum = Eigen::Vector3f::Zero();
    Eigen::Matrix3f squares = Eigen::Matrix3f::Zero();
    float k = 1;
    storage.forEachHalfEdge(id, [&](VertexId n, std::uint16_t weight) {
        if (acrossHigh || (weight & compact::kHighBit) == 0) {
            const Eigen::Vector3f d = storage.position(n) - origin;
            sum += d;
            squares += d * d.transpose();
            k += 1;
        }
    });
    const Eigen::Matrix3f scatter = squares - sum * sum.transpose() / k;  // Q+^T Q+, eq. (11)
    const float size = scatter.trace();
    if (k < 3 || !(size > 0)) {
        return Eigen::Vector3f::Zero();
    }
    // The right singular vector of Q+ with the smallest singular value is the eigenvector of
    // Q+^T Q+ with the smallest eigenvalue, eq. (10).
    Eigen::SelfAdjointEigenSolver<Eigen::Matrix3f> solver;
    solver.computeDirect(scatter / size);
    if (solver.eigenvalues()[1] < 1e-5F) {
        return Eigen::Vector3f::Zero();  // all in a line
    }
    const Eigen::Vector3f normal = solver.eigenvectors().col(0);
    return normal.dot(camera - origin) < 0 ? Eigen::Vector3f(-normal) : normal;
}

}  // namespace riftmap
