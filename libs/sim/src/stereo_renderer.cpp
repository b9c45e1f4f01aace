// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/sim/stereo_renderer.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "appearance.h"
#include "random_bits.h"
#include "riftmap/core/parallel.h"
#include "solid_noise.h"

namespace riftmap {
namespace {

using Point = Eigen::Vector3d;

constexpr std::uint32_t kNoTriangle = ~0U;
constexpr float kSky = 0.80F;

/// What the ray through a pixel's centre met.
struct PixelHit {
    float depth = std::numeric_limits<float>::infinity();
    std::uint32_t triangle = kNoTriangle;
    std::uint32_t material = 0;
    Eigen::Vector3f shading = Eigen::Vector3f::Zero();  ///< normal towards the camera
};

/// Rays that are traced and coloured together, and what became of them.
struct Batch {
    std::vector<Eigen::Vector2d> pixels;  ///< (column, row)
    std::vector<Point> rays;              ///< directions, world frame
    std::vector<std::optional<Hit>> hits;
    std::vector<PixelHit> seen;
    std::vector<Eigen::Vector3f> colours;  ///< lit
    NoiseQueries queries;
    std::vector<std::pair<std::size_t, float>> noisy;  ///< index of the pixel, strength
    std::vector<float> noise;
};

/// Of a whole image.
struct Frame {
    std::vector<PixelHit> seen;
    std::vector<Eigen::Vector3f> colours;  ///< lit
};

/// Calls body(row, scratch) for all rows, several at once. The scratch stays with its thread, for
/// fresh memory is slow; so a body must not wait for other tasks.
template <class Body>
void forEachRow(int rows, const Body& body) {
    parallelFor(static_cast<std::size_t>(rows), 4, [&](std::size_t begin, std::size_t end) {
        thread_local Batch scratch;
        for (std::size_t row = begin; row < end; ++row) {
            body(static_cast<int>(row), scratch);
        }
    });
}

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

