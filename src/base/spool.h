// Spool: temporary storage on disk for pieces of a file that is put together at the end.
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

/// An unnamed file in a folder; it disappears with the object or the process.
class Spool {
 public:
  /// Creates a spool in the folder of `path`, hence on the file system where its bytes will end up.
  /// Creates the folder if necessary. Errors: kOutput.
  static Result<Spool> create_for(const std::filesystem::path& path);
  ~Spool();
  Spool(Spool&& other) noexcept;
  Spool& operator=(Spool&& other) noexcept;

  /// Appends bytes. Errors: kOutput.
  Status append(std::string_view bytes);
  /// Number of bytes appended so far.
  std::uint64_t size() const { return size_; }
  /// The bytes [first, first + size) of the spool.
  struct Range {
    std::uint64_t first = 0, size = 0;
  };
  /// Makes a source of the ranges, in order, for write_file(). The spool must outlive the source.
  ByteSource source(std::vector<Range> ranges);

 private:
  Spool(int fd, std::filesystem::path folder) : fd_(fd), folder_(std::move(folder)) {}
  Status flush();  ///< writes buffer_ to the file
  int fd_ = -1;    ///< -1 after a move
  std::filesystem::path folder_;
  std::string buffer_;  ///< bytes not written yet
  std::uint64_t size_ = 0;
};

/// Makes a source of the bytes of all sources, one after the other.
ByteSource concatenate(std::vector<ByteSource> sources);

}  // namespace polymorph
