#include "base/spool.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <utility>

namespace polymorph {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kBufferSize = std::size_t{1} << 20;

Error make_spool_error(const fs::path& folder, int errno_value) {
  return make_error(ErrorCode::kOutput,
                    "{}: cannot keep a temporary file here: {} - choose another "
                    "folder with -o",
                    folder.string(), std::strerror(errno_value));
}

}  // namespace

Result<Spool> Spool::create_for(const fs::path& path) {
  const fs::path folder = path.has_parent_path() ? path.parent_path() : fs::path(".");
  std::error_code error;
  fs::create_directories(folder, error);
  int fd = ::open(folder.c_str(), O_TMPFILE | O_RDWR | O_CLOEXEC, 0600);
  if (fd < 0) {  // not all file systems support files without names
    std::string name = (folder / ".polymorph.XXXXXX").string();
    fd = ::mkostemp(name.data(), O_CLOEXEC);
    if (fd < 0) return make_spool_error(folder, errno);
    ::unlink(name.c_str());
  }
  return Spool(fd, folder);
}

Spool::~Spool() {
  if (fd_ >= 0) ::close(fd_);
}

Spool::Spool(Spool&& other) noexcept
    : fd_(std::exchange(other.fd_, -1)),
      folder_(std::move(other.folder_)),
      buffer_(std::move(other.buffer_)),
      size_(other.size_) {}

Spool& Spool::operator=(Spool&& other) noexcept {
  std::swap(fd_, other.fd_);
  std::swap(folder_, other.folder_);
  std::swap(buffer_, other.buffer_);
  std::swap(size_, other.size_);
  return *this;
}

Status Spool::append(std::string_view bytes) {
  buffer_ += bytes;
  size_ += bytes.size();
  return buffer_.size() < kBufferSize ? Status(Ok{}) : flush();
}

Status Spool::flush() {
  std::string_view bytes = buffer_;
  while (!bytes.empty()) {
    const ssize_t n = ::write(fd_, bytes.data(), bytes.size());
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) return make_spool_error(folder_, errno);
    bytes.remove_prefix(static_cast<std::size_t>(n));
  }
  buffer_.clear();
  return Ok{};
}

ByteSource Spool::source(std::vector<Range> ranges) {
  return [this, ranges = std::move(ranges), i = std::size_t{0},
          piece = std::string()]() mutable -> Result<std::string_view> {
    PM_TRY_STATUS(flush());
    while (i < ranges.size() && ranges[i].size == 0) ++i;
    if (i == ranges.size()) return std::string_view{};
    Range& range = ranges[i];
    piece.resize(std::min<std::uint64_t>(kBufferSize, range.size));
    ssize_t n = -1;
    do {
      n = ::pread(fd_, piece.data(), piece.size(), static_cast<off_t>(range.first));
    } while (n < 0 && errno == EINTR);
    if (n < 0) return make_spool_error(folder_, errno);
    PM_CHECK(n > 0);
    range.first += static_cast<std::uint64_t>(n);
    range.size -= static_cast<std::uint64_t>(n);
    return std::string_view(piece.data(), static_cast<std::size_t>(n));
  };
}

ByteSource concatenate(std::vector<ByteSource> sources) {
  return [sources = std::move(sources), i = std::size_t{0}]() mutable -> Result<std::string_view> {
    for (; i < sources.size(); ++i) {
      PM_TRY(const std::string_view bytes, sources[i]());
      if (!bytes.empty()) return bytes;
    }
    return std::string_view{};
  };
}

}  // namespace polymorph
