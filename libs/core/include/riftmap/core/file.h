// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <iosfwd>
#include <stdexcept>
#include <string>

namespace riftmap {

/// A file that cannot be read or written, or whose content is wrong: one line that names the
/// file, the place in it and what is wrong there. Programs end with exit code 1.
class FileError : public std::runtime_error {
 public:
    using std::runtime_error::runtime_error;
};

/// Calls `write` with a stream onto a file beside `file` and renames that to `file` when all of it
/// is on its way to the disk: other programs see the old content or the new one, never a part.
/// Throws FileError if writing fails; what `write` throws passes through. `file` is unchanged then.
void writeAtomically(const std::filesystem::path& file,
                     const std::function<void(std::ostream&)>& write);

/// The same for writers that open the file themselves: `write` gets the name to write to, with the
/// same extension.
void writeBesideAndRename(const std::filesystem::path& file,
                          const std::function<void(const std::filesystem::path&)>& write);

/// All bytes of a file. Throws FileError.
std::string readFile(const std::filesystem::path& file);

/// SHA-256 of a file's content, 64 hexadecimal digits. Throws FileError.
std::string sha256OfFile(const std::filesystem::path& file);
/// SHA-256 of these bytes.
std::string sha256(const std::string& bytes);

/// Most memory this process has had at once [MB = 1e6 bytes].
double peakRssMb();

}  // namespace riftmap
