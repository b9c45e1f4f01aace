// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

namespace riftmap {

/// The largest whole number that is not above x, which must lie within int: std::floor() is a call
/// on processors without SSE 4.1, for which Debian builds.
template <class T>
int wholeBelow(T x) {
    const int towardsZero = static_cast<int>(x);
    return towardsZero - (x < static_cast<T>(towardsZero) ? 1 : 0);
}

/// The same of each coordinate.
template <class Derived>
Eigen::Vector3i wholesBelow(const Eigen::DenseBase<Derived>& v) {
    return {wholeBelow(v.x()), wholeBelow(v.y()), wholeBelow(v.z())};
}

}  // namespace riftmap
