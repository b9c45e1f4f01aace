// SPDX-License-Identifier: BSD-3-Clause
#include "middlebury.h"

#include <zlib.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <stdexcept>

namespace riftmap::bench {
namespace {

constexpr float kUnknown = kNoDisparity;

std::string bytesOf(const std::string& file) {
    std::ifstream in(file, std::ios::binary);
    if (!in) {
        throw std::runtime_error(file + ": cannot be read");
    }
    return {std::istreambuf_iterator<char>(in), {}};
}

/// Little-endian number of `n` bytes at `offset`.
std::size_t number(const std::string& bytes, std::size_t offset, std::size_t n) {
    if (offset + n > bytes.size()) {
        throw std::runtime_error("archive is cut short");
    }
    std::size_t value = 0;
    for (std::size_t i = n; i-- > 0;) {
        value = value << 8U | static_cast<unsigned char>(bytes[offset + i]);
    }
    return value;
}

std::string inflated(const char* data, std::size_t size, std::size_t fullSize) {
    std::string out(fullSize, '\0');
    z_stream stream{};
    stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(data));
    stream.avail_in = static_cast<uInt>(size);
    stream.next_out = reinterpret_cast<Bytef*>(out.data());
    stream.avail_out = static_cast<uInt>(fullSize);
    const bool ok = inflateInit2(&stream, -MAX_WBITS) == Z_OK;
    const int end = ok ? inflate(&stream, Z_FINISH) : Z_DATA_ERROR;
    inflateEnd(&stream);
    if (end != Z_STREAM_END) {
        throw std::runtime_error("deflated data is damaged");
    }
    return out;
}

/// The first member of a zip archive, sizes taken from its central directory.
std::string firstMember(const std::string& zip) {
    const auto central = zip.rfind("PK\x01\x02");
    if (zip.compare(0, 4, "PK\x03\x04") != 0 || central == std::string::npos) {
        throw std::runtime_error("not a zip archive");
    }
    const auto method = number(zip, central + 10, 2);
    const auto packed = number(zip, central + 20, 4);
    const auto full = number(zip, central + 24, 4);
    const auto local = number(zip, central + 42, 4);
    const auto data = local + 30 + number(zip, local + 26, 2) + number(zip, local + 28, 2);
    if (data + packed > zip.size() || (method != 0 && method != 8)) {
        throw std::runtime_error("zip archive is cut short or packed in an unknown way");
    }
    return method == 0 ? zip.substr(data, packed) : inflated(zip.data() + data, packed, full);
}

/// Bytes scaled to pixels; zero is unknown.
cv::Mat scaledTruth(const std::string& file, double pixelsPerLevel) {
    const cv::Mat levels = cv::imread(file, cv::IMREAD_GRAYSCALE);
    if (levels.empty()) {
        throw std::runtime_error(file + ": cannot be read");
    }
    cv::Mat truth;
    levels.convertTo(truth, CV_32F, pixelsPerLevel);
    truth.setTo(kUnknown, levels == 0);
    return truth;
}

/// A point is hidden where a nearer one falls on the same place of the right image.
cv::Mat visibleMask(const cv::Mat& truth) {
    cv::Mat visible(truth.size(), CV_8U, cv::Scalar(0));
    std::vector<float> nearest;
    for (int r = 0; r < truth.rows; ++r) {
        const auto* d = truth.ptr<float>(r);
        nearest.assign(static_cast<std::size_t>(truth.cols) + 1, -kUnknown);
        const auto land = [&](int c, auto&& use) {
            const float x = static_cast<float>(c) - d[c];
            if (std::isfinite(x) && x >= 0) {
                const auto low = static_cast<std::size_t>(x);
                use(nearest[low]);
                use(nearest[low + 1]);
            }
        };
        for (int c = 0; c < truth.cols; ++c) {
            land(c, [&](float& n) { n = std::max(n, d[c]); });
        }
        for (int c = 0; c < truth.cols; ++c) {
            bool seen = false;
            bool hidden = false;
            land(c, [&](float& n) {
                seen = true;
                hidden = hidden || n > d[c] + 1;
            });
            visible.at<std::uint8_t>(r, c) = seen && !hidden ? 255 : 0;
        }
    }
    return visible;
}

cv::Mat nearStepMask(const cv::Mat& truth) {
    constexpr float kStep = 2;
    constexpr int kReach = 6;
    cv::Mat steps(truth.size(), CV_8U, cv::Scalar(0));
    const auto mark = [&](int r, int c, int r2, int c2) {
        if (r2 < truth.rows && c2 < truth.cols &&
            std::abs(truth.at<float>(r, c) - truth.at<float>(r2, c2)) >= kStep &&
            std::isfinite(truth.at<float>(r, c)) && std::isfinite(truth.at<float>(r2, c2))) {
            steps.at<std::uint8_t>(r, c) = steps.at<std::uint8_t>(r2, c2) = 255;
        }
    };
    for (int r = 0; r < truth.rows; ++r) {
        for (int c = 0; c < truth.cols; ++c) {
            mark(r, c, r + 1, c);
            mark(r, c, r, c + 1);
        }
    }
    cv::dilate(steps, steps, cv::Mat::ones(2 * kReach + 1, 2 * kReach + 1, CV_8U));
    return steps;
}

/// Counts over a part of the image.
struct Tally {
    double pixels = 0, matched = 0, bad1 = 0, bad2 = 0, error = 0;

    void add(float truth, float found) {
        ++pixels;
        if (std::isfinite(found)) {
            const double e = std::abs(static_cast<double>(found) - static_cast<double>(truth));
            ++matched;
            bad1 += e > 1 ? 1 : 0;
            bad2 += e > 2 ? 1 : 0;
            error += e;
        }
    }
    double ofMatched(double v) const { return matched > 0 ? v / matched : 0; }
};

}  // namespace

