#include "scene/mesh_numbers.h"

#include <algorithm>
#include <cstdlib>
#include <numeric>

#include "scene/animated_model.h"
#include "scene/memory_models.h"

namespace polymorph {

bool is_numbered(const std::filesystem::path& model) {
  if (model_exists(model)) return false;
  const auto pattern = parse_file_pattern(model);
  return pattern ? pattern->has_number() : model.filename().string().find('#') != std::string::npos;
}

Result<std::vector<int>> existing_meshes(const FramePattern& pattern) {
  std::vector<int> in_memory;  // these meshes have the numbers 1, 2, ...
  for (int number = 1; find_memory_mesh(frame_path(pattern, number)); ++number)
    in_memory.push_back(number);
  if (!in_memory.empty()) return in_memory;
  if (!pattern.has_number()) return existing_frames(pattern);
  const auto pose = parse_pose_path(frame_path(pattern, 1));
  if (!pose) return existing_frames(pattern);
  std::vector<int> poses(
      static_cast<std::size_t>(read_animation(pose->file, pose->animation).pose_count()));
  std::iota(poses.begin(), poses.end(), 1);
  return poses;
}

Result<std::vector<int>> find_mesh_range(const std::filesystem::path& model) {
  PM_TRY(const FramePattern pattern, parse_file_pattern(model));
  PM_TRY(const std::vector<int> numbers, existing_meshes(pattern));
  if (numbers.empty()) {
    if (const auto pose = parse_pose_path(frame_path(pattern, 1)))
      return make_error(ErrorCode::kInput, "{}", describe_missing_poses(*pose));
    return make_error(ErrorCode::kInput, "no such files: {}", model.string());
  }
  int step = 0;  // greatest common divisor of the differences; 0 for a single number
  for (const int number : numbers) step = std::gcd(step, number - numbers.front());
  std::vector<int> range{numbers.front(), numbers.back()};
  if (step > 1) range.push_back(step);
  return range;
}

std::optional<float> find_pose_rate(const std::filesystem::path& model) {
  const auto pattern = parse_file_pattern(model);
  const auto pose =
      pattern && pattern->has_number() ? parse_pose_path(frame_path(*pattern, 1)) : std::nullopt;
  if (!pose) return std::nullopt;
  return static_cast<float>(read_animation(pose->file, pose->animation).poses_per_second);
}

bool plays_sequence_alone(const ActorSettings& actor) {
  return is_mesh_sequence(actor.source) && actor.intermediate.empty() &&
         actor.target.model.empty() && actor.target.shape.empty();
}

bool morphs_sequence(const ActorSettings& actor) {
  return !plays_sequence_alone(actor) &&
         (is_mesh_sequence(actor.source) || is_mesh_sequence(actor.target) ||
          std::any_of(actor.intermediate.begin(), actor.intermediate.end(), is_mesh_sequence));
}

int mesh_count(const ObjectSettings& object) {
  const std::vector<int>& range = object.range;
  const int step = range.size() > 2 ? range[2] : 1;
  return range.size() < 2 || step < 1 ? 0 : std::abs(range[1] - range[0]) / step + 1;
}

std::vector<int> mesh_numbers(const ObjectSettings& object) {
  const std::vector<int>& range = object.range;
  const int count = mesh_count(object), step = range.size() > 2 ? range[2] : 1;
  std::vector<int> numbers;
  for (int i = 0; i < count; ++i)
    numbers.push_back(range[1] < range[0] ? range[0] - i * step : range[0] + i * step);
  return numbers;
}

std::filesystem::path mesh_file(const ObjectSettings& object, int number) {
  const auto pattern = parse_file_pattern(object.model);
  PM_CHECK(pattern);
  return frame_path(*pattern, number);
}

std::string describe_sequence(const ObjectSettings& object) {
  const std::vector<int> numbers = mesh_numbers(object);
  std::size_t missing = 0;
  for (const int number : numbers)
    if (!model_exists(mesh_file(object, number))) ++missing;
  std::string text = fmt::format("{} mesh{}, frames {} to {}", numbers.size(),
                                 numbers.size() == 1 ? "" : "es", numbers.front(), numbers.back());
  if (object.range.size() > 2) text += fmt::format(" in steps of {}", object.range[2]);
  return missing > 0 ? text + fmt::format(", {} missing", missing) : text;
}

std::string sequence_name(const std::filesystem::path& model) {
  const auto pattern = parse_file_pattern(model);
  if (!pattern) return model.stem().string();
  // "x" replaces the number and is removed below. Without it, a path that ends in '/' would have no
  // filename().
  const std::string before = std::filesystem::path(pattern->before + "x").filename().string(),
                    after = std::filesystem::path(pattern->after).stem().string();
  std::string name = before.substr(0, before.size() - 1);
  while (!name.empty() && std::string("._- @").find(name.back()) != std::string::npos)
    name.pop_back();
  return name.empty() ? after : name;
}

}  // namespace polymorph
