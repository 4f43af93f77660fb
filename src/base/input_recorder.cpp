#include "base/input_recorder.h"

#include <algorithm>
#include <atomic>
#include <system_error>

#include "base/file.h"
#include "base/sha256.h"

namespace polymorph {
namespace {

namespace fs = std::filesystem;

struct Recorders {
  std::atomic<bool> any = false;
  std::mutex mutex;
  std::vector<InputRecorder*> all;
};
Recorders& recorders() {
  static Recorders instance;
  return instance;
}

fs::path key(const fs::path& path) {
  std::error_code error;
  const fs::path whole = fs::absolute(path, error);
  return error ? fs::path() : whole.lexically_normal();
}

template <class Tell>
void tell_recorders(const Tell& tell) {
  if (!recorders().any) return;
  const std::lock_guard lock(recorders().mutex);
  for (InputRecorder* recorder : recorders().all) tell(*recorder);
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
  digests_[key(path)] = sha256;
}

void InputRecorder::add(const fs::path& path) {
  const std::lock_guard lock(mutex_);
  digests_.try_emplace(key(path));
}

std::vector<ReadFile> InputRecorder::files() {
  std::vector<fs::path> unread;
  {
    const std::lock_guard lock(mutex_);
    for (const auto& [path, digest] : digests_)
      if (digest.empty()) unread.push_back(path);
  }
  // Tells this recorder of their bytes, as all others.
  for (const fs::path& path : unread) (void)read_file(path);
  std::vector<ReadFile> all;
  const std::lock_guard lock(mutex_);
  for (const auto& [path, digest] : digests_)
    if (!digest.empty()) all.push_back({path, digest});
  return all;
}

void record_input(const fs::path& path, std::string_view bytes) {
  if (!recorders().any) return;
  const std::string sha256 = Sha256().add(bytes.data(), bytes.size()).hex();
  tell_recorders([&](InputRecorder& recorder) { recorder.add(path, sha256); });
}

void record_input(const fs::path& path) {
  tell_recorders([&](InputRecorder& recorder) { recorder.add(path); });
}

}  // namespace polymorph
