// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/core/ply.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <limits>
#include <ostream>
#include <stdexcept>
#include <string_view>

#include "endian.h"
#include "riftmap/core/file.h"
#include "riftmap/core/text.h"

namespace riftmap {
namespace {

enum class Type { kInt8, kUint8, kInt16, kUint16, kInt32, kUint32, kFloat32, kFloat64 };

std::size_t sizeOf(Type type) {
    switch (type) {
        case Type::kInt8:
        case Type::kUint8:
            return 1;
        case Type::kInt16:
        case Type::kUint16:
            return 2;
        case Type::kInt32:
        case Type::kUint32:
        case Type::kFloat32:
            return 4;
        case Type::kFloat64:
            return 8;
    }
    return 0;
}

/// What a property of a vertex means to us.
enum Slot : std::size_t { kX, kY, kZ, kNx, kNy, kNz, kRed, kGreen, kBlue, kSlots };
constexpr std::array<std::string_view, kSlots> kSlotNames = {"x",  "y",   "z",     "nx",  "ny",
                                                             "nz", "red", "green", "blue"};

struct Property {
    Type type = Type::kFloat32;
    bool isList = false;
    Type countType = Type::kUint8;
    std::size_t slot = kSlots;  ///< kSlots = of no use to us
};

struct Element {
    std::string name;
    std::size_t count = 0;
    std::vector<Property> properties;
};

enum class Format { kAscii, kLittleEndian, kBigEndian };

struct Header {
    Format format = Format::kAscii;
    std::vector<Element> elements;
    std::size_t size = 0;  ///< bytes, its last line end included
};

Type typeFrom(std::string_view name) {
    constexpr std::array<std::pair<std::string_view, Type>, 16> kNames = {
        {{"char", Type::kInt8},
         {"int8", Type::kInt8},
         {"uchar", Type::kUint8},
         {"uint8", Type::kUint8},
         {"short", Type::kInt16},
         {"int16", Type::kInt16},
         {"ushort", Type::kUint16},
         {"uint16", Type::kUint16},
         {"int", Type::kInt32},
         {"int32", Type::kInt32},
         {"uint", Type::kUint32},
         {"uint32", Type::kUint32},
         {"float", Type::kFloat32},
         {"float32", Type::kFloat32},
         {"double", Type::kFloat64},
         {"float64", Type::kFloat64}}};
    for (const auto& [known, type] : kNames) {
        if (known == name) {
            return type;
        }
    }
    throw std::invalid_argument("unknown type '" + std::string(name) + "'");
}

std::size_t slotOf(std::string_view name) {
    constexpr std::array<std::pair<std::string_view, std::string_view>, 6> kAliases = {
        {{"normal_x", "nx"},
         {"normal_y", "ny"},
         {"normal_z", "nz"},
         {"diffuse_red", "red"},
         {"diffuse_green", "green"},
         {"diffuse_blue", "blue"}}};
    for (const auto& [alias, plain] : kAliases) {
        if (name == alias) {
            name = plain;
        }
    }
    const auto* const found = std::find(kSlotNames.begin(), kSlotNames.end(), name);
    return static_cast<std::size_t>(found - kSlotNames.begin());
}

Format formatFrom(const std::vector<std::string_view>& w) {
    if (w.size() == 3 && w[2] == "1.0") {
        if (w[1] == "ascii") {
            return Format::kAscii;
        }
        if (w[1] == "binary_little_endian") {
            return Format::kLittleEndian;
        }
        if (w[1] == "binary_big_endian") {
            return Format::kBigEndian;
        }
    }
    throw std::invalid_argument(
        "the format is not ascii, binary_little_endian or binary_big_endian 1.0");
}

Element elementFrom(const std::vector<std::string_view>& w) {
    const auto count = w.size() == 3 ? toInteger(w[2]) : std::nullopt;
    if (!count || *count < 0) {
        throw std::invalid_argument("not 'element NAME COUNT'");
    }
    return {std::string(w[1]), static_cast<std::size_t>(*count), {}};
}

Property propertyFrom(const std::vector<std::string_view>& w) {
    Property property;
    if (w.size() == 5 && w[1] == "list") {
        property.isList = true;
        property.countType = typeFrom(w[2]);
        property.type = typeFrom(w[3]);
        return property;
    }
    if (w.size() != 3) {
        throw std::invalid_argument("not 'property TYPE NAME'");
    }
    property.type = typeFrom(w[1]);
    property.slot = slotOf(w[2]);
    return property;
}

/// True once "end_header" was read.
bool parseHeaderLine(const std::vector<std::string_view>& w, bool& hasFormat, Header& header) {
    if (w.empty() || w[0] == "comment" || w[0] == "obj_info") {
        return false;
    }
    if (w[0] == "format") {
        header.format = formatFrom(w);
        hasFormat = true;
    } else if (w[0] == "element") {
        header.elements.push_back(elementFrom(w));
    } else if (w[0] == "property") {
        if (header.elements.empty()) {
            throw std::invalid_argument("a property before the first element");
        }
        header.elements.back().properties.push_back(propertyFrom(w));
    } else if (w[0] == "end_header") {
        if (!hasFormat) {
            throw std::invalid_argument("the header names no format");
        }
        return true;
    } else {
        throw std::invalid_argument("unknown keyword '" + std::string(w[0]) + "'");
    }
    return false;
}

Header parseHeader(const std::string& name, const std::string& bytes) {
    Header header;
    bool hasFormat = false;
    std::size_t begin = 0;
    for (int number = 1; begin < bytes.size(); ++number) {
        const std::size_t end = std::min(bytes.find('\n', begin), bytes.size());
        const auto w = words(std::string_view(bytes).substr(begin, end - begin));
        begin = end + 1;
        try {
            if (number == 1) {
                if (w.size() != 1 || w[0] != "ply") {
                    throw std::invalid_argument("not a PLY file: it does not start with 'ply'");
                }
            } else if (parseHeaderLine(w, hasFormat, header)) {
                header.size = std::min(begin, bytes.size());
                return header;
            }
        } catch (const std::invalid_argument& e) {
            throw FileError(name + ":" + std::to_string(number) + ": " + e.what());
        }
    }
    throw FileError(name + ": the header has no end");
}

/// The numbers after the header, one by one, whatever the format.
class Numbers {
 public:
    Numbers(std::string name, const std::string& bytes, const Header& header)
        : name_(std::move(name)), bytes_(bytes), format_(header.format), at_(header.size) {}

