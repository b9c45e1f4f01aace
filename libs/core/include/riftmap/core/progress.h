// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>
#include <cstddef>
#include <functional>
#include <iosfwd>
#include <optional>
#include <string>

namespace riftmap {

/// "41 s", "5 min 3 s", "2 h 14 min" of a finite time >= 0 [s]; rounded up to a second, hours down
/// to a minute.
std::string durationText(double seconds);

/// What long work tells of itself from time to time: so many steps are done, of how many. Called by
/// the thread that asked for the work; what it throws stops the work and comes through.
using OnProgress = std::function<void(std::size_t done, std::size_t all)>;

/// A line on stderr with share, rate and time left. On a terminal it refreshes in place; elsewhere
/// (a log file) it is a line at every tenth of the way. Not thread-safe.
class Progress {
 public:
    /// `total` steps of `unit` ("views"); 0 = not known beforehand. Silent unless `enabled`.
    Progress(std::string what, std::string unit, std::size_t total, bool enabled);
    /// For tests: another stream, and whether that is a terminal.
    Progress(std::string what, std::string unit, std::size_t total, std::ostream& out,
             bool isTerminal);
    ~Progress();
    Progress(const Progress&) = delete;
    Progress& operator=(const Progress&) = delete;

    /// `done` steps are behind us.
    void update(std::size_t done);

    /// "building 12/40 views (30 %), 5.1 views/s, 6 s left"
    std::string line(std::size_t done, double elapsedSeconds) const;

 private:
    using Clock = std::chrono::steady_clock;

    void print(std::size_t done, bool last);

    std::string what_, unit_;
    std::size_t total_;
    std::ostream* out_;  ///< null = silent
    bool isTerminal_;
    Clock::time_point start_ = Clock::now();
    std::optional<Clock::time_point> printed_;
    std::size_t done_ = 0, printedTenth_ = 0, width_ = 0;
};

}  // namespace riftmap
