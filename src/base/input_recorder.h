// Recorder of the files that a part of the program reads, with their digests.
#pragma once

#include <filesystem>
#include <map>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

namespace polymorph {

/// A file that was read.
struct ReadFile {
  std::filesystem::path path;  ///< absolute, without "." and ".."
  std::string sha256;          ///< 64 hex digits
};

/// Records what read_file() reads during its lifetime in any thread, by the bytes that it returned,
/// and the files that other programs read and that are registered by remember_input()
/// (base/file.h). Those are read once more for their digests.
class InputRecorder {
 public:
  InputRecorder();
  ~InputRecorder();
  InputRecorder(const InputRecorder&) = delete;
  InputRecorder& operator=(const InputRecorder&) = delete;

  /// Lists the files, sorted by path and each once. What cannot be read is left out.
  std::vector<ReadFile> files();

  // For base/file.cpp.
  void add(const std::filesystem::path& path, const std::string& sha256);
  void add(const std::filesystem::path& path);

 private:
  std::mutex mutex_;
  std::map<std::filesystem::path, std::string> digests_;  ///< empty: not known yet
};

/// Tells all recorders of a file that was read, or registered. No effect where there is none.
void record_input(const std::filesystem::path& path, std::string_view bytes);
void record_input(const std::filesystem::path& path);

}  // namespace polymorph
