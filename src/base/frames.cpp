#include "base/frames.h"

#include <algorithm>
#include <cstdlib>
#include <set>

#include "base/text.h"

namespace polymorph {
namespace {

/// Frames `from`, `from` +- step, ... up to `to`; with `complement`, all other frames from `from`
/// to `to`.
struct FrameRange {
  long long from = 0, to = 0, step = 1;
  bool complement = false;
};

/// Parses one item of a frame list. Errors: kUsage.
Result<FrameRange> parse_range(std::string_view item, std::string_view list) {
  const auto fail = [&](const char* reason) {
    return make_error(ErrorCode::kUsage,
                      "--frames {}: \"{}\" {} - write 1-48, 1-48x2, 5-1 or 1,5,10-20", list, item,
                      reason);
  };
  FrameRange range;
  std::string_view ends = item;
  if (const auto mark = item.find_first_of("xy"); mark != std::string_view::npos) {
    const auto step = parse_integer(item.substr(mark + 1));
    if (!step || *step < 1) return fail("has a bad step");
    range.step = *step;
    range.complement = item[mark] == 'y';
    ends = item.substr(0, mark);
  }
  std::string_view left = ends, right = ends;
  if (const auto dots = ends.find(".."); dots != std::string_view::npos) {
    left = ends.substr(0, dots), right = ends.substr(dots + 2);
  } else if (const auto dash = ends.find('-', 1);  // the first character may be a sign
             dash != std::string_view::npos) {
    left = ends.substr(0, dash), right = ends.substr(dash + 1);
  }
  const auto from = parse_integer(left), to = parse_integer(right);
  if (!from || !to) return fail("is not a frame or a range");
  range.from = *from;
  range.to = *to;
  return range;
}

}  // namespace

Result<std::vector<int>> parse_frames(std::string_view text, int first, int last) {
  std::vector<int> frames;
  std::set<long long> seen;
  for (const std::string& item : split(text, ',')) {
    PM_TRY(const FrameRange range, parse_range(item, text));
    for (const long long end : {range.from, range.to})
      if (end < first || end > last)
        return make_error(ErrorCode::kUsage, "--frames {}: frame {} is outside the scene's {}-{}",
                          text, end, first, last);
    const long long direction = range.to >= range.from ? 1 : -1;
    for (long long i = 0; i <= std::abs(range.to - range.from); ++i) {
      const bool on_step = i % range.step == 0;
      const long long frame = range.from + direction * i;
      if (on_step != range.complement && seen.insert(frame).second)
        frames.push_back(static_cast<int>(frame));
    }
  }
  if (frames.empty()) return make_error(ErrorCode::kUsage, "--frames {}: no frame is left", text);
  return frames;
}

Result<std::vector<int>> parse_frames_or_all(std::string_view text, int first, int last) {
  if (!text.empty()) return parse_frames(text, first, last);
  return parse_frames(fmt::format("{}-{}", first, last), first, last);
}

Result<Shard> parse_shard(std::string_view text) {
  const auto from_environment = [](const char* name) -> std::optional<long long> {
    const char* value = std::getenv(name);
    return value ? parse_integer(value) : std::nullopt;
  };
  std::optional<long long> index, count;
  if (text == "auto") {
    if (const auto id = from_environment("SLURM_ARRAY_TASK_ID")) {
      // The ids of an array's tasks are low, low + step, low + 2 step, ...
      const long long low = from_environment("SLURM_ARRAY_TASK_MIN").value_or(0);
      const long long step = std::max(1LL, from_environment("SLURM_ARRAY_TASK_STEP").value_or(1));
      index = (*id - low) / step + 1;
      count = from_environment("SLURM_ARRAY_TASK_COUNT");
    } else if (const auto rank = from_environment("OMPI_COMM_WORLD_RANK")) {
      index = *rank + 1;
      count = from_environment("OMPI_COMM_WORLD_SIZE");
    } else if (const auto pmi = from_environment("PMI_RANK")) {
      index = *pmi + 1;
      count = from_environment("PMI_SIZE");
    }
    if (!index || !count)
      return make_error(ErrorCode::kUsage,
                        "--shard auto: neither a Slurm array (SLURM_ARRAY_TASK_ID) nor MPI ranks "
                        "are in the environment - write --shard 1/8");
  } else if (const auto slash = text.find('/'); slash != std::string_view::npos) {
    index = parse_integer(text.substr(0, slash));
    count = parse_integer(text.substr(slash + 1));
  }
  if (!index || !count || *count < 1 || *count > 1000000 || *index < 1 || *index > *count)
    return make_error(ErrorCode::kUsage, "--shard {}: write i/N with 1 <= i <= N, or auto", text);
  return Shard{static_cast<int>(*index), static_cast<int>(*count)};
}

std::vector<int> take_shard(const std::vector<int>& frames, Shard shard) {
  std::vector<int> shard_frames;
  for (std::size_t i = static_cast<std::size_t>(shard.index - 1); i < frames.size();
       i += static_cast<std::size_t>(shard.count))
    shard_frames.push_back(frames[i]);
  return shard_frames;
}

}  // namespace polymorph
