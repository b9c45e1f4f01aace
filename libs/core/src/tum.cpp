// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/core/tum.h"

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <limits>
#include <ostream>
#include <sstream>
#include <stdexcept>

#include "riftmap/core/file.h"
#include "riftmap/core/text.h"

namespace riftmap {
namespace {

constexpr int kNanosecondDigits = 9;
constexpr double kMaxQuaternionError = 1e-2;

/// A decimal number taken apart: digits * 10^exponent.
struct Decimal {
    bool negative = false;
    std::string digits;
    std::int64_t exponent = 0;
};

[[noreturn]] void notATime(const std::string& text) {
    throw std::invalid_argument("'" + text + "' is not a time in seconds");
}

Decimal takeApart(const std::string& text) {
    Decimal number;
    std::size_t i = 0;
    if (i < text.size() && (text[i] == '-' || text[i] == '+')) {
        number.negative = text[i] == '-';
        ++i;
    }
    bool point = false;
    for (; i < text.size() && (text[i] == '.' || (text[i] >= '0' && text[i] <= '9')); ++i) {
        if (text[i] != '.') {
            number.digits += text[i];
            number.exponent -= point ? 1 : 0;
        } else if (point) {
            notATime(text);
        } else {
            point = true;
        }
    }
    if (number.digits.empty()) {
        notATime(text);
    }
    if (i < text.size()) {
        const bool plus = i + 1 < text.size() && text[i + 1] == '+';
        const auto exponent = toInteger(text.substr(std::min(text.size(), i + (plus ? 2U : 1U))));
        if ((text[i] != 'e' && text[i] != 'E') || !exponent || std::abs(*exponent) > 400) {
            notATime(text);
        }
        number.exponent += *exponent;
    }
    return number;
}

TimedPose parseLine(const std::vector<std::string_view>& fields) {
    if (fields.size() != 8) {
        throw std::invalid_argument(std::to_string(fields.size()) +
                                    " fields, not the 8 of 't x y z qx qy qz qw'");
    }
    TimedPose timed;
    timed.time_ns = nanosecondsFromText(std::string(fields[0]));
    std::array<double, 7> v{};
    for (std::size_t i = 0; i < v.size(); ++i) {
        const auto value = toDouble(fields[i + 1]);
        if (!value || !std::isfinite(*value)) {
            throw std::invalid_argument("'" + std::string(fields[i + 1]) +
                                        "' is not a finite number");
        }
        v[i] = *value;
    }
    const Eigen::Quaterniond q(v[6], v[3], v[4], v[5]);
    if (std::abs(q.norm() - 1) > kMaxQuaternionError) {
        throw std::invalid_argument("the quaternion has the norm " + toText(q.norm()) + ", not 1");
    }
    timed.pose.translation = {v[0], v[1], v[2]};
    timed.pose.rotation = q.normalized().toRotationMatrix();
    return timed;
}

}  // namespace

std::int64_t nanosecondsFromText(const std::string& seconds) {
    Decimal number = takeApart(seconds);
    number.exponent += kNanosecondDigits;
    if (number.exponent > 0) {
        number.digits.append(static_cast<std::size_t>(number.exponent), '0');
    }
    bool roundUp = false;
    if (number.exponent < 0) {
        const auto dropped = static_cast<std::size_t>(-number.exponent);
        number.digits.insert(0, dropped > number.digits.size() ? dropped - number.digits.size() : 0,
                             '0');
        roundUp = number.digits[number.digits.size() - dropped] >= '5';
        number.digits.resize(number.digits.size() - dropped);
        number.digits.insert(0, 1, '0');
    }
    const auto value = toInteger(number.digits);
    if (!value || *value == std::numeric_limits<std::int64_t>::max()) {
        notATime(seconds);
    }
    const std::int64_t rounded = *value + (roundUp ? 1 : 0);
    return number.negative ? -rounded : rounded;
}

std::string textFromNanoseconds(std::int64_t time_ns) {
    // As text, so that the smallest number needs no care.
    std::string digits = std::to_string(time_ns);
    const bool negative = digits[0] == '-';
    digits.erase(0, negative ? 1 : 0);
    if (digits.size() <= kNanosecondDigits) {
        digits.insert(0, kNanosecondDigits + 1 - digits.size(), '0');
    }
    digits.insert(digits.size() - kNanosecondDigits, ".");
    return (negative ? "-" : "") + digits;
}

std::vector<TimedPose> readTum(const std::filesystem::path& file) {
    std::istringstream in(readFile(file));
    std::vector<TimedPose> trajectory;
    std::string line;
    for (int number = 1; std::getline(in, line); ++number) {
        const auto fields = words(std::string_view(line).substr(0, line.find('#')));
        if (fields.empty()) {
            continue;
        }
        try {
            const TimedPose timed = parseLine(fields);
            if (!trajectory.empty() && timed.time_ns <= trajectory.back().time_ns) {
                throw std::invalid_argument("the time " + textFromNanoseconds(timed.time_ns) +
                                            " is not after the one before");
            }
            trajectory.push_back(timed);
        } catch (const std::invalid_argument& e) {
            throw FileError(file.string() + ":" + std::to_string(number) + ": " + e.what());
        }
    }
    return trajectory;
}

std::string tumLine(const TimedPose& timed) {
    Eigen::Quaterniond q(timed.pose.rotation);
    if (q.w() < 0) {  // of the two that mean the same, always this one
        q.coeffs() = -q.coeffs();
    }
    std::string line = textFromNanoseconds(timed.time_ns);
    const Eigen::Vector3d& t = timed.pose.translation;
    for (const double v : {t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w()}) {
        line += " " + toText(v + 0.0);  // no "-0"
    }
    return line;
}

void writeTum(const std::filesystem::path& file, const std::vector<TimedPose>& trajectory) {
    for (std::size_t i = 0; i < trajectory.size(); ++i) {
        if (!isValid(trajectory[i].pose)) {
            throw std::invalid_argument(file.string() + ": pose " + std::to_string(i) +
                                        " is not valid");
        }
        if (i > 0 && trajectory[i].time_ns <= trajectory[i - 1].time_ns) {
            throw std::invalid_argument(file.string() + ": the time of pose " + std::to_string(i) +
                                        " is not after the one before");
        }
    }
    writeAtomically(file, [&](std::ostream& out) {
        for (const auto& timed : trajectory) {
            out << tumLine(timed) << '\n';
        }
    });
}

}  // namespace riftmap
