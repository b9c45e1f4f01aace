// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/sim/stereo_renderer.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "appearance.h"
#include "random_bits.h"

namespace riftmap {
namespace {

using Point = Eigen::Vector3d;

constexpr std::uint32_t kNoTriangle = ~0U;
constexpr float kSky = 0.80F;

template <class Body>
void forEachRow(int rows, const Body& body) {
    tbb::parallel_for(tbb::blocked_range<int>(0, rows, 4), [&](const tbb::blocked_range<int>& r) {
        for (int row = r.begin(); row != r.end(); ++row) {
            body(row);
        }
    });
}

/// What the ray through a pixel's centre met.
struct PixelHit {
    float depth = std::numeric_limits<float>::infinity();
    std::uint32_t triangle = kNoTriangle;
    std::uint32_t material = 0;
    Eigen::Vector3f normal = Eigen::Vector3f::Zero();  ///< of the triangle
    Eigen::Vector3f shading = Eigen::Vector3f::Zero();
};

}  // namespace

// ---- Options -----------------------------------------------------------------------------------

StereoCamera CameraOptions::camera() const {
    StereoCamera c;
    c.width = width;
    c.height = height;
    c.fx = f;
    c.fy = f;
    c.cx = cx < 0 ? (width - 1) / 2.0 : cx;
    c.cy = cy < 0 ? (height - 1) / 2.0 : cy;
    c.baseline = baseline;
    return c;
}

bool CameraOptions::distorted() const {
    return std::any_of(distortion.begin(), distortion.end(), [](double d) { return d != 0; });
}

void CameraOptions::describe(OptionTable& table) {
    table.section("Camera", "The simulated stereo rig: two equal cameras side by side.");
    table.add("width", width, 16, 8192, "px", "Image width.");
    table.add("height", height, 16, 8192, "px", "Image height.");
    table.add("f", f, 10, 20000, "px", "Focal length.");
    table.add("cx", cx, -1, 8192, "px", "Principal point; -1: the image's middle.");
    table.add("cy", cy, -1, 8192, "px", "Principal point; -1: the image's middle.");
    table.add("baseline", baseline, 0.001, 10, "m", "Distance between the cameras.");
    table.add(
        "num_disparities", numDisparities, 1, 4096, "px",
        "What a matcher searches: surfaces nearer than f * baseline / this are not measured.");
    table.add("far", farLimit, 0.01, 10000, "m", "Surfaces farther than this are not measured.");
    table.add("distortion", distortion, 0, "",
              "Lens distortion k1 k2 p1 p2 k3 of both cameras (OpenCV's model); empty: none.");
}

void RenderOptions::describe(OptionTable& table) {
    table.section("Render", "Light and sensor of the simulated cameras.");
    table.add("ambient", ambient, 0, 1, "", "Share of the light that comes from everywhere.");
    table.add("vignetting", vignetting, 0, 1, "", "How much darker the corners of the image are.");
    table.add("sensor_noise", sensorNoise, 0, 50, "grey levels",
              "Standard deviation of a pixel's brightness.");
    table.add("colour", colour, "Colour images; otherwise grey.");
    table.add("edge_samples", edgeSamples, 1, 8, "",
              "n x n rays for pixels that see more than one surface.");
}

// ---- Renderer ----------------------------------------------------------------------------------

struct StereoRenderer::Parts {
    Parts(const World& w, const RayCaster& c, const CameraOptions& cameraOptions,
          const RenderOptions& renderOptions)
        : caster(c),
          appearance(w.mesh),
          options(renderOptions),
          camera(cameraOptions.camera()),
          distortion(cameraOptions.distorted() ? cameraOptions.distortion : std::vector<double>()) {
    }

    /// Direction with z = 1 in the camera's frame of the light that falls on this place.
    Point direction(double column, double row) const {
        const Point ideal((column - camera.cx) / camera.fx, (row - camera.cy) / camera.fy, 1);
        return distortion.empty() ? ideal : undistort(ideal);
    }
    Point undistort(const Point& seen) const;

    std::optional<Hit> castPixel(const Pose& pose, double column, double row) const {
        return caster.cast(pose.translation, pose.rotation * direction(column, row));
    }
    /// Side of a pixel on the surface [m]; the geometric mean of both ways on an inclined one.
    float footprint(const Hit& hit, const Point& ray) const {
        const double cosine = std::abs(hit.normal.dot(ray)) / ray.norm();
        return static_cast<float>(hit.t / camera.fx / std::sqrt(std::max(0.1, cosine)));
    }
    float light(const Eigen::Vector3f& normal) const;
    Eigen::Vector3f shade(const Pose& pose, double column, double row, bool withNoise,
                          PixelHit* pixel) const;
    bool onEdge(const std::vector<PixelHit>& hits, int column, int row) const;
    cv::Mat render(const Pose& pose, std::uint64_t noiseSeed) const;
    void expose(const Eigen::Vector3f& colour, int column, int row, std::uint64_t noiseSeed,
                bool sensor, cv::Mat& image) const;
    bool hiddenFromRight(const Pose& left, const Point& inCamera, const Point& inWorld) const;

