#include "scene/memory_models.h"

#include <atomic>
#include <map>
#include <mutex>
#include <system_error>
#include <utility>

#include "base/frame_pattern.h"
#include "scene/animated_model.h"

namespace polymorph {
namespace {

/// All meshes in memory, by their paths. Thread-safe.
class Meshes {
 public:
  void put(const std::filesystem::path& path, MemoryMesh mesh) {
    const std::lock_guard lock(mutex_);
    meshes_[path.string()] = std::make_shared<const MemoryMesh>(std::move(mesh));
  }
  std::shared_ptr<const MemoryMesh> find(const std::filesystem::path& path) {
    const std::lock_guard lock(mutex_);
    const auto found = meshes_.find(path.string());
    return found == meshes_.end() ? nullptr : found->second;
  }
  void remove_folder(const std::filesystem::path& folder) {
    const std::lock_guard lock(mutex_);
    std::erase_if(meshes_, [&](const auto& entry) {
      return std::filesystem::path(entry.first).parent_path() == folder;
    });
  }

 private:
  std::mutex mutex_;
  std::map<std::string, std::shared_ptr<const MemoryMesh>> meshes_;
};

Meshes& all_meshes() {
  static Meshes meshes;
  return meshes;
}

/// Suffix of the paths of all meshes. Messages that give a position as FILE:NUMBER then read
/// "NAME.faces:12", with the index of a face.
constexpr const char* kSuffix = ".faces";

}  // namespace

MemoryModels::MemoryModels() {
  static std::atomic<std::uint64_t> count{0};
  folder_ = fmt::format("/<memory>/{}", ++count);
}

MemoryModels::~MemoryModels() { all_meshes().remove_folder(folder_); }

std::filesystem::path MemoryModels::add(const std::string& name, MemoryMesh mesh) {
  std::filesystem::path path = folder_ / (name + kSuffix);
  all_meshes().put(path, std::move(mesh));
  return path;
}

std::filesystem::path MemoryModels::add(const std::string& name, std::vector<MemoryMesh> meshes) {
  std::filesystem::path path = folder_ / (name + ".####" + kSuffix);
  const auto pattern = parse_file_pattern(path);
  PM_CHECK(pattern);
  for (std::size_t i = 0; i < meshes.size(); ++i)
    all_meshes().put(frame_path(*pattern, static_cast<int>(i) + 1), std::move(meshes[i]));
  return path;
}

std::shared_ptr<const MemoryMesh> find_memory_mesh(const std::filesystem::path& path) {
  return all_meshes().find(path);
}

bool model_exists(const std::filesystem::path& path) {
  std::error_code error;
  return find_memory_mesh(path) || std::filesystem::exists(path, error) || parse_pose_path(path);
}

}  // namespace polymorph
