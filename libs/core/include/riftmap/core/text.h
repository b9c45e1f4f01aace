// SPDX-License-Identifier: BSD-3-Clause
// Numbers and names as text: independent of the locale, exact both ways.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace riftmap {

/// ASCII lower case.
std::string lower(std::string_view s);

/// Without blanks, tabs and line ends on both sides.
std::string trimmed(std::string_view s);

/// Shortest text that reads back to the same number ("inf", "nan" for those).
std::string toText(double value);
std::string toText(float value);
std::string toText(std::int64_t value);
std::string toText(std::uint64_t value);

/// A number, if the whole of `s` is one ("inf" and "nan" count); no blanks.
std::optional<double> toDouble(std::string_view s);
/// A whole number, if the whole of `s` is one and it fits.
std::optional<std::int64_t> toInteger(std::string_view s);

/// The words of `s` between blanks and tabs.
std::vector<std::string_view> words(std::string_view s);

/// The known name with the fewest edits from `name`, ignoring case; empty if none is known.
std::string nearestName(std::string_view name, const std::vector<std::string>& known);

/// What an exception says, on one line: MRPT's carry their call stack in what().
std::string oneLine(std::string_view what);

}  // namespace riftmap
