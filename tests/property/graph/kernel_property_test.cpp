// SPDX-License-Identifier: BSD-3-Clause
// Each piece of vector code against the formula it stands for, and against itself on every
// instruction set. A failure prints its seed.
#include <gtest/gtest.h>
#include <hwy/targets.h>

#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <sstream>

#include "association.h"
#include "edge_kernel.h"
#include "fuse_kernel.h"
#include "random_scenes.h"
#include "riftmap/graph/pixel_graph.h"

namespace riftmap {
namespace {

/// A view of an odd size, so that vectors and patches do not fit, with noise of its own.
View oddView(Random& random, const Scene& scene) {
    const int width = 41 + random.below(40);
    Eigen::Vector3d eye = random.point(1.0);
    eye.x() += eye.x() < 0 ? -0.8 : 0.8;
    const double sigma = random.below(3) == 0 ? 0.0 : random.in(0.02, 0.3);
    View view = synthetic::makeView(scene, synthetic::smallCamera(width, width * 3 / 4 + 1),
                                    lookAt(eye, random.point(0.4)),
                                    {sigma, static_cast<std::uint64_t>(random.below(1 << 30))});
    for (int i = 0; i < 60; ++i) {
        view.disparity.disparity[static_cast<std::size_t>(
            random.below(static_cast<int>(view.disparity.disparity.size())))] = kNoDisparity;
    }
    return view;
}

TEST(GraphKernels, GiveTheSameMapOnEveryInstructionSet) {
    for (std::uint64_t seed = 1; seed <= 3; ++seed) {
        SCOPED_TRACE("seed " + std::to_string(seed));
        std::map<std::int64_t, std::string> maps;
        for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
            hwy::SetSupportedTargetsForTest(target);
            Random random(seed);
            const Scene scene = randomScene(random);
            PixelGraph graph(randomOptions(random));
            for (int i = 0; i < 4; ++i) {
                graph.merge(oddView(random, scene));
            }
            std::ostringstream out;
            graph.save(out);
            maps[target] = out.str();
        }
        hwy::SetSupportedTargetsForTest(0);
        EXPECT_GT(maps.begin()->second.size(), 50'000U);
        for (const auto& [target, bytes] : maps) {
            EXPECT_TRUE(bytes == maps.begin()->second) << hwy::TargetName(target);
        }
    }
}

/// Least squares by the normal equations, in double, as the text describes it.
struct SlowPlane {
    bool known = false;
    double a = 0, b = 0, value = 0;
    double nearestToTolerance = 1e9;  ///< how close a pixel came to the limit of belonging
};
SlowPlane slowPlane(const View& view, const ViewPoints& points, int column, int row) {
    SlowPlane plane;
    const std::size_t centre = points.index(column, row);
    if (column >= points.width || !(points.z[centre] > 0)) {
        return plane;
    }
    const double sd = view.disparity.sigma[centre];
    const double d0 = points.disparity[centre];
    const bool noisy = points.sigma[centre] > 0.25F * points.z[centre] * points.footprint;
    const int step = noisy ? 3 : 1;
    double tolerance = 4 * sd + 10.0 * points.fb / (points.fx * points.z[centre]) * 2 * step;
    for (int pass = 0; pass < 2; ++pass) {
        Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
        Eigen::Vector3d right = Eigen::Vector3d::Zero();
        for (int dr = -2 * step; dr <= 2 * step; dr += step) {
            for (int dc = -2 * step; dc <= 2 * step; dc += step) {
                const int c = column + dc, r = row + dr;
                if (c < 0 || r < 0 || c >= points.width || r >= points.height ||
                    !(points.z[points.index(c, r)] > 0)) {
                    continue;
                }
                const double d = points.disparity[points.index(c, r)] - d0;
                const double off =
                    std::abs(d - (plane.value + plane.a * dc + plane.b * dr)) - tolerance;
                plane.nearestToTolerance = std::min(plane.nearestToTolerance, std::abs(off));
                if (off <= 0) {
                    const Eigen::Vector3d x(dc, dr, 1);
                    normal += x * x.transpose();
                    right += x * d;
                }
            }
        }
        const double n = normal(2, 2);
        const Eigen::Matrix2d spread =
            normal.topLeftCorner<2, 2>() - normal.topRightCorner<2, 1>() *
                                               normal.topRightCorner<2, 1>().transpose() /
                                               std::max(n, 1.0);
        if (n < 9 || spread.determinant() <= 1e-3 * n * n) {
            plane.known = false;
            return plane;
        }
        const Eigen::Vector3d solved = normal.ldlt().solve(right);
        plane.a = solved[0];
        plane.b = solved[1];
        plane.value = solved[2];
        tolerance = 3 * sd + 0.05;
        plane.known = true;
    }
    plane.value += d0;
    return plane;
}

TEST(GraphKernels, PatchesAreLeastSquaresPlanes) {
    std::size_t planes = 0, none = 0;
    for (std::uint64_t seed = 1; seed <= 12; ++seed) {
        SCOPED_TRACE("seed " + std::to_string(seed));
        Random random(seed);
        const Scene scene = randomScene(random);
        const View view = oddView(random, scene);
        ViewPoints points;
        points.build(view, randomOptions(random));
        for (int r = 0; r < points.height; ++r) {
            for (int c = 0; c < points.width; ++c) {
                const PatchPlane& patch = points.patch(c, r);
                const float d = points.disparity[points.index(c, r)];
                EXPECT_EQ(points.onPatch(c, r),
                          std::abs(d - patch.disparity(c, r)) <= patch.tolerance);
            }
        }
        for (int r = 0; r < points.height; r += 4) {
            for (int c = 0; c < points.width; c += 4) {
                const PatchPlane& fast = points.patch(c, r);
                const SlowPlane slow = slowPlane(view, points, c + 2, fast.row);
                if (slow.nearestToTolerance < 1e-3) {
                    continue;  // rounding decides what belongs
                }
                ASSERT_EQ(fast.tolerance >= 0, slow.known) << c << ' ' << r;
                if (!slow.known) {
                    ++none;
                    continue;
                }
                ++planes;
                const double scale = 1e-3 + 1e-3 * std::abs(slow.a) + 1e-3 * std::abs(slow.b);
                EXPECT_NEAR(fast.slopeColumn, slow.a, scale);
                EXPECT_NEAR(fast.slopeRow, slow.b, scale);
                EXPECT_NEAR(fast.value, slow.value, 5 * scale);
                // n . X = distance for points of the plane, n towards the camera.
                const Eigen::Vector3d n = fast.normal.cast<double>();
                EXPECT_NEAR(n.norm(), 1.0, 1e-5);
                for (const auto& [dc, dr] : {std::pair{0, 0}, {3, 1}, {-2, 4}}) {
                    const double d = slow.value + slow.a * dc + slow.b * dr;
                    if (d > 0.5) {
                        const double z = static_cast<double>(points.fb) / d;
                        const Eigen::Vector3d p((c + 2 + dc - static_cast<double>(points.cx)) * z /
                                                    static_cast<double>(points.fx),
                                                (fast.row + dr - static_cast<double>(points.cy)) *
                                                    z / static_cast<double>(points.fy),
                                                z);
                        EXPECT_NEAR(-n.dot(p) * fast.inverseDistance, 1.0, 0.01);
                    }
                }
            }
        }
    }
    EXPECT_GT(planes, 500U);
    EXPECT_GT(none, 20U);
}

/// How far a pixel lies, along the axis, from the plane of a neighbour's patch that is seen at an
/// angle; infinite where there is none. Within target + noise the angle explains a long edge.
double offNeighboursPlane(const ViewPoints& points, int c, int r, int c2, int r2) {
    const std::size_t i = points.index(c, r);
    const double d = points.patch(c, r).disparity(c2, r2);
    const bool slanted =
        points.stretch[i] > 1.0F && points.stretch[i] < ViewPoints::kLargestStretch;
    return slanted && d > 0 && points.onPatch(c, r)
               ? std::abs(double{points.fb} / d - double{points.z[points.index(c2, r2)]})
               : std::numeric_limits<double>::infinity();
}

TEST(GraphKernels, EdgesAndKindsAreThoseOfEquation3) {
    std::size_t high3 = 0, explained = 0, withinSpacing = 0, withinNoise = 0;
    for (std::uint64_t seed = 1; seed <= 10; ++seed) {
        SCOPED_TRACE("seed " + std::to_string(seed));
        Random random(seed);
        const Scene scene = randomScene(random);
        const GraphOptions options = randomOptions(random);
        View view = oddView(random, scene);
        view.disparity.firstColumn = random.below(6);
        ViewPoints points;
        points.build(view, options);
        std::size_t valid = 0;
        for (int r = 0; r < points.height; ++r) {
            for (int c = 0; c < points.width; ++c) {
                const std::size_t i = points.index(c, r);
                const double d = view.disparity.at(c, r), sd = view.disparity.sigma[i];
                const double fb = view.camera.fx * view.camera.baseline;
                const bool known = std::isfinite(d) && d > 0 && 3 * sd < d;
                ASSERT_EQ(points.z[i] > 0, known);
                if (!known) {
                    continue;
                }
                ++valid;
                EXPECT_NEAR(points.z[i], fb / d, 1e-5 * fb / d);
                EXPECT_NEAR(points.sigma[i], fb / d / d * sd, 1e-5);
                unsigned kinds = 0;
                for (const auto& [dc, dr] : {std::pair{1, 0}, {0, 1}, {-1, 0}, {0, -1}}) {
                    const int c2 = c + dc, r2 = r + dr;
                    if (c2 < 0 || r2 < 0 || c2 >= points.width || r2 >= points.height) {
                        kinds |= kImageBorder;
                        continue;
                    }
                    const std::size_t j = points.index(c2, r2);
                    const std::uint16_t code = dc > 0   ? points.right[i]
                                               : dr > 0 ? points.down[i]
                                               : dc < 0 ? points.right[j]
                                                        : points.down[j];
                    ASSERT_EQ(code == ViewPoints::kNoEdge, !(points.z[j] > 0));
                    if (code == ViewPoints::kNoEdge) {
                        kinds |= c2 < view.disparity.firstColumn ? kImageBorder : kNoMatch;
                        continue;
                    }
                    const double weight =
                        (points.inCamera(c, r, points.z[i]) - points.inCamera(c2, r2, points.z[j]))
                            .cast<double>()
                            .norm();
                    EXPECT_NEAR(compact::weightOf(code), weight, 6e-4 * weight + 2e-6);
                    const bool high = (code & compact::kHighBit) != 0;
                    kinds |= high ? unsigned{kDepthStep} : 0U;
                    if (options.delta > 0 && std::abs(weight - options.delta) > 1e-5) {
                        EXPECT_EQ(high, weight > options.delta);
                    } else if (options.delta <= 0) {
                        const double noise =
                            options.targetResolution +
                            3 * std::hypot(double{points.sigma[i]}, double{points.sigma[j]});
                        const double spacing = std::max(points.z[i], points.z[j]) / view.camera.fx;
                        const double off = std::min(offNeighboursPlane(points, c, r, c2, r2),
                                                    offNeighboursPlane(points, c2, r2, c, r));
                        if (std::abs(weight - noise - spacing) < 1e-5 ||
                            std::abs(off - noise) < 1e-4) {
                            continue;  // rounding decides
                        }
                        const bool tooLong = weight > noise + spacing;
                        EXPECT_EQ(high, tooLong && off > noise) << c << ' ' << r;
                        high3 += high ? 1 : 0;
                        explained += tooLong && off < noise ? 1 : 0;
                        if (!tooLong && off > noise) {  // what one term alone keeps low
                            withinSpacing += weight > noise ? 1 : 0;
                            withinNoise += weight > options.targetResolution + spacing ? 1 : 0;
                        }
                    }
                }
                EXPECT_EQ(points.kinds[i],
                          options.typedOpenness ? kinds : kinds & unsigned{kDepthStep});
            }
        }
        EXPECT_EQ(points.validCount, valid);
    }
    EXPECT_GT(high3, 100U);
    EXPECT_GT(explained, 100U);
    EXPECT_GT(withinSpacing, 100U);
    EXPECT_GT(withinNoise, 100U);
}

/// Depth behind which nothing matches in a tile of 8 x 8 pixels: that of the farthest pixel, with
/// its gate, of the tile and of those around it.
std::vector<double> slowReach(const ViewPoints& points, const GraphOptions& options) {
    const int columns = (points.width + 7) / 8, rows = (points.height + 7) / 8;
    std::vector<double> reach(static_cast<std::size_t>(columns * rows), 0.0);
    for (int r = 0; r < points.height; ++r) {
        for (int c = 0; c < points.width; ++c) {
            const std::size_t i = points.index(c, r);
            if (!(points.z[i] > 0)) {
                continue;
            }
            const double most = points.z[i] + Association::gate(points, i, options).depth;
            for (int tr = std::max(0, r / 8 - 1); tr <= std::min(rows - 1, r / 8 + 1); ++tr) {
                for (int tc = std::max(0, c / 8 - 1); tc <= std::min(columns - 1, c / 8 + 1);
                     ++tc) {
                    double& tile = reach[static_cast<std::size_t>(tr * columns + tc)];
                    tile = std::max(tile, most);
                }
            }
        }
    }
    return reach;
}

TEST(GraphKernels, ProjectionIsEquation4) {
    std::size_t justWithin = 0, justBeyond = 0;  // 1 cm of where a tile ends
    for (std::uint64_t seed = 1; seed <= 16; ++seed) {
        SCOPED_TRACE("seed " + std::to_string(seed));
        Random random(seed);
        const Scene scene = randomScene(random);
        const GraphOptions options = randomOptions(random);
        PixelGraph graph(options);
        for (int i = 0; i < 2; ++i) {
            graph.merge(oddView(random, scene));
        }
        // As if the surface were nearer, so that some of the map lies about where tiles cease to
        // reach.
        View view = oddView(random, scene);
        const auto nearer = static_cast<float>(random.in(1.0, 2.0));
        for (float& d : view.disparity.disparity) {
            d *= nearer;
        }
        ViewPoints points;
        points.build(view, options);
        Association fast;
        fast.project(graph.storage(), points, options);
        const Pose toCamera = view.world_T_camera.inverse();
        std::set<VertexId> seen;
        for (std::uint32_t k = 0; k < fast.candidateCount(); ++k) {
            if (!fast.inView(k)) {
                continue;
            }
            const VertexId id = fast.idOf(k);
            ASSERT_TRUE(graph.alive(id));
            seen.insert(id);
            const Eigen::Vector3d p = toCamera * Eigen::Vector3d(graph.position(id).cast<double>());
            const Eigen::Vector2d px = view.camera.project(p);
            const Candidate candidate = fast.candidate(k);
            EXPECT_NEAR(candidate.z, p.z(), 1e-5);
            EXPECT_NEAR(candidate.u, px.x(), 2e-3);
            EXPECT_NEAR(candidate.v, px.y(), 2e-3);
            EXPECT_EQ(candidate.sigma, graph.vertex(id).sigma);
        }
        // What is left out lies outside, or behind everything near there with its gate.
        const std::vector<double> reach = slowReach(points, options);
        const int tileColumns = (points.width + 7) / 8;
        graph.forEachVertex([&](VertexId id) {
            const Eigen::Vector3d p = toCamera * Eigen::Vector3d(graph.position(id).cast<double>());
            const Eigen::Vector2d px = view.camera.project(p);
            const bool inside = p.z() > 0.02 && px.x() > 0 && px.y() > 0 &&
                                px.x() < points.width - 1 && px.y() < points.height - 1;
            const Eigen::Vector2d pixel(std::floor(px.x() + 0.5), std::floor(px.y() + 0.5));
            const double rounding = (px - pixel).cwiseAbs().maxCoeff();  // 0.5: either pixel
            if (!inside || rounding > 0.49) {
                return;
            }
            const auto tile = static_cast<std::size_t>(
                static_cast<int>(pixel.y()) / 8 * tileColumns + static_cast<int>(pixel.x()) / 8);
            const double beyond =
                p.z() - reach[tile] - kNoiseGate * static_cast<double>(graph.vertex(id).sigma);
            if (std::abs(beyond) > 1e-4) {
                EXPECT_EQ(seen.count(id) == 1, beyond < 0) << "vertex " << id;
                justWithin += beyond < 0 && beyond > -0.01 ? 1 : 0;
                justBeyond += beyond > 0 && beyond < 0.01 ? 1 : 0;
            }
        });
    }
    EXPECT_GT(justWithin, 50U);
    EXPECT_GT(justBeyond, 50U);
}

/// What the pixels of a vertex say beside its place, one by one.
void slowUpdate(const ViewPoints& points, const Association::Claims& claims, float sigma,
                bool roundEdge, const GraphOptions& options, Page& page, std::uint32_t slot) {
    const auto pixel = static_cast<std::uint32_t>(claims.best);
    unsigned state = page.state[slot];
    const unsigned evidence = (state & kEvidenceMask) >> kEvidenceShift;
    state = (state & ~unsigned{kEvidenceMask}) | (evidence > 0 ? evidence - 1 : 0)
                                                     << kEvidenceShift;
    state |= (claims.flags & Association::kSomeOpen) == 0 ? unsigned{kSurrounded} : 0U;
    state |= (claims.flags & Association::kSomeFine) != 0 ? unsigned{kFineEnough} : 0U;
    const unsigned before = page.open[slot] & ~unsigned{kTooCoarse};
    const unsigned now = claims.flags >> Association::kKindsShift;
    const unsigned kinds = (before & now) != 0 ? before & now : now;
    unsigned open = (state & kSurrounded) != 0 ? 0 : kinds;
    if (options.typedOpenness &&
        ((state & kFineEnough) == 0 || 2 * sigma > static_cast<float>(options.targetResolution))) {
        open |= kTooCoarse;
    }
    page.state[slot] = static_cast<std::uint8_t>(state);
    page.open[slot] = static_cast<std::uint8_t>(open);
    const bool frontal = points.stretch[pixel] >= 1 && points.stretch[pixel] <= 2;
    if (frontal && (claims.flags & Association::kSomeSurrounded) != 0 &&
        (claims.flags & Association::kSomeOpen) == 0 && !roundEdge) {
        page.area[slot] =
            compact::Area::encode(static_cast<float>(claims.area) * Association::kAreaUnit);
    }
}

/// A page of vertices anywhere, and for most of them pixels that matched.
struct FusionCase {
    Page page{};
    std::array<Association::Claims, Page::kSize> claims{};
    std::array<float, Page::kSize> sigma{};
    PageFusion fusion;
    FusionCase(Random& random, const ViewPoints& points, const GraphOptions& options) {
        std::vector<std::uint32_t> pixels;
        for (std::uint32_t i = 0; i < points.z.size(); ++i) {
            if (points.z[i] > 0) {
                pixels.push_back(i);
            }
        }
        const auto below = [&random](std::size_t n) {
            return static_cast<std::uint32_t>(random.below(static_cast<int>(n)));
        };
        for (std::uint32_t s = 0; s < Page::kSize; ++s) {
            page.x[s] = static_cast<float>(random.in(-2, 2));
            page.y[s] = static_cast<float>(random.in(-2, 2));
            page.z[s] = static_cast<float>(random.in(-2, 2));
            page.sigma[s] = compact::Sigma::encode(static_cast<float>(random.in(0, 0.02)));
            sigma[s] = compact::Sigma::decode(page.sigma[s]);
            page.normal[s] =
                below(8) == 0 ? 0 : compact::encodeDirection(random.point(1).cast<float>());
            page.area[s] = static_cast<std::uint16_t>(below(0x10000));
            page.open[s] = static_cast<std::uint8_t>(below(16));
            page.state[s] = static_cast<std::uint8_t>(below(64));
            for (std::uint8_t& channel : page.rgb[s]) {
                channel = static_cast<std::uint8_t>(below(256));
            }
            if (below(4) != 0) {
                claims[s] = {std::uint64_t{below(1000)} << 32U | pixels[below(pixels.size())],
                             below(2) == 0 ? below(2000) : below(2000) << 20U, below(64)};
            }
            fusion.inView |= std::uint64_t{below(8) != 0} << s;
        }
        fusion.claims = claims.data();
        fusion.before = sigma.data();
        fusion.firstStays = options.fusion == GraphOptions::Fusion::kFirst;
        fusion.typedOpenness = options.typedOpenness;
        fusion.targetResolution = static_cast<float>(options.targetResolution);
    }
};

TEST(GraphKernels, FusionIsByInverseVariance) {
    std::size_t fused = 0, turned = 0, round = 0, grown = 0;
    for (std::uint64_t seed = 1; seed <= 12; ++seed) {
        SCOPED_TRACE("seed " + std::to_string(seed));
        Random random(seed);
        const Scene scene = randomScene(random);
        const GraphOptions options = randomOptions(random);
        ViewPoints points;
        points.build(oddView(random, scene), options);
        FusionCase given(random, points, options);
        const Page old = given.page;
        Page& page = given.page;
        PageFusion& fusion = given.fusion;
        fuseMatched(points, page, fusion);
        Page expected = old;
        bool touched = false;
        std::int64_t area = 0;
        for (std::uint32_t s = 0; s < Page::kSize; ++s) {
            SCOPED_TRACE("slot " + std::to_string(s));
            const Association::Claims& claims = given.claims[s];
            const auto i = static_cast<std::uint32_t>(claims.best);
            const bool matched = ((fusion.inView >> s) & 1U) != 0 && i != Association::kNone;
            ASSERT_EQ((fusion.matched >> s) & 1U, matched ? 1U : 0U);
            if (!matched || fusion.firstStays) {
                EXPECT_EQ(page.position(s), old.position(s));
                EXPECT_EQ(page.sigma[s], old.sigma[s]);
                EXPECT_EQ(page.normal[s], old.normal[s]);
                EXPECT_EQ(page.rgb[s], old.rgb[s]);
                EXPECT_EQ((fusion.moved >> s) & 1U, 0U);
            }
            bool roundEdge = false;
            if (matched && !fusion.firstStays) {
                ++fused;
                const int c = static_cast<int>(i) % points.width,
                          r = static_cast<int>(i) / points.width;
                const float a = std::max(given.sigma[s], kTinySigma);
                const float b = std::max(points.sigma[i], kLeastSigma);
                const float gain = a * a / (a * a + b * b);
                const Eigen::Vector3f step = (points.inMap(c, r) - old.position(s)) * gain;
                EXPECT_LT((page.position(s) - old.position(s) - step).norm(), 1e-5F);
                EXPECT_NEAR(compact::Sigma::decode(page.sigma[s]), 1 / std::hypot(1 / a, 1 / b),
                            1e-5);
                for (std::size_t k = 0; k < 3; ++k) {
                    const auto was = static_cast<float>(old.rgb[s][k]);
                    const auto is = static_cast<float>((points.look[i] >> (8 * k)) & 0xFFU);
                    EXPECT_EQ(page.rgb[s][k], compact::roundNearest(was + gain * (is - was)));
                }
                const float spacing = points.z[i] * points.footprint;
                const bool noisy = points.sigma[i] > 0.25F * spacing;
                if (noisy && points.onPatch(c, r)) {
                    ++turned;
                    const Eigen::Vector3f known = compact::decodeDirection(old.normal[s]);
                    const Eigen::Vector3f seen = points.rotation * points.patch(c, r).normal;
                    const Eigen::Vector3f mixed = (1 - gain) * known + gain * seen;
                    EXPECT_LT(
                        (compact::decodeDirection(page.normal[s]) - mixed.normalized()).norm(),
                        1e-3F);
                    roundEdge = old.normal[s] != 0 && known.dot(seen) < kSameSide;
                    round += roundEdge ? 1 : 0;
                } else {
                    EXPECT_EQ(page.normal[s], old.normal[s]);
                }
                if (std::abs(step.norm() - 0.02F * spacing) > 1e-6F) {
                    EXPECT_EQ(((fusion.moved >> s) & 1U) != 0,
                              !noisy && step.norm() > 0.02F * spacing);
                }
            }
            if (matched) {
                const float sigma =
                    fusion.firstStays ? given.sigma[s]
                                      : 1 / std::hypot(1 / std::max(given.sigma[s], kTinySigma),
                                                       1 / std::max(points.sigma[i], kLeastSigma));
                slowUpdate(points, claims, sigma, roundEdge, options, expected, s);
                touched = touched || expected.open[s] != 0 || old.open[s] != 0;
            }
            EXPECT_EQ(page.state[s], expected.state[s]);
            EXPECT_EQ(page.open[s], expected.open[s]);
            EXPECT_EQ(page.area[s], expected.area[s]);
            area += compact::areaUnits(expected.area[s]) - compact::areaUnits(old.area[s]);
            grown += expected.area[s] != old.area[s] ? 1 : 0;
        }
        EXPECT_EQ(fusion.area, area);
        EXPECT_EQ(fusion.touched, touched);
    }
    EXPECT_GT(fused, 200U);
    EXPECT_GT(turned, 20U);
    EXPECT_GT(round, 5U);
    EXPECT_GT(grown, 20U);
}

TEST(GraphKernels, ListedEdgesAreThoseBetweenDifferentVerticesNotBothNew) {
    for (std::uint64_t seed = 1; seed <= 50; ++seed) {
        SCOPED_TRACE("seed " + std::to_string(seed));
        Random random(seed);
        const auto count = static_cast<std::size_t>(1 + random.below(100));
        const auto width = static_cast<std::size_t>(1 + random.below(20));
        const std::size_t all = count + width + kEdgePadding;
        std::vector<VertexId> vertex(all);
        std::vector<std::uint8_t> fresh(all);
        std::vector<std::uint16_t> right(all), down(all);
        for (std::size_t i = 0; i < all; ++i) {
            vertex[i] = static_cast<VertexId>(random.below(5));
            fresh[i] = static_cast<std::uint8_t>(random.below(2));
            for (auto* code : {&right[i], &down[i]}) {
                *code = random.below(4) == 0 ? ViewPoints::kNoEdge
                                             : static_cast<std::uint16_t>(random.below(0xFFFF));
            }
        }
        std::vector<VertexId> a(all), b(all), c(all);
        std::vector<std::uint32_t> codes(all);
        const std::size_t n =
            listEdges({vertex.data(), fresh.data(), right.data(), down.data(), count, width},
                      {a.data(), b.data(), c.data(), codes.data()});
        std::size_t k = 0;
        for (std::size_t i = 0; i < count; ++i) {
            const auto end = [&](std::uint16_t code, std::size_t j) {
                const bool nothing = code == ViewPoints::kNoEdge || vertex[i] == vertex[j] ||
                                     (fresh[i] != 0 && fresh[j] != 0);
                return nothing ? kNoVertex : vertex[j];
            };
            const VertexId beside = end(right[i], i + 1), below = end(down[i], i + width);
            if (beside == kNoVertex && below == kNoVertex) {
                continue;
            }
            ASSERT_LT(k, n);
            EXPECT_EQ(a[k], vertex[i]);
            EXPECT_EQ(b[k], beside);
            EXPECT_EQ(c[k], below);
            EXPECT_EQ(codes[k], right[i] | (static_cast<std::uint32_t>(down[i]) << 16U));
            ++k;
        }
        EXPECT_EQ(k, n);
    }
}

}  // namespace
}  // namespace riftmap
