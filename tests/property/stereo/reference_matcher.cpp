// SPDX-License-Identifier: BSD-3-Clause
#include "reference_matcher.h"

#include <algorithm>
#include <array>
#include <climits>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <numeric>
#include <utility>
#include <vector>

namespace riftmap::reference {
namespace {

constexpr long kWorst = 65535;

/// An image of integers that repeats its border for ever.
struct Image {
    int width = 0, height = 0;
    std::vector<int> values;

    Image(int w, int h)
        : width(w), height(h), values(static_cast<std::size_t>(w) * static_cast<std::size_t>(h)) {}
    int& at(int x, int y) {
        x = std::clamp(x, 0, width - 1);
        y = std::clamp(y, 0, height - 1);
        return values[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                      static_cast<std::size_t>(x)];
    }
    int at(int x, int y) const { return const_cast<Image*>(this)->at(x, y); }
};

Image fromMat(const cv::Mat& m) {
    Image image(m.cols, m.rows);
    for (int y = 0; y < m.rows; ++y) {
        for (int x = 0; x < m.cols; ++x) {
            image.at(x, y) = m.at<std::uint8_t>(y, x);
        }
    }
    return image;
}

/// Sum over the outer product of the weights, centred at (x, y).
long filtered(const Image& image, int x, int y, const std::vector<int>& across,
              const std::vector<int>& down) {
    long sum = 0;
    for (int j = 0; j < static_cast<int>(down.size()); ++j) {
        for (int i = 0; i < static_cast<int>(across.size()); ++i) {
            sum += static_cast<long>(down[static_cast<std::size_t>(j)]) *
                   across[static_cast<std::size_t>(i)] *
                   image.at(x + i - static_cast<int>(across.size()) / 2,
                            y + j - static_cast<int>(down.size()) / 2);
        }
    }
    return sum;
}

Image prefiltered(const Image& image, const StereoOptions& o) {
    if (o.prefilter == Prefilter::kNone) {
        return image;
    }
    const std::vector<int> narrow = {1, 2, 1};
    const std::vector<int> wide = {4, 14, 31, 50, 58, 50, 31, 14, 4};
    Image out(image.width, image.height);
    for (int y = 0; y < image.height; ++y) {
        for (int x = 0; x < image.width; ++x) {
            long v = 0;
            if (o.prefilter == Prefilter::kGradient) {
                v = filtered(image, x, y, {-1, 0, 1}, narrow) * o.prefilterGain;
            } else {
                const double dog = static_cast<double>(filtered(image, x, y, narrow, narrow)) / 16 -
                                   static_cast<double>(filtered(image, x, y, wide, wide)) / 65536;
                v = static_cast<long>(std::floor(dog * o.prefilterGain + 0.5));
            }
            out.at(x, y) =
                128 + static_cast<int>(std::clamp<long>(v, -o.prefilterCap, o.prefilterCap));
        }
    }
    return out;
}

/// One number for each pixel and disparity index; pixels beyond the border repeat it.
struct Volume {
    int width, height, depth;
    std::vector<long> values;

