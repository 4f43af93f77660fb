#include "sequence/run/frames.h"

#include <algorithm>
#include <cstdlib>
#include <set>

#include "base/text.h"

namespace polymorph {
namespace {

struct Range {
  long long from = 0, to = 0, step = 1;
  bool complement = false;
};

Result<Range> parse_range(std::string_view part, std::string_view list) {
  const auto fail = [&](const char* why) {
    return make_error(ErrorCode::kUsage,
                      "--frames {}: \"{}\" {} - write 1-48, 1-48x2, 5-1 or 1,5,10-20", list, part,
                      why);
  };
  Range range;
  std::string_view ends = part;
  if (const auto mark = part.find_first_of("xy"); mark != std::string_view::npos) {
    const auto step = parse_integer(part.substr(mark + 1));
    if (!step || *step < 1) return fail("has a bad step");
    range.step = *step;
    range.complement = part[mark] == 'y';
    ends = part.substr(0, mark);
  }
  std::string_view left = ends, right = ends;
  if (const auto dots = ends.find(".."); dots != std::string_view::npos) {
    left = ends.substr(0, dots), right = ends.substr(dots + 2);
  } else if (const auto dash = ends.find('-', 1); dash != std::string_view::npos) {
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
  for (const std::string& part : split(text, ',')) {
    PM_TRY(const Range range, parse_range(part, text));
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

Result<FramePattern> parse_pattern(const std::string& text) {
  const std::size_t name = text.rfind('/') == std::string::npos ? 0 : text.rfind('/') + 1;
  if (name == text.size())
    return make_error(ErrorCode::kUsage,
                      "{}: names a folder - add a file name such as frame.####.exr", text);
  if (text.substr(0, name).find('#') != std::string::npos)
    return make_error(ErrorCode::kUsage,
                      "{}: the frame number (####) must stand in the file name, not in a folder's",
                      text);
  FramePattern pattern;
  std::string* out = &pattern.before;
  *out = text.substr(0, name);
  const auto place = [&](int digits) -> Status {
    if (pattern.digits > 0)
      return make_error(ErrorCode::kUsage, "{}: has two places for the frame number - keep one",
                        text);
    pattern.digits = digits;
    out = &pattern.after;
    return Ok{};
  };
  for (std::size_t i = name; i < text.size();) {
    if (text[i] == '#') {
      std::size_t end = i;
      while (end < text.size() && text[end] == '#') ++end;
      // One # is one digit to Blender and four to OpenImageIO, so it is nothing here.
      if (end - i == 1)
        return make_error(ErrorCode::kUsage,
                          "{}: a lone # is ambiguous - write #### for four digits", text);
      PM_TRY_STATUS(place(static_cast<int>(end - i)));
      i = end;
    } else if (text.compare(i, 2, "%%") == 0) {
      *out += '%';
      i += 2;
    } else if (text[i] == '%') {
      const auto d = text.find('d', i);
      const auto digits =
          d == std::string::npos ? std::nullopt : parse_integer(text.substr(i + 1, d - i - 1));
      if (!digits || text[i + 1] != '0' || *digits < 1 || *digits > 18)
        return make_error(
            ErrorCode::kUsage,
            "{}: after % only a frame number as in %04d can stand - write %% for a percent sign",
            text);
      PM_TRY_STATUS(place(static_cast<int>(*digits)));
      i = d + 1;
    } else {
      *out += text[i++];
    }
  }
  return pattern;
}

FramePattern add_number(FramePattern pattern) {
  if (pattern.has_number()) return pattern;
  const std::size_t name =
      pattern.before.rfind('/') == std::string::npos ? 0 : pattern.before.rfind('/') + 1;
  const std::size_t dot = pattern.before.rfind('.');
  const std::size_t cut = dot == std::string::npos || dot <= name ? pattern.before.size() : dot;
  return {pattern.before.substr(0, cut) + ".", pattern.before.substr(cut), 4};
}

std::filesystem::path frame_path(const FramePattern& pattern, int frame) {
  if (!pattern.has_number()) return pattern.before;
  return fmt::format("{}{:0{}}{}", pattern.before, frame, pattern.digits, pattern.after);
}

FramePattern with_extension(FramePattern pattern, const std::string& extension) {
  std::string& tail = pattern.has_number() ? pattern.after : pattern.before;
  const std::size_t slash = tail.rfind('/');
  const std::size_t dot = tail.rfind('.');
  if (dot != std::string::npos && (slash == std::string::npos || dot > slash)) tail.erase(dot);
  tail += extension;
  return pattern;
}

Result<std::vector<int>> existing_frames(const FramePattern& pattern) {
  namespace fs = std::filesystem;
  const fs::path sample(pattern.before + "0" + pattern.after);
  const fs::path folder = sample.has_parent_path() ? sample.parent_path() : fs::path(".");
  const std::string head = fs::path(pattern.before + "x").filename().string();
  const std::string before = head.substr(0, head.size() - 1);
  std::error_code error;
  std::vector<int> frames;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    const std::string name = entry.path().filename().string();
    if (name.size() <= before.size() + pattern.after.size() || !name.starts_with(before) ||
        !name.ends_with(pattern.after))
      continue;
    const std::string number =
        name.substr(before.size(), name.size() - before.size() - pattern.after.size());
    const auto frame = parse_integer(number);
    // Only names that frame_path() would give: "frame.7.exr" is not frame 7 of "frame.####.exr".
    if (frame && *frame >= 0 && *frame <= 100000000 &&
        frame_path(pattern, static_cast<int>(*frame)).filename() == name)
      frames.push_back(static_cast<int>(*frame));
  }
  if (error)
    return make_error(ErrorCode::kInput, "{}: cannot list the folder: {}", folder.string(),
                      error.message());
  std::sort(frames.begin(), frames.end());
  return frames;
}

Result<Shard> parse_shard(std::string_view text) {
  const auto from_environment = [](const char* name) -> std::optional<long long> {
    const char* value = std::getenv(name);
    return value ? parse_integer(value) : std::nullopt;
  };
  std::optional<long long> index, count;
  if (text == "auto") {
    if (const auto id = from_environment("SLURM_ARRAY_TASK_ID")) {
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
  std::vector<int> mine;
  for (std::size_t i = static_cast<std::size_t>(shard.index - 1); i < frames.size();
       i += static_cast<std::size_t>(shard.count))
    mine.push_back(frames[i]);
  return mine;
}

}  // namespace polymorph
