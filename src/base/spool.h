// Bytes that wait on the disk until the rest of their file is known.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/file.h"
#include "base/result.h"

namespace polymorph {

/// An unnamed file in a folder: it is gone with the spool, or with the process.
class Spool {
 public:
  /// In `path`'s folder, which is made, so that the file system is the one that the bytes are for.
  /// Errors: kOutput.
  static Result<Spool> beside(const std::filesystem::path& path);
  ~Spool();
  Spool(Spool&& other) noexcept;
  Spool& operator=(Spool&& other) noexcept;

  /// Errors: kOutput.
  Status append(std::string_view bytes);
  std::uint64_t size() const { return size_; }
  /// A run of the bytes.
  struct Range {
    std::uint64_t first = 0, size = 0;
  };
  /// The runs one after the other, in pieces, for write_file(); the spool must outlive it.
  ByteSource source(std::vector<Range> ranges);

 private:
  Spool(int fd, std::filesystem::path folder) : fd_(fd), folder_(std::move(folder)) {}
  Status flush();
  int fd_ = -1;
  std::filesystem::path folder_;
  std::string waiting_;  ///< not yet written
  std::uint64_t size_ = 0;
};

/// One source after the other.
ByteSource joined(std::vector<ByteSource> sources);

}  // namespace polymorph
