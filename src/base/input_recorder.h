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

/// Records the files that any thread reads during its lifetime, with their digests: those of
/// read_file(), by the bytes that it returned, and those that other code reads and registers with
/// remember_input() (base/file.h). files() reads the latter once more for their digests.
class InputRecorder {
 public:
  InputRecorder();
  ~InputRecorder();
  InputRecorder(const InputRecorder&) = delete;
  InputRecorder& operator=(const InputRecorder&) = delete;

  /// Lists each file once, sorted by path. Files that cannot be read are left out.
  std::vector<ReadFile> files();

  // For base/file.cpp.
  void add(const std::filesystem::path& path, const std::string& sha256);
  void add(const std::filesystem::path& path);

 private:
  std::mutex mutex_;
  std::map<std::filesystem::path, std::string> digests_;  ///< empty = not known yet
};

/// Reports a file that was read, or registered, to all recorders.
void record_input(const std::filesystem::path& path, std::string_view bytes);
void record_input(const std::filesystem::path& path);

}  // namespace polymorph