    double next(Type type) { return format_ == Format::kAscii ? nextAscii() : nextBinary(type); }
    std::size_t nextCount(Type type) {
        const double n = next(type);
        if (!(n >= 0 && n <= 4294967295.0) || n != std::floor(n)) {
            fail("a list of " + toText(n) + " numbers");
        }
        return static_cast<std::size_t>(n);
    }
    void skip(Type type, std::size_t n) {
        if (format_ == Format::kAscii) {
            for (std::size_t i = 0; i < n; ++i) {
                nextAscii();
            }
        } else {
            if (n > (bytes_.size() - at_) / sizeOf(type)) {
                fail("the file ends too early");
            }
            at_ += n * sizeOf(type);
        }
    }
    /// Bytes that are left.
    std::size_t left() const { return bytes_.size() - at_; }
    [[noreturn]] void fail(const std::string& what) const {
        throw FileError(name_ + ": byte " + std::to_string(at_) + ": " + what);
    }

 private:
    double nextAscii() {
        constexpr std::string_view kBlanks = " \t\r\n";
        const std::size_t begin = bytes_.find_first_not_of(kBlanks, at_);
        if (begin == std::string::npos) {
            at_ = bytes_.size();
            fail("the file ends too early");
        }
        const std::size_t end = std::min(bytes_.find_first_of(kBlanks, begin), bytes_.size());
        const std::string_view word = std::string_view(bytes_).substr(begin, end - begin);
        const auto value = toDouble(word.starts_with('+') ? word.substr(1) : word);
        at_ = begin;
        if (!value) {
            fail("'" + std::string(word) + "' is not a number");
        }
        at_ = end;
        return *value;
    }
    double nextBinary(Type type) {
        if (left() < sizeOf(type)) {
            fail("the file ends too early");
        }
        const char* p = bytes_.data() + at_;
        const auto order =
            format_ == Format::kLittleEndian ? std::endian::little : std::endian::big;
        at_ += sizeOf(type);
        switch (type) {
            case Type::kInt8:
                return fromBytes<std::int8_t>(p, order);
            case Type::kUint8:
                return fromBytes<std::uint8_t>(p, order);
            case Type::kInt16:
                return fromBytes<std::int16_t>(p, order);
            case Type::kUint16:
                return fromBytes<std::uint16_t>(p, order);
            case Type::kInt32:
                return fromBytes<std::int32_t>(p, order);
            case Type::kUint32:
                return fromBytes<std::uint32_t>(p, order);
            case Type::kFloat32:
                return static_cast<double>(fromBytes<float>(p, order));
            case Type::kFloat64:
                return fromBytes<double>(p, order);
        }
        return 0;
    }

