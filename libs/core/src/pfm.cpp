// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/core/pfm.h"

#include <bit>
#include <cmath>
#include <cstddef>
#include <ostream>
#include <stdexcept>
#include <string>

#include "endian.h"
#include "riftmap/core/file.h"
#include "riftmap/core/text.h"

namespace riftmap {
namespace {

constexpr std::int64_t kMaxSide = 65536;

/// Reads the header word by word; exactly one blank follows the last.
class Header {
 public:
    Header(std::string name, const std::string& bytes) : name_(std::move(name)), bytes_(bytes) {}

    std::string word() {
        while (at_ < bytes_.size() && isBlank(bytes_[at_])) {
            ++at_;
        }
        start_ = at_;
        while (at_ < bytes_.size() && !isBlank(bytes_[at_])) {
            ++at_;
        }
        return bytes_.substr(start_, at_ - start_);
    }
    int side(const char* what) {
        const std::string s = word();
        const auto value = toInteger(s);
        if (!value || *value < 1 || *value > kMaxSide) {
            fail(std::string(what) + " '" + s + "' is not a whole number 1 .. " +
                 std::to_string(kMaxSide));
        }
        return static_cast<int>(*value);
    }
    std::size_t dataOffset() const { return at_ + 1; }
    [[noreturn]] void fail(const std::string& what) const {
        throw FileError(name_ + ": byte " + std::to_string(start_) + ": " + what);
    }

 private:
    static bool isBlank(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\n'; }

    std::string name_;
    const std::string& bytes_;
    std::size_t at_ = 0, start_ = 0;
};

std::size_t area(int width, int height) {
    return static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
}

}  // namespace

FloatImage readPfm(const std::filesystem::path& file) {
    const std::string bytes = readFile(file);
    Header header(file.string(), bytes);
    if (const std::string magic = header.word(); magic != "Pf") {
        header.fail(magic == "PF" ? "a colour PFM; only grey ones ('Pf') are read"
                                  : "not a PFM file: it does not start with 'Pf'");
    }
    FloatImage image;
    image.width = header.side("width");
    image.height = header.side("height");
    const auto scale = toDouble(header.word());
    if (!scale || *scale == 0 || !std::isfinite(*scale)) {
        header.fail("the scale is not a number other than 0");
    }
    const std::size_t n = area(image.width, image.height);
    const std::size_t offset = header.dataOffset();
    if (bytes.size() < offset || bytes.size() - offset != n * sizeof(float)) {
        throw FileError(file.string() + ": byte " + std::to_string(offset) + ": " +
                        std::to_string(n * sizeof(float)) + " bytes of pixels must follow, not " +
                        std::to_string(bytes.size() - std::min(offset, bytes.size())));
    }
    const auto order = *scale < 0 ? std::endian::little : std::endian::big;
    image.values.resize(n);
    const auto width = static_cast<std::size_t>(image.width);
    const auto height = static_cast<std::size_t>(image.height);
    for (std::size_t row = 0; row < height; ++row) {
        const char* source = bytes.data() + offset + (height - 1 - row) * width * sizeof(float);
        for (std::size_t column = 0; column < width; ++column) {
            image.values[row * width + column] =
                fromBytes<float>(source + column * sizeof(float), order);
        }
    }
    return image;
}

void writePfm(const std::filesystem::path& file, const FloatImage& image) {
    if (image.width < 1 || image.height < 1 ||
        image.values.size() != area(image.width, image.height)) {
        throw std::invalid_argument(file.string() + ": an image of " + std::to_string(image.width) +
                                    " x " + std::to_string(image.height) + " pixels with " +
                                    std::to_string(image.values.size()) + " values");
    }
    writeAtomically(file, [&](std::ostream& out) {
        out << "Pf\n" << image.width << ' ' << image.height << "\n-1.0\n";
        const auto width = static_cast<std::size_t>(image.width);
        for (std::size_t row = static_cast<std::size_t>(image.height); row-- > 0;) {
            std::string line;
            for (std::size_t column = 0; column < width; ++column) {
                appendLittleEndian(line, image.values[row * width + column]);
            }
            out << line;
        }
    });
}

}  // namespace riftmap
