#include "base/input_recorder.h"

#include <algorithm>
#include <atomic>
#include <system_error>

#include "base/file.h"
#include "base/sha256.h"

namespace polymorph {
namespace {

namespace fs = std::filesystem;

/// The recorders that exist.
struct Recorders {
  std::atomic<bool> any = false;  ///< `all` is not empty; read without the lock
  std::mutex mutex;
  std::vector<InputRecorder*> all;
};
Recorders& recorders() {
  static Recorders instance;
  return instance;
}

fs::path normalized_path(const fs::path& path) {
  std::error_code error;
  const fs::path absolute = fs::absolute(path, error);
  return error ? fs::path() : absolute.lexically_normal();
}

template <class F>
void for_each_recorder(const F& f) {
  if (!recorders().any) return;
  const std::lock_guard lock(recorders().mutex);
  for (InputRecorder* recorder : recorders().all) f(*recorder);
}

}  // namespace

InputRecorder::InputRecorder() {
  const std::lock_guard lock(recorders().mutex);
  recorders().all.push_back(this);
  recorders().any = true;
}

InputRecorder::~InputRecorder() {
  const std::lock_guard lock(recorders().mutex);
  std::erase(recorders().all, this);
  recorders().any = !recorders().all.empty();
}

void InputRecorder::add(const fs::path& path, const std::string& sha256) {
  const std::lock_guard lock(mutex_);
  digests_[normalized_path(path)] = sha256;
}

void InputRecorder::add(const fs::path& path) {
  const std::lock_guard lock(mutex_);
  digests_.try_emplace(normalized_path(path));
}

std::vector<ReadFile> InputRecorder::files() {
  std::vector<fs::path> unread;
  {
    const std::lock_guard lock(mutex_);
    for (const auto& [path, digest] : digests_)
      if (digest.empty()) unread.push_back(path);
  }
  // read_file() reports the bytes to all recorders, hence to this one.
  for (const fs::path& path : unread) (void)read_file(path);
  std::vector<ReadFile> files;
  const std::lock_guard lock(mutex_);
  for (const auto& [path, digest] : digests_)
    if (!digest.empty()) files.push_back({path, digest});
  return files;
}

void record_input(const fs::path& path, std::string_view bytes) {
  if (!recorders().any) return;
  const std::string sha256 = Sha256().add(bytes.data(), bytes.size()).hex();
  for_each_recorder([&](InputRecorder& recorder) { recorder.add(path, sha256); });
}

void record_input(const fs::path& path) {
  for_each_recorder([&](InputRecorder& recorder) { recorder.add(path); });
}

}  // namespace polymorph