    std::string name_;
    const std::string& bytes_;
    Format format_;
    std::size_t at_;
};

std::uint8_t colourFrom(double value, Type type) {
    const double scale = type == Type::kFloat32 || type == Type::kFloat64 ? 255.0
                         : type == Type::kUint16                          ? 255.0 / 65535.0
                                                                          : 1.0;
    return static_cast<std::uint8_t>(std::lround(std::clamp(value * scale, 0.0, 255.0)));
}

bool hasSlots(const Element& element, std::initializer_list<std::size_t> slots) {
    return std::all_of(slots.begin(), slots.end(), [&](std::size_t slot) {
        return std::any_of(element.properties.begin(), element.properties.end(),
                           [&](const Property& p) { return p.slot == slot; });
    });
}

void skipElement(const Element& element, Numbers& numbers) {
    for (std::size_t i = 0; i < element.count && !element.properties.empty(); ++i) {
        for (const auto& property : element.properties) {
            numbers.skip(property.type,
                         property.isList ? numbers.nextCount(property.countType) : 1);
        }
    }
}

PointCloud readVertices(const Element& element, Numbers& numbers) {
    if (!hasSlots(element, {kX, kY, kZ})) {
        numbers.fail("the vertices have no x y z");
    }
    const bool hasNormals = hasSlots(element, {kNx, kNy, kNz});
    const bool hasColours = hasSlots(element, {kRed, kGreen, kBlue});
    PointCloud cloud;
    // A count that the file cannot hold must not ask for the memory.
    const std::size_t expected = std::min(element.count, numbers.left());
    cloud.points.reserve(expected);
    cloud.normals.reserve(hasNormals ? expected : 0);
    cloud.colours.reserve(hasColours ? expected : 0);
    for (std::size_t i = 0; i < element.count; ++i) {
        std::array<double, kSlots> v{};
        for (const auto& property : element.properties) {
            if (property.isList) {
                numbers.skip(property.type, numbers.nextCount(property.countType));
            } else if (property.slot == kSlots) {
                numbers.skip(property.type, 1);
            } else {
                const double value = numbers.next(property.type);
                v[property.slot] = property.slot >= kRed ? colourFrom(value, property.type) : value;
            }
        }
        const Eigen::Vector3f point = Eigen::Vector3d(v[kX], v[kY], v[kZ]).cast<float>();
        if (!point.allFinite()) {
            numbers.fail("vertex " + std::to_string(i) + " is not finite");
        }
        cloud.points.push_back(point);
        if (hasNormals) {
            cloud.normals.emplace_back(Eigen::Vector3d(v[kNx], v[kNy], v[kNz]).cast<float>());
        }
        if (hasColours) {
            cloud.colours.push_back({static_cast<std::uint8_t>(v[kRed]),
                                     static_cast<std::uint8_t>(v[kGreen]),
                                     static_cast<std::uint8_t>(v[kBlue])});
        }
    }
    return cloud;
}

}  // namespace

PointCloud readPly(const std::filesystem::path& file) {
    const std::string bytes = readFile(file);
    const Header header = parseHeader(file.string(), bytes);
    Numbers numbers(file.string(), bytes, header);
    for (const auto& element : header.elements) {
        if (element.name == "vertex") {
            return readVertices(element, numbers);
        }
        skipElement(element, numbers);
    }
    throw FileError(file.string() + ": has no vertices");
}

void writePly(const std::filesystem::path& file, const PointCloud& cloud,
              const std::vector<std::string>& comments) {
    const std::size_t n = cloud.points.size();
    if ((!cloud.normals.empty() && cloud.normals.size() != n) ||
        (!cloud.colours.empty() && cloud.colours.size() != n)) {
        throw std::invalid_argument(file.string() +
                                    ": points, normals and colours differ in number");
    }
    writeAtomically(file, [&](std::ostream& out) {
        out << "ply\nformat binary_little_endian 1.0\n";
        for (const auto& comment : comments) {
            if (comment.find_first_of("\r\n") != std::string::npos) {
                throw std::invalid_argument(file.string() + ": a comment of more than one line");
            }
            out << "comment " << comment << '\n';
        }
        out << "element vertex " << n << '\n';
        for (std::size_t slot = 0; slot < kSlots; ++slot) {
            out << "property " << (slot < kRed ? "float " : "uchar ") << kSlotNames[slot] << '\n';
        }
        out << "end_header\n";
        std::string block;
        for (std::size_t i = 0; i < n; ++i) {
            const Eigen::Vector3f normal =
                cloud.normals.empty() ? Eigen::Vector3f(0, 0, 0) : cloud.normals[i];
            for (const auto& vector : {cloud.points[i], normal}) {
                for (int axis = 0; axis < 3; ++axis) {
                    appendLittleEndian(block, vector[axis]);
                }
            }
            for (std::size_t channel = 0; channel < 3; ++channel) {
                appendLittleEndian(
                    block, cloud.colours.empty() ? std::uint8_t{255} : cloud.colours[i][channel]);
            }
            if (block.size() > (1U << 20U) || i + 1 == n) {
                out << block;
                block.clear();
            }
        }
    });
}

}  // namespace riftmap