    /// Side of a pixel on the surface [m]; the geometric mean of both ways on an inclined one.
    float footprint(const Hit& hit, const Point& ray) const {
        const double cosine = std::abs(hit.normal.dot(ray)) / ray.norm();
        return static_cast<float>(hit.t / camera.fx / std::sqrt(std::max(0.1, cosine)));
    }
    float light(const Eigen::Vector3f& normal) const;
    void shade(const Pose& pose, Batch& batch, bool withNoise) const;
    void cast(const Pose& pose, Batch& batch) const;
    void castRow(const Pose& pose, int row, Batch& batch) const;
    bool onEdge(const std::vector<PixelHit>& hits, int column, int row) const;
    void smoothEdges(const Pose& pose, const std::vector<PixelHit>& seen, int row,
                     Eigen::Vector3f* line, Batch& batch) const;
    cv::Mat render(const Pose& pose, std::uint64_t noiseSeed, Frame& frame) const;
    /// Brings a row of colours to what the sensor says; without noise and vignetting if not
    /// `sensor`.
    void expose(const Eigen::Vector3f* line, int row, std::uint64_t noiseSeed, bool sensor,
                cv::Mat& image) const;
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
    const float sky = 0.88F + 0.12F * normal.z();
    return ambient * sky + (1 - ambient) * (0.55F * std::max(0.0F, normal.dot(kKey)) +
                                            0.36F * std::max(0.0F, normal.dot(kFill)) + 0.32F);
}

void StereoRenderer::Parts::cast(const Pose& pose, Batch& b) const {
    const std::size_t n = b.pixels.size();
    b.rays.resize(n);
    b.hits.resize(n);
    for (std::size_t i = 0; i < n; ++i) {
        b.rays[i] = pose.rotation * direction(b.pixels[i].x(), b.pixels[i].y());
    }
    caster.castBundle(pose.translation, b.rays, b.hits);
}

/// Finds the colours of the batch's pixels after cast().
void StereoRenderer::Parts::shade(const Pose& pose, Batch& b, bool withNoise) const {
    const std::size_t n = b.pixels.size();
    b.seen.assign(n, PixelHit());
    b.colours.assign(n, Eigen::Vector3f(0.92F, 0.97F, 1.05F) * kSky);
    b.queries.resize(n);
    b.noisy.clear();
    for (std::size_t i = 0; i < n; ++i) {
        if (!b.hits[i]) {
            continue;
        }
        const Hit& hit = *b.hits[i];
        const Eigen::Vector3f point = (pose.translation + hit.t * b.rays[i]).cast<float>();
        const float size = footprint(hit, b.rays[i]);
        Eigen::Vector3f normal = appearance.shadingNormal(hit);
        if (hit.normal.dot(b.rays[i]) > 0) {  // seen from behind
            normal = -normal;
        }
        b.seen[i] = {static_cast<float>(hit.t), hit.triangle, appearance.materialOf(hit.triangle),
                     normal};
        b.colours[i] = appearance.colour(hit, point, size) * light(normal);
        const Material* material = withNoise ? appearance.noiseOf(hit.triangle) : nullptr;
        if (material != nullptr) {
            b.queries.set(b.noisy.size(), point.cwiseQuotient(material->grain), material->noiseSize,
                          size);
            b.noisy.push_back({i, material->noise});
        }
    }
    b.queries.resize(b.noisy.size());
    solidNoise(b.queries, b.noise);
    for (std::size_t k = 0; k < b.noisy.size(); ++k) {
        const auto& [i, strength] = b.noisy[k];
        b.colours[i] *= std::clamp(1 + strength * b.noise[k], 0.12F, 2.0F);
    }
}

void StereoRenderer::Parts::castRow(const Pose& pose, int row, Batch& b) const {
    b.pixels.clear();
    for (int column = 0; column < camera.width; ++column) {
        b.pixels.emplace_back(column, row);
    }
    cast(pose, b);
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

void StereoRenderer::Parts::expose(const Eigen::Vector3f* line, int row, std::uint64_t noiseSeed,
                                   bool sensor, cv::Mat& image) const {
    const float sigma = sensor ? static_cast<float>(options.sensorNoise) : 0.0F;
    const float falloff = sensor ? static_cast<float>(options.vignetting) * 0.5F : 0.0F;
    const auto dy = static_cast<float>((row - camera.cy) / camera.cy);
    const auto first = static_cast<std::uint64_t>(row) * static_cast<std::uint64_t>(camera.width);
    const auto level = [&](float value, std::uint64_t column, std::uint64_t channel) {
        if (sigma > 0) {
            value += sigma * gaussian(noiseSeed, 4 * (first + column) + channel);
        }
        return static_cast<unsigned char>(std::clamp(value + 0.5F, 0.0F, 255.0F));
    };
    unsigned char* out = image.ptr<unsigned char>(row);
    const bool colour = image.channels() == 3;
    for (int column = 0; column < camera.width; ++column) {
        const auto dx = static_cast<float>((column - camera.cx) / camera.cx);
        const float gain = 255 * (1 - falloff * (dx * dx + dy * dy));
        const Eigen::Vector3f& rgb = line[column];
        const auto at = static_cast<std::uint64_t>(column);
        if (colour) {
            for (int k = 0; k < 3; ++k) {  // blue, green, red
                *out++ = level(rgb[2 - k] * gain, at, static_cast<std::uint64_t>(k));
            }
        } else {
            *out++ = level((0.299F * rgb[0] + 0.587F * rgb[1] + 0.114F * rgb[2]) * gain, at, 0);
        }
    }
}

cv::Mat StereoRenderer::Parts::render(const Pose& pose, std::uint64_t noiseSeed,
                                      Frame& frame) const {
    const auto width = static_cast<std::size_t>(camera.width);
    auto& [seen, colours] = frame;
    seen.resize(width * static_cast<std::size_t>(camera.height));
    colours.resize(seen.size());
    forEachRow(camera.height, [&](int row, Batch& b) {
        castRow(pose, row, b);
        shade(pose, b, true);
        const auto first = static_cast<std::ptrdiff_t>(static_cast<std::size_t>(row) * width);
        std::copy(b.seen.begin(), b.seen.end(), seen.begin() + first);
        std::copy(b.colours.begin(), b.colours.end(), colours.begin() + first);
    });
    cv::Mat image(camera.height, camera.width, options.colour ? CV_8UC3 : CV_8UC1);
    forEachRow(camera.height, [&](int row, Batch& b) {
        Eigen::Vector3f* line = &colours[static_cast<std::size_t>(row) * width];
        smoothEdges(pose, seen, row, line, b);
        expose(line, row, noiseSeed, true, image);
    });
    return image;
}

/// Pixels of this row that see several surfaces get the mean of n x n rays.
void StereoRenderer::Parts::smoothEdges(const Pose& pose, const std::vector<PixelHit>& seen,
                                        int row, Eigen::Vector3f* line, Batch& b) const {
    const int n = options.edgeSamples;
    if (n < 2) {
        return;
    }
    std::vector<int> columns;
    b.pixels.clear();
    for (int column = 0; column < camera.width; ++column) {
        if (onEdge(seen, column, row)) {
            columns.push_back(column);
            for (int k = 0; k < n * n; ++k) {
                const int across = k % n;
                const int down = k / n;
                b.pixels.emplace_back(column + (across + 0.5) / n - 0.5,
                                      row + (down + 0.5) / n - 0.5);
            }
        }
    }
    if (columns.empty()) {
        return;
    }
    cast(pose, b);
    shade(pose, b, true);
    const auto samples = static_cast<std::size_t>(n) * static_cast<std::size_t>(n);
    for (std::size_t i = 0; i < columns.size(); ++i) {
        Eigen::Vector3f sum = Eigen::Vector3f::Zero();
        for (std::size_t k = 0; k < samples; ++k) {
            sum += b.colours[i * samples + k];
        }
        line[columns[i]] = sum / static_cast<float>(samples);
    }
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
    Frame frame;  // one for both images
    return {parts_->render(world_T_left, mixBits(noiseSeed, 0), frame),
            parts_->render(world_T_left * left_T_right, mixBits(noiseSeed, 1), frame)};
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
    forEachRow(camera_.height, [&](int row, Batch& b) {
        parts_->castRow(world_T_left, row, b);
        for (int column = 0; column < camera_.width; ++column) {
            const Point inCamera = parts_->direction(column, row);
            const Point& ray = b.rays[static_cast<std::size_t>(column)];
            const auto& hit = b.hits[static_cast<std::size_t>(column)];
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
    forEachRow(camera_.height, [&](int row, Batch& b) {
        parts_->castRow(world_T_left, row, b);
        parts_->shade(world_T_left, b, false);
        parts_->expose(b.colours.data(), row, 0, false, image);
    });
    return image;
}

}  // namespace riftmap
