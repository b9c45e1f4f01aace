// SPDX-License-Identifier: BSD-3-Clause
#include "riftmap/core/file.h"

#include <openssl/evp.h>
#include <sys/resource.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <iterator>
#include <memory>
#include <system_error>
#include <utility>

namespace riftmap {
namespace {

namespace fs = std::filesystem;

std::string lastError() {
    return errno == 0 ? "failed" : std::strerror(errno);
}

/// A file that vanishes unless it was renamed.
class Temporary {
 public:
    explicit Temporary(const fs::path& target)
        : path_(target.parent_path() / (".part." + target.filename().string())) {}
    ~Temporary() {
        std::error_code ignored;  // nothing to be done about a leftover here
        fs::remove(path_, ignored);
    }
    Temporary(const Temporary&) = delete;
    Temporary& operator=(const Temporary&) = delete;

    const fs::path& path() const { return path_; }
    void renameTo(const fs::path& target) const {
        std::error_code error;
        fs::rename(path_, target, error);
        if (error) {
            throw FileError(target.string() + ": cannot be written: " + error.message());
        }
    }

 private:
    fs::path path_;
};

class Sha256 {
 public:
    Sha256() : context_(EVP_MD_CTX_new(), &EVP_MD_CTX_free) {
        check(context_ != nullptr && EVP_DigestInit_ex(context_.get(), EVP_sha256(), nullptr) == 1);
    }
    void update(const char* data, std::size_t size) {
        check(EVP_DigestUpdate(context_.get(), data, size) == 1);
    }
    std::string hex() {
        std::array<unsigned char, EVP_MAX_MD_SIZE> digest{};
        unsigned int size = 0;
        check(EVP_DigestFinal_ex(context_.get(), digest.data(), &size) == 1);
        constexpr const char* kDigits = "0123456789abcdef";
        std::string out;
        for (unsigned int i = 0; i < size; ++i) {
            out += kDigits[digest[i] >> 4U];
            out += kDigits[digest[i] & 15U];
        }
        return out;
    }

 private:
    static void check(bool ok) {
        if (!ok) {
            throw std::runtime_error("SHA-256 is not available in this OpenSSL");
        }
    }
    std::unique_ptr<EVP_MD_CTX, decltype(&EVP_MD_CTX_free)> context_;
};

std::ifstream openForReading(const fs::path& file) {
    if (!fs::exists(file)) {
        throw FileError(file.string() + ": no such file");
    }
    if (fs::is_directory(file)) {
        throw FileError(file.string() + ": is a directory");
    }
    errno = 0;
    std::ifstream in(file, std::ios::binary);
    if (!in) {
        throw FileError(file.string() + ": cannot be read: " + lastError());
    }
    return in;
}

}  // namespace

void writeAtomically(const fs::path& file, const std::function<void(std::ostream&)>& write) {
    writeBesideAndRename(file, [&](const fs::path& temporary) {
        errno = 0;
        std::ofstream out(temporary, std::ios::binary | std::ios::trunc);
        if (out) {
            write(out);
        }
        out.close();
        if (!out) {
            throw FileError(file.string() + ": cannot be written: " + lastError());
        }
    });
}

void writeBesideAndRename(const fs::path& file, const std::function<void(const fs::path&)>& write) {
    const Temporary temporary(file);
    write(temporary.path());
    temporary.renameTo(file);
}

std::string readFile(const fs::path& file) {
    std::ifstream in = openForReading(file);
    std::string bytes((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
    if (in.bad()) {
        throw FileError(file.string() + ": cannot be read: " + lastError());
    }
    return bytes;
}

std::string sha256OfFile(const fs::path& file) {
    std::ifstream in = openForReading(file);
    Sha256 hash;
    std::array<char, 1U << 16U> buffer{};
    while (in) {
        in.read(buffer.data(), buffer.size());
        hash.update(buffer.data(), static_cast<std::size_t>(in.gcount()));
    }
    if (in.bad()) {
        throw FileError(file.string() + ": cannot be read: " + lastError());
    }
    return hash.hex();
}

std::string sha256(const std::string& bytes) {
    Sha256 hash;
    hash.update(bytes.data(), bytes.size());
    return hash.hex();
}

double peakRssMb() {
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    return static_cast<double>(usage.ru_maxrss) * 1024 / 1e6;
}

}  // namespace riftmap
