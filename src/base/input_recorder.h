// Recorder of the files that a part of the program reads, with their digests.
#pragma once

#include <filesystem>
#include <map>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

namespace polymorph {

struct ReadFile {
  std::filesystem::path path;  ///< absolute, without "." and ".."
  std::string sha256;          ///< 64 hex digits
};

/// Records the files that any thread reads during the recorder's lifetime, with their digests. The
/// digest of a file read by read_file() (base/file.h) is that of the bytes that read_file()
/// returned. Other code registers its files with remember_input(); files() reads these files again
/// to compute the digests.
class InputRecorder {
 public:
  InputRecorder();
  ~InputRecorder();
  InputRecorder(const InputRecorder&) = delete;
  InputRecorder& operator=(const InputRecorder&) = delete;

  /// Lists each file once, sorted by path. Files that cannot be read are left out.
  std::vector<ReadFile> files();

  // Called by record_input().
  void add(const std::filesystem::path& path, const std::string& sha256);
  void add(const std::filesystem::path& path);

 private:
  std::mutex mutex_;
  std::map<std::filesystem::path, std::string> digests_;  ///< key: path; empty = not read yet
};

/// Add a file to all recorders: a file that was read, with its bytes, or one that was registered.
/// Called by base/file.cpp.
void record_input(const std::filesystem::path& path, std::string_view bytes);
void record_input(const std::filesystem::path& path);

}  // namespace polymorph
