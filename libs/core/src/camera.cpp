// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/core/camera.h"

#include <cmath>
#include <stdexcept>
#include <string>

namespace riftmap {
namespace {

void require(bool ok, const char* field, double value, const char* allowed) {
    if (!ok) {
        throw std::invalid_argument("camera: " + std::string(field) + " = " +
                                    std::to_string(value) + ", allowed: " + allowed);
    }
}

}  // namespace

void validate(const StereoCamera& camera) {
    require(camera.width > 0, "width", camera.width, "> 0");
    require(camera.height > 0, "height", camera.height, "> 0");
    require(std::isfinite(camera.fx) && camera.fx > 0, "fx", camera.fx, "finite, > 0");
    require(std::isfinite(camera.fy) && camera.fy > 0, "fy", camera.fy, "finite, > 0");
    require(std::isfinite(camera.cx), "cx", camera.cx, "finite");
    require(std::isfinite(camera.cy), "cy", camera.cy, "finite");
    require(std::isfinite(camera.baseline) && camera.baseline > 0, "baseline", camera.baseline,
            "finite, > 0");
    require(std::isfinite(camera.doffs), "doffs", camera.doffs, "finite");
}

}  // namespace riftmap
