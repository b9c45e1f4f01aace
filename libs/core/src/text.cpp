// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/core/text.h"

#include <algorithm>
#include <cctype>
#include <charconv>

namespace riftmap {
namespace {

constexpr std::string_view kBlanks = " \t\r\n";

template <class T>
std::string shortest(T value) {
    char buffer[64];
    const auto end = std::to_chars(buffer, buffer + sizeof(buffer), value).ptr;
    return {buffer, end};
}

template <class T>
std::optional<T> wholeNumber(std::string_view s) {
    T value{};
    const auto [end, error] = std::from_chars(s.data(), s.data() + s.size(), value);
    if (error != std::errc() || end != s.data() + s.size() || s.empty()) {
        return std::nullopt;
    }
    return value;
}

std::size_t editDistance(std::string_view a, std::string_view b) {
    std::vector<std::size_t> row(b.size() + 1);
    for (std::size_t j = 0; j <= b.size(); ++j) {
        row[j] = j;
    }
    for (std::size_t i = 1; i <= a.size(); ++i) {
        std::size_t diagonal = row[0];
        row[0] = i;
        for (std::size_t j = 1; j <= b.size(); ++j) {
            const std::size_t substituted = diagonal + (a[i - 1] == b[j - 1] ? 0U : 1U);
            diagonal = row[j];
            row[j] = std::min({substituted, row[j] + 1, row[j - 1] + 1});
        }
    }
    return row.back();
}

}  // namespace

std::string lower(std::string_view s) {
    std::string out(s);
    std::transform(out.begin(), out.end(), out.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    return out;
}

std::string trimmed(std::string_view s) {
    const auto first = s.find_first_not_of(kBlanks);
    if (first == std::string_view::npos) {
        return {};
    }
    return std::string(s.substr(first, s.find_last_not_of(kBlanks) - first + 1));
}

std::string toText(double value) {
    return shortest(value);
}
std::string toText(float value) {
    return shortest(value);
}
std::string toText(std::int64_t value) {
    return shortest(value);
}
std::string toText(std::uint64_t value) {
    return shortest(value);
}

std::optional<double> toDouble(std::string_view s) {
    return wholeNumber<double>(s);
}
std::optional<std::int64_t> toInteger(std::string_view s) {
    return wholeNumber<std::int64_t>(s);
}

std::vector<std::string_view> words(std::string_view s) {
    std::vector<std::string_view> found;
    std::size_t begin = 0;
    while ((begin = s.find_first_not_of(kBlanks, begin)) != std::string_view::npos) {
        const std::size_t end = std::min(s.find_first_of(kBlanks, begin), s.size());
        found.push_back(s.substr(begin, end - begin));
        begin = end;
    }
    return found;
}

std::string nearestName(std::string_view name, const std::vector<std::string>& known) {
    std::string best;
    std::size_t bestDistance = std::string::npos;
    for (const auto& candidate : known) {
        const std::size_t d = editDistance(lower(name), lower(candidate));
        if (d < bestDistance) {
            bestDistance = d;
            best = candidate;
        }
    }
    return best;
}

std::string oneLine(std::string_view what) {
    // MRPT wraps exceptions into one another; the innermost, the cause, comes last.
    constexpr std::string_view kMessage = "Message:";
    if (const auto at = what.rfind(kMessage);
        at != std::string_view::npos && what.find("MRPT exception") < at) {
        what.remove_prefix(at + kMessage.size());
        for (const std::string_view trailer : {"Location:", "Call stack"}) {
            what = what.substr(0, what.find(trailer));
        }
    }
    std::string line;
    for (const auto word : words(what)) {
        line.append(line.empty() ? "" : " ").append(word);
    }
    return line.empty() ? "unknown error" : line;
}

}  // namespace riftmap