    const RayCaster& caster;
    Appearance appearance;
    RenderOptions options;
    StereoCamera camera;
    std::vector<double> distortion;
};

Point StereoRenderer::Parts::undistort(const Point& seen) const {
    const auto d = [&](std::size_t i) { return i < distortion.size() ? distortion[i] : 0.0; };
    double x = seen.x();
    double y = seen.y();
    for (int i = 0; i < 20; ++i) {  // fixed point: x = (seen - tangential(x)) / radial(x)
        const double r2 = x * x + y * y;
        const double radial = 1 + r2 * (d(0) + r2 * (d(1) + r2 * d(4)));
        const double dx = 2 * d(2) * x * y + d(3) * (r2 + 2 * x * x);
        const double dy = d(2) * (r2 + 2 * y * y) + 2 * d(3) * x * y;
        x = (seen.x() - dx) / radial;
        y = (seen.y() - dy) / radial;
    }
    return {x, y, 1};
}

float StereoRenderer::Parts::light(const Eigen::Vector3f& normal) const {
    // Two far lamps and the sky: every direction of a wall has a brightness of its own.
    static const Eigen::Vector3f kKey = Eigen::Vector3f(0.48F, 0.36F, 0.80F);
    static const Eigen::Vector3f kFill = Eigen::Vector3f(-0.64F, -0.48F, 0.60F);
    const auto ambient = static_cast<float>(options.ambient);
    const float sky = 0.75F + 0.25F * normal.z();
    return ambient * sky + (1 - ambient) * (0.62F * std::max(0.0F, normal.dot(kKey)) +
                                            0.42F * std::max(0.0F, normal.dot(kFill)) + 0.18F);
}

/// Colour seen in one direction; fills `pixel` if it is not null.
Eigen::Vector3f StereoRenderer::Parts::shade(const Pose& pose, double column, double row,
                                             bool withNoise, PixelHit* pixel) const {
    const Point ray = pose.rotation * direction(column, row);
    const auto hit = caster.cast(pose.translation, ray);
    if (!hit) {
        return Eigen::Vector3f(0.92F, 0.97F, 1.05F) * kSky;
    }
    const Eigen::Vector3f point = (pose.translation + hit->t * ray).cast<float>();
    Eigen::Vector3f normal = appearance.shadingNormal(*hit);
    if (hit->normal.dot(ray) > 0) {  // seen from behind
        normal = -normal;
    }
    if (pixel != nullptr) {
        pixel->depth = static_cast<float>(hit->t);
        pixel->triangle = hit->triangle;
        pixel->material = appearance.materialOf(hit->triangle);
        pixel->normal = hit->normal.cast<float>();
        pixel->shading = normal;
    }
    return appearance.colour(*hit, point, footprint(*hit, ray), withNoise) * light(normal);
}

/// True if a neighbour sees another surface than this pixel.
bool StereoRenderer::Parts::onEdge(const std::vector<PixelHit>& hits, int column, int row) const {
    const auto at = [&](int c, int r) -> const PixelHit& {
        return hits[static_cast<std::size_t>(r) * static_cast<std::size_t>(camera.width) +
                    static_cast<std::size_t>(c)];
    };
    const PixelHit& here = at(column, row);
    const auto differs = [&](int c, int r) {
        if (c < 0 || r < 0 || c >= camera.width || r >= camera.height) {
            return false;
        }
        const PixelHit& there = at(c, r);
        if (there.triangle == here.triangle) {
            return false;
        }
        if (there.triangle == kNoTriangle || here.triangle == kNoTriangle ||
            there.material != here.material || there.shading.dot(here.shading) < 0.985F) {
            return true;
        }
        const float near = std::min(here.depth, there.depth);
        const float far = std::max(here.depth, there.depth);
        return far - near > 0.03F * near;
    };
    return differs(column - 1, row) || differs(column + 1, row) || differs(column, row - 1) ||
           differs(column, row + 1);
}

void StereoRenderer::Parts::expose(const Eigen::Vector3f& colour, int column, int row,
                                   std::uint64_t noiseSeed, bool sensor, cv::Mat& image) const {
    float gain = 255;
    float sigma = 0;
    if (sensor) {
        const auto dx = static_cast<float>((column - camera.cx) / camera.cx);
        const auto dy = static_cast<float>((row - camera.cy) / camera.cy);
        gain *= 1 - static_cast<float>(options.vignetting) * 0.5F * (dx * dx + dy * dy);
        sigma = static_cast<float>(options.sensorNoise);
    }
    const auto pixel = static_cast<std::uint64_t>(row) * static_cast<std::uint64_t>(camera.width) +
                       static_cast<std::uint64_t>(column);
    const auto level = [&](float brightness, std::uint64_t channel) {
        float value = brightness * gain;
        if (sigma > 0) {
            value += sigma * gaussian(noiseSeed, 4 * pixel + channel);
        }
        return static_cast<unsigned char>(std::clamp(value + 0.5F, 0.0F, 255.0F));
    };
    if (image.channels() == 3) {
        auto& bgr = image.ptr<cv::Vec3b>(row)[column];
        for (int k = 0; k < 3; ++k) {
            bgr[k] = level(colour[2 - k], static_cast<std::uint64_t>(k));
        }
    } else {
        image.ptr<unsigned char>(row)[column] =
            level(0.299F * colour[0] + 0.587F * colour[1] + 0.114F * colour[2], 0);
    }
}

cv::Mat StereoRenderer::Parts::render(const Pose& pose, std::uint64_t noiseSeed) const {
    const auto width = static_cast<std::size_t>(camera.width);
    std::vector<PixelHit> hits(width * static_cast<std::size_t>(camera.height));
    std::vector<Eigen::Vector3f> colours(hits.size());
    forEachRow(camera.height, [&](int row) {
        for (int column = 0; column < camera.width; ++column) {
            const std::size_t i =
                static_cast<std::size_t>(row) * width + static_cast<std::size_t>(column);
            colours[i] = shade(pose, column, row, true, &hits[i]);
        }
    });
    cv::Mat image(camera.height, camera.width, options.colour ? CV_8UC3 : CV_8UC1);
    const int n = options.edgeSamples;
    forEachRow(camera.height, [&](int row) {
        for (int column = 0; column < camera.width; ++column) {
            const std::size_t i =
                static_cast<std::size_t>(row) * width + static_cast<std::size_t>(column);
            Eigen::Vector3f colour = colours[i];
            if (n > 1 && onEdge(hits, column, row)) {
                colour.setZero();
                for (int k = 0; k < n * n; ++k) {
                    const double dx = (k % n + 0.5) / n - 0.5;
                    const double dy = (k / n + 0.5) / n - 0.5;
                    colour += shade(pose, column + dx, row + dy, true, nullptr);
                }
                colour /= static_cast<float>(n * n);
            }
            expose(colour, column, row, noiseSeed, true, image);
        }
    });
    return image;
}

bool StereoRenderer::Parts::hiddenFromRight(const Pose& left, const Point& inCamera,
                                            const Point& inWorld) const {
    const double z = inCamera.z();
    if (camera.fx * (inCamera.x() - camera.baseline) / z + camera.cx < -0.5) {
        return true;
    }
    const Point right = left * Point(camera.baseline, 0, 0);
    return caster.occluded(right, inWorld, std::max(1e-4, 5e-4 * z));
}

StereoRenderer::StereoRenderer(const World& world, const RayCaster& caster,
                               const CameraOptions& camera, const RenderOptions& render)
    : parts_(std::make_unique<Parts>(world, caster, camera, render)), camera_(camera.camera()) {
    validate(camera_);
}
StereoRenderer::~StereoRenderer() = default;

StereoRenderer::Pair StereoRenderer::renderPair(const Pose& world_T_left,
                                                std::uint64_t noiseSeed) const {
    const Pose left_T_right{Eigen::Matrix3d::Identity(), Point(camera_.baseline, 0, 0)};
    return {parts_->render(world_T_left, mixBits(noiseSeed, 0)),
            parts_->render(world_T_left * left_T_right, mixBits(noiseSeed, 1))};
}

Truth StereoRenderer::truth(const Pose& world_T_left, bool withNormals,
                            bool withHalfOcclusion) const {
    Truth truth;
    truth.depth.create(camera_.height, camera_.width, CV_32FC1);
    if (withNormals) {
        truth.normals = cv::Mat::zeros(camera_.height, camera_.width, CV_32FC3);
    }
    if (withHalfOcclusion) {
        truth.halfOccluded = cv::Mat::zeros(camera_.height, camera_.width, CV_8UC1);
    }
    forEachRow(camera_.height, [&](int row) {
        for (int column = 0; column < camera_.width; ++column) {
            const Point inCamera = parts_->direction(column, row);
            const Point ray = world_T_left.rotation * inCamera;
            const auto hit = parts_->caster.cast(world_T_left.translation, ray);
            truth.depth.ptr<float>(row)[column] =
                hit ? static_cast<float>(hit->t) : std::numeric_limits<float>::infinity();
            if (!hit) {
                continue;
            }
            if (withNormals) {
                const Point n = hit->normal.dot(ray) > 0 ? Point(-hit->normal) : hit->normal;
                for (int k = 0; k < 3; ++k) {
                    truth.normals.ptr<cv::Vec3f>(row)[column][k] = static_cast<float>(n[k]);
                }
            }
            if (withHalfOcclusion &&
                parts_->hiddenFromRight(world_T_left, hit->t * inCamera,
                                        world_T_left.translation + hit->t * ray)) {
                truth.halfOccluded.ptr<unsigned char>(row)[column] = 255;
            }
        }
    });
    return truth;
}

cv::Mat StereoRenderer::renderQuick(const Pose& world_T_left) const {
    cv::Mat image(camera_.height, camera_.width, parts_->options.colour ? CV_8UC3 : CV_8UC1);
    forEachRow(camera_.height, [&](int row) {
        for (int column = 0; column < camera_.width; ++column) {
            parts_->expose(parts_->shade(world_T_left, column, row, false, nullptr), column, row, 0,
                           false, image);
        }
    });
    return image;
}

}  // namespace riftmap