cv::Mat readNpz(const std::string& file) {
    try {
        const std::string npy = firstMember(bytesOf(file));
        if (npy.compare(0, 6, "\x93NUMPY") != 0 || npy.at(6) != 1) {
            throw std::runtime_error("no NumPy array of format 1 inside");
        }
        const auto length = number(npy, 8, 2);
        const std::string header = npy.substr(10, length);
        if (header.find("'<f4'") == std::string::npos ||
            header.find("'fortran_order': False") == std::string::npos) {
            throw std::runtime_error("not a float32 array in C order");
        }
        int rows = 0;
        int cols = 0;
        const auto shape = header.find("'shape': (");
        if (shape == std::string::npos ||
            std::sscanf(header.c_str() + shape, "'shape': (%d, %d)", &rows, &cols) != 2 ||
            rows <= 0 || cols <= 0) {
            throw std::runtime_error("not a 2-D array");
        }
        cv::Mat array(rows, cols, CV_32F);
        const std::size_t bytes = array.total() * sizeof(float);
        if (npy.size() < 10 + length + bytes) {
            throw std::runtime_error("array is cut short");
        }
        std::memcpy(array.data, npy.data() + 10 + length, bytes);
        return array;
    } catch (const std::exception& e) {
        throw std::runtime_error(file + ": " + e.what());
    }
}

std::optional<Pair> loadPair(const std::string& folder, const std::string& name) {
    struct Files {
        const char *name, *left, *right, *truth;
        double pixelsPerLevel;  ///< 0: an .npz of pixels
        int numDisparities;
        double truthSigma;
    };
    // Aloe and Cones: rounded to a level. Tsukuba: labels of surfaces drawn parallel to the image.
    const double kLevel = 1 / std::sqrt(12.0);
    const Files kFiles[] = {
        {"motorcycle", "motorcycle_skimage/motorcycle_left.png",
         "motorcycle_skimage/motorcycle_right.png", "motorcycle_skimage/motorcycle_disp.npz", 0, 64,
         0},
        {"aloe", "aloe/aloeL.jpg", "aloe/aloeR.jpg", "aloe/aloeGT.png", 1, 224, kLevel},
        {"cones", "cones/im2.png", "cones/im6.png", "cones/disp2.png", 0.25, 64, 0.25 * kLevel},
        {"tsukuba", "tsukuba/tsukuba_l.png", "tsukuba/tsukuba_r.png", "tsukuba/tsukuba_gt.pgm",
         1.0 / 16, 16, 0},
    };
    const auto* files = std::find_if(std::begin(kFiles), std::end(kFiles),
                                     [&](const Files& f) { return name == f.name; });
    if (files == std::end(kFiles)) {
        throw std::runtime_error("no pair is called " + name);
    }
    const std::string base = folder + "/";
    if (!std::filesystem::exists(base + files->left)) {
        return std::nullopt;
    }
    Pair pair{.name = name,
              .left = cv::imread(base + files->left, cv::IMREAD_COLOR),
              .right = cv::imread(base + files->right, cv::IMREAD_COLOR),
              .truth = files->pixelsPerLevel > 0
                           ? scaledTruth(base + files->truth, files->pixelsPerLevel)
                           : readNpz(base + files->truth),
              .numDisparities = files->numDisparities,
              .truthSigma = files->truthSigma,
              .visible = {},
              .nearStep = {}};
    if (pair.left.empty() || pair.left.size() != pair.right.size() ||
        pair.left.size() != pair.truth.size()) {
        throw std::runtime_error(base + files->left + ": images and truth do not agree in size");
    }
    pair.visible = visibleMask(pair.truth);
    pair.nearStep = nearStepMask(pair.truth);
    return pair;
}

Score score(const Pair& pair, const DisparityImage& disparity) {
    Tally all, steps;
    double hidden = 0, invented = 0, sum = 0, sum2 = 0, n = 0;
    for (int r = 0; r < disparity.height; ++r) {
        for (int c = 0; c < disparity.width; ++c) {
            const float truth = pair.truth.at<float>(r, c);
            const float found = disparity.at(c, r);
            if (pair.visible.at<std::uint8_t>(r, c) == 0) {
                if (std::isfinite(truth)) {
                    ++hidden;
                    invented += std::isfinite(found) ? 1 : 0;
                }
                continue;
            }
            all.add(truth, found);
            if (pair.nearStep.at<std::uint8_t>(r, c) != 0) {
                steps.add(truth, found);
            }
            const double sigma = std::hypot(
                static_cast<double>(disparity.sigma[disparity.index(c, r)]), pair.truthSigma);
            if (std::abs(found - truth) <= 1) {
                const double z = static_cast<double>(found - truth) / sigma;
                sum += z;
                sum2 += z * z;
                ++n;
            }
        }
    }
    const auto percent = [](double part, double whole) {
        return whole > 0 ? 100 * part / whole : 0;
    };
    const double mean = n > 0 ? sum / n : 0;
    return {.matched = percent(all.matched, all.pixels),
            .bad1 = 100 * all.ofMatched(all.bad1),
            .bad2 = 100 * all.ofMatched(all.bad2),
            .meanError = all.ofMatched(all.error),
            .matchedSteps = percent(steps.matched, steps.pixels),
            .bad1Steps = 100 * steps.ofMatched(steps.bad1),
            .bad2Steps = 100 * steps.ofMatched(steps.bad2),
            .meanErrorSteps = steps.ofMatched(steps.error),
            .occluded = percent(invented, hidden),
            .residual = n > 0 ? std::sqrt(std::max(0.0, sum2 / n - mean * mean)) : 0};
}

}  // namespace riftmap::bench