    Volume(int w, int h, int n)
        : width(w),
          height(h),
          depth(n),
          values(static_cast<std::size_t>(w) * static_cast<std::size_t>(h) *
                 static_cast<std::size_t>(n)) {}
    long& at(int x, int y, int i) {
        x = std::clamp(x, 0, width - 1);
        y = std::clamp(y, 0, height - 1);
        return values[(static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                       static_cast<std::size_t>(x)) *
                          static_cast<std::size_t>(depth) +
                      static_cast<std::size_t>(i)];
    }
};

void forAll(Volume& v, const std::function<long(int, int, int)>& value) {
    for (int y = 0; y < v.height; ++y) {
        for (int x = 0; x < v.width; ++x) {
            for (int i = 0; i < v.depth; ++i) {
                v.at(x, y, i) = value(x, y, i);
            }
        }
    }
}

/// One path of semi-global matching along the rows; step +1: rightwards.
Volume path(Volume& cost, int step, long small, long large) {
    Volume out(cost.width, cost.height, cost.depth);
    for (int y = 0; y < cost.height; ++y) {
        for (int k = 0; k < cost.width; ++k) {
            const int x = step > 0 ? k : cost.width - 1 - k;
            long least = kWorst;
            for (int i = 0; k > 0 && i < cost.depth; ++i) {
                least = std::min(least, out.at(x - step, y, i));
            }
            for (int i = 0; i < cost.depth; ++i) {
                long way = 0;
                if (k > 0) {
                    way = std::min(out.at(x - step, y, i), least + large);
                    if (i > 0) {
                        way = std::min(way, out.at(x - step, y, i - 1) + small);
                    }
                    if (i + 1 < cost.depth) {
                        way = std::min(way, out.at(x - step, y, i + 1) + small);
                    }
                    way -= least;
                }
                out.at(x, y, i) = std::min(kWorst, cost.at(x, y, i) + way);
            }
        }
    }
    return out;
}

struct Layout {
    int half, offset, pixels;
};

Layout layoutOf(const StereoOptions& o) {
    const int offset = o.supportingWindows ? (o.window + 1) / 4 : 0;
    const int half = (o.window - 2 * offset) / 2;
    return {half, offset, (2 * half + 1) * (2 * half + 1) * (offset > 0 ? 3 : 1)};
}

Volume windowCosts(const Image& left, const Image& right, const StereoOptions& o) {
    const auto [half, offset, pixels] = layoutOf(o);
    Volume single(left.width, left.height, o.numDisparities);
    forAll(single, [&](int x, int y, int i) {
        return std::min(o.truncation,
                        std::abs(left.at(x, y) - right.at(x - o.minDisparity - i, y)));
    });
    Volume window = single;
    forAll(window, [&, h = half](int x, int y, int i) {
        long sum = 0;
        for (int v = -h; v <= h; ++v) {
            for (int u = -h; u <= h; ++u) {
                sum += single.at(x + u, y + v, i);
            }
        }
        return sum;
    });
    Volume cost = window;
    if (offset > 0) {
        forAll(cost, [&, f = offset](int x, int y, int i) {
            std::array<long, 4> support = {window.at(x - f, y - f, i), window.at(x + f, y - f, i),
                                           window.at(x - f, y + f, i), window.at(x + f, y + f, i)};
            std::sort(support.begin(), support.end());
            return window.at(x, y, i) + support[0] + support[1];
        });
    }
    return cost;
}

Volume semiGlobal(Volume& cost, const StereoOptions& o) {
    const auto penalty = [&](double p) { return std::lround(p * layoutOf(o).pixels); };
    const long large = std::max(1L, penalty(o.penaltyLarge));
    Volume toRight = path(cost, 1, penalty(o.penaltySmall), large);
    Volume toLeft = path(cost, -1, penalty(o.penaltySmall), large);
    Volume sum = cost;
    forAll(sum, [&](int x, int y, int i) {
        return std::min(kWorst, toRight.at(x, y, i) + toLeft.at(x, y, i));
    });
    return sum;
}

/// Disparity index of the right pixel's best match over the whole row; -1: outside.
int bestOfRight(Volume& cost, int column, int y, const StereoOptions& o) {
    int best = -1;
    long least = kWorst;
    for (int i = 0; i < cost.depth; ++i) {
        const int x = column + o.minDisparity + i;
        if (x >= 0 && x < cost.width && cost.at(x, y, i) < least) {
            least = cost.at(x, y, i);
            best = i;
        }
    }
    return best;
}

/// Index of the least cost, the lowest of equals.
int bestOfLeft(Volume& cost, int x, int y) {
    int best = 0;
    for (int i = 1; i < cost.depth; ++i) {
        best = cost.at(x, y, i) < cost.at(x, y, best) ? i : best;
    }
    return best;
}

/// Another minimum that costs up to `share` percent and `margin` grey levels a pixel more.
bool hasRival(Volume& cost, int x, int y, int best, int share, double margin,
              const StereoOptions& o) {
    const long least = cost.at(x, y, best);
    const long limit =
        least + least * (share * 65536 / 100) / 65536 + std::lround(margin * layoutOf(o).pixels);
    for (int i = 0; i < cost.depth; ++i) {
        if (std::abs(i - best) > 1 && cost.at(x, y, i) <= std::min(limit, kWorst - 1)) {
            return true;
        }
    }
    return false;
}

/// Is there a pixel within reach along the row whose window alone has the minimum that the
/// semi-global pass gave it, and no rival?
bool hasAnchor(Volume& own, Volume& cost, int x, int y, int firstColumn, const StereoOptions& o) {
    for (int u = std::max(firstColumn, x - o.anchorReach);
         u <= std::min(own.width - 1, x + o.anchorReach); ++u) {
        const int best = bestOfLeft(own, u, y);
        if (!hasRival(own, u, y, best, 0, o.anchorMargin, o) &&
            std::abs(best - bestOfLeft(cost, u, y)) <= 1) {
            return true;
        }
    }
    return false;
}

/// Immerkaer's estimate of the noise, block by block; see NoiseMeter.
double noiseOf(const Image& image) {
    std::vector<long> blocks;
    for (int y = 1; y + 8 < image.height; y += 8) {
        for (int x = 1; x + 8 < image.width; x += 8) {
            if ((x / 8 + y / 8) % 2 != 0) {
                continue;
            }
            long sum = 0;
            bool cut = false;
            for (int v = y; v < y + 8; ++v) {
                for (int u = x; u < x + 8; ++u) {
                    sum += std::abs(filtered(image, u, v, {1, -2, 1}, {1, -2, 1}));
                    cut = cut || image.at(u, v) < 8 || image.at(u, v) > 247;
                }
            }
            if (!cut) {
                blocks.push_back(sum);
            }
        }
    }
    std::sort(blocks.begin(), blocks.end());
    const double rounding = 1 / std::sqrt(12.0);
    return blocks.empty() ? rounding
                          : std::max(rounding, static_cast<double>(blocks[blocks.size() / 10]) /
                                                   (64 * (6 * 0.79788456)));
}

/// Standard deviation of a match from its minimum, without slope.
float sigmaOf(long least, long curvature, double noise, const StereoOptions& o) {
    double gain = 1;
    if (o.prefilter != Prefilter::kNone) {
        gain = (o.prefilter == Prefilter::kDog ? 0.2799 : 3.4641) * o.prefilterGain;
    }
    const double filtered = noise * gain * (o.semiGlobal ? 2 : 1);
    const int pixels = layoutOf(o).pixels;
    const auto floor =
        static_cast<float>(o.subpixel ? o.sigmaFloor : std::hypot(o.sigmaFloor, 0.288675));
    const auto random = static_cast<float>(o.sigmaNoise * filtered * std::sqrt(pixels));
    const auto explained = static_cast<float>(1.75 * 1.12838 * filtered * pixels);
    const auto mismatch = static_cast<float>(o.sigmaMismatch);
    const auto cost = static_cast<float>(least);
    const auto sharp = static_cast<float>(std::max(1L, curvature));
    const float excess = std::max(0.0F, cost * cost - explained * explained);
    return std::sqrt(floor * floor +
                     (random * random + mismatch * mismatch * excess) / (sharp * sharp));
}

void matchPixel(Volume& cost, int x, int y, double noise, const StereoOptions& o,
                DisparityImage& out) {
    const int best = bestOfLeft(cost, x, y);
    if (best == 0 || best == cost.depth - 1 ||
        (o.uniqueness > 0 && hasRival(cost, x, y, best, o.uniqueness, o.uniquenessMargin, o))) {
        return;
    }
    const int pixels = layoutOf(o).pixels;
    const long least = cost.at(x, y, best);
    const long before = cost.at(x, y, best - 1);
    const long after = cost.at(x, y, best + 1);
    const long curvature = before + after - 2 * least;
    if (curvature < std::lround(o.sharpness * pixels)) {
        return;
    }
    const int partner = x - o.minDisparity - best;
    if (partner < 0 || partner >= cost.width) {
        return;
    }
    if (o.leftRightCheck &&
        std::abs(bestOfRight(cost, partner, y, o) - best) > o.leftRightTolerance) {
        return;
    }
    const auto sharp = static_cast<float>(std::max(1L, curvature));
    float d = static_cast<float>(best + o.minDisparity);
    if (o.subpixel) {
        d += static_cast<float>(before - after) * 0.5F / sharp;
    }
    out.disparity[out.index(x, y)] = d;
    out.sigma[out.index(x, y)] = sigmaOf(least, curvature, noise, o);
}

DisparityImage level(const Image& left, const Image& right, double noise, const StereoOptions& o,
                     int firstColumn) {
    Volume own = windowCosts(prefiltered(left, o), prefiltered(right, o), o);
    Volume cost = o.semiGlobal ? semiGlobal(own, o) : own;
    DisparityImage out;
    out.resize(left.width, left.height);
    for (int y = 0; y < left.height; ++y) {
        for (int x = firstColumn; x < left.width; ++x) {
            if (!o.semiGlobal || hasAnchor(own, cost, x, y, firstColumn, o)) {
                matchPixel(cost, x, y, noise, o, out);
            }
        }
    }
    return out;
}

Image shrunk(const Image& image) {
    Image out(image.width / 4, image.height / 4);
    for (int y = 0; y < out.height; ++y) {
        for (int x = 0; x < out.width; ++x) {
            int sum = 0;
            for (int k = 0; k < 16; ++k) {
                sum += image.at(4 * x + k % 4, 4 * y + k / 4);
            }
            out.at(x, y) = (sum + 8) / 16;
        }
    }
    return out;
}

void removeIsolated(DisparityImage& image, int minSize, float maxDifference) {
    std::vector<char> seen(image.disparity.size(), 0);
    for (int y = 0; y < image.height; ++y) {
        for (int x = 0; x < image.width; ++x) {
            if (!image.valid(x, y) || seen[image.index(x, y)] != 0) {
                continue;
            }
            std::vector<std::pair<int, int>> group = {{x, y}};
            seen[image.index(x, y)] = 1;
            for (std::size_t k = 0; k < group.size(); ++k) {
                const auto [u, v] = group[k];
                const std::array<std::pair<int, int>, 4> around = {
                    {{u - 1, v}, {u + 1, v}, {u, v - 1}, {u, v + 1}}};
                for (const auto& [s, t] : around) {
                    if (s >= 0 && t >= 0 && s < image.width && t < image.height &&
                        image.valid(s, t) && seen[image.index(s, t)] == 0 &&
                        std::abs(image.at(s, t) - image.at(u, v)) <= maxDifference) {
                        seen[image.index(s, t)] = 1;
                        group.emplace_back(s, t);
                    }
                }
            }
            if (group.size() < static_cast<std::size_t>(minSize)) {
                for (const auto& [u, v] : group) {
                    image.disparity[image.index(u, v)] = kNoDisparity;
                }
            }
        }
    }
}

void guard(const Image& left, const Image& right, const StereoOptions& o, DisparityImage& out) {
    if (o.guard == 0 || left.width < 8 || left.height < 8) {
        return;
    }
    StereoOptions coarse = o;
    coarse.minDisparity = static_cast<int>(std::floor(o.minDisparity / 4.0));
    const int end = o.minDisparity + o.numDisparities + o.guard;
    coarse.numDisparities = static_cast<int>(std::ceil(end / 4.0)) + 2 - coarse.minDisparity;
    coarse.window = std::min(7, o.window);
    coarse.semiGlobal = false;
    coarse.subpixel = true;
    DisparityImage found = level(shrunk(left), shrunk(right), 0, coarse, 0);
    removeIsolated(found, 12, 1.0F);
    const auto tooNear = [&](int x, int y) {
        return x >= 0 && y >= 0 && x < found.width && y < found.height && found.valid(x, y) &&
               found.at(x, y) * 4 >= static_cast<float>(o.minDisparity + o.numDisparities + 1);
    };
    for (int y = 0; y < out.height; ++y) {
        for (int x = 0; x < out.width; ++x) {
            for (int k = 0; k < 9; ++k) {
                if (tooNear(x / 4 + k % 3 - 1, y / 4 + k / 3 - 1)) {
                    out.disparity[out.index(x, y)] = kNoDisparity;
                }
            }
        }
    }
}

/// Calls body(u, v) for the pixels of the image within reach of (x, y).
void around(const DisparityImage& image, int x, int y, int reach,
            const std::function<void(int, int)>& body) {
    for (int v = std::max(0, y - reach); v <= std::min(image.height - 1, y + reach); ++v) {
        for (int u = std::max(0, x - reach); u <= std::min(image.width - 1, x + reach); ++u) {
            body(u, v);
        }
    }
}

void trimRims(const Image& grey, const StereoOptions& o, DisparityImage& image) {
    if (o.rimTexture == 0) {
        return;
    }
    const auto patch = [&](int x, int y) {
        std::array<int, 9> values{};
        for (int k = 0; k < 9; ++k) {
            values.at(static_cast<std::size_t>(k)) = grey.at(x + k % 3 - 1, y + k / 3 - 1);
        }
        return values;
    };
    const auto flat = [&](int x, int y) {
        const auto p = patch(x, y);
        return *std::max_element(p.begin(), p.end()) - *std::min_element(p.begin(), p.end()) <=
               o.rimTexture;
    };
    const auto mean = [&](int x, int y) {
        const auto p = patch(x, y);
        return std::accumulate(p.begin(), p.end(), 0) / 9.0;
    };
    const auto bare = [&](const DisparityImage& of, int u, int v) {
        return u >= of.firstColumn && !of.valid(u, v);
    };
    DisparityImage before = image;
    for (int y = 0; y < image.height; ++y) {
        for (int x = 0; x < image.width; ++x) {
            around(image, x, y, 3, [&](int u, int v) {
                if (bare(before, u, v) && flat(x, y)) {
                    image.disparity[image.index(x, y)] = kNoDisparity;
                }
            });
        }
    }
    before = image;
    for (int y = 0; y < image.height; ++y) {
        for (int x = 0; x < image.width; ++x) {
            around(image, x, y, 2, [&](int u, int v) {
                if (bare(before, u, v) && flat(u, v) &&
                    std::abs(grey.at(x, y) - mean(u, v)) <= o.rimTexture / 2.0 + 1e-9) {
                    image.disparity[image.index(x, y)] = kNoDisparity;
                }
            });
        }
    }
}

void growSigma(DisparityImage& image, const StereoOptions& o) {
    if (o.sigmaSlope <= 0) {
        return;
    }
    for (int y = 0; y < image.height; ++y) {
        for (int x = 0; x < image.width; ++x) {
            if (!image.valid(x, y)) {
                continue;
            }
            const std::array<std::pair<int, int>, 4> sides = {
                {{x - 3, y}, {x + 3, y}, {x, y - 3}, {x, y + 3}}};
            float steepest = 0;
            for (const auto& [u, v] : sides) {
                if (u >= 0 && v >= 0 && u < image.width && v < image.height && image.valid(u, v)) {
                    steepest = std::max(steepest, std::abs(image.at(u, v) - image.at(x, y)));
                }
            }
            const float more = steepest * (static_cast<float>(o.sigmaSlope) / 3.0F);
            float& sigma = image.sigma[image.index(x, y)];
            sigma = std::sqrt(sigma * sigma + more * more);
        }
    }
}

void discardSilhouettes(DisparityImage& image, const StereoOptions& o) {
    const DisparityImage before = image;
    const int r = o.silhouetteReach;
    for (int y = 0; y < image.height; ++y) {
        for (int x = 0; x < image.width; ++x) {
            for (int v = std::max(0, y - o.silhouetteRows);
                 r > 0 && v <= std::min(image.height - 1, y + o.silhouetteRows); ++v) {
                for (int u = std::max(0, x - r); u <= std::min(image.width - 1, x + r); ++u) {
                    if (before.valid(x, y) && before.valid(u, v) &&
                        before.at(x, y) - before.at(u, v) > static_cast<float>(o.silhouetteStep)) {
                        image.disparity[image.index(x, y)] = kNoDisparity;
                    }
                }
            }
        }
    }
}

}  // namespace

DisparityImage match(const cv::Mat& left, const cv::Mat& right, const StereoOptions& o) {
    const Image l = fromMat(left), r = fromMat(right);
    const int last = o.minDisparity + o.numDisparities - 1;
    const double noise = o.imageNoise > 0 ? o.imageNoise : noiseOf(l);
    DisparityImage out = level(l, r, noise, o, std::clamp(last, 0, l.width));
    out.firstColumn = std::clamp(last, 0, l.width);
    guard(l, r, o, out);
    removeIsolated(out, o.isolatedSize, static_cast<float>(o.isolatedDifference));
    trimRims(l, o, out);
    discardSilhouettes(out, o);
    growSigma(out, o);
    return out;
}

}  // namespace riftmap::reference
