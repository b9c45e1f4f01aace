// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>
#include <csignal>

namespace riftmap {

/// While it lives, Ctrl-C (SIGINT) and SIGTERM ask the program to end in good order; the second
/// Ctrl-C ends it at once. One at a time in a process.
class InterruptGuard {
 public:
    InterruptGuard();
    ~InterruptGuard();
    InterruptGuard(const InterruptGuard&) = delete;
    InterruptGuard& operator=(const InterruptGuard&) = delete;

    /// True once a signal came. May be read from any thread.
    const std::atomic<bool>& requested() const;

 private:
    struct sigaction oldInt_ = {}, oldTerm_ = {};
};

}  // namespace riftmap
