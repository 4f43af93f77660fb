#include "base/frame_pattern.h"

#include <algorithm>

#include "base/text.h"

namespace polymorph {

Result<FramePattern> parse_pattern(const std::string& text) {
  const std::size_t name_at = text.rfind('/') == std::string::npos ? 0 : text.rfind('/') + 1;
  if (name_at == text.size())
    return make_error(ErrorCode::kUsage,
                      "{}: names a folder - add a file name such as frame.####.exr", text);
  if (text.substr(0, name_at).find('#') != std::string::npos)
    return make_error(ErrorCode::kUsage,
                      "{}: the frame number (####) must stand in the file name, not in a folder's",
                      text);
  FramePattern pattern;
  std::string* target = &pattern.before;  // `after`, once the number has been read
  *target = text.substr(0, name_at);
  // Sets the number's digits; the text that follows belongs to `after`.
  const auto set_digits = [&](int digits) -> Status {
    if (pattern.digits > 0)
      return make_error(ErrorCode::kUsage, "{}: has two places for the frame number - keep one",
                        text);
    pattern.digits = digits;
    target = &pattern.after;
    return Ok{};
  };
  // Read the file name: the number as #### or %04d, "%%", or any other character.
  for (std::size_t i = name_at; i < text.size();) {
    if (text[i] == '#') {
      std::size_t end = i;
      while (end < text.size() && text[end] == '#') ++end;
      // One # means one digit in Blender and four in OpenImageIO, so it is an error here.
      if (end - i == 1)
        return make_error(ErrorCode::kUsage,
                          "{}: a lone # is ambiguous - write #### for four digits", text);
      PM_TRY_STATUS(set_digits(static_cast<int>(end - i)));
      i = end;
    } else if (text.compare(i, 2, "%%") == 0) {
      *target += '%';
      i += 2;
    } else if (text[i] == '%') {
      const auto d = text.find('d', i);
      const auto digits =
          d == std::string::npos ? std::nullopt : parse_integer(text.substr(i + 1, d - i - 1));
      constexpr int kMaxDigits = 18;  // any number of 18 digits fits a long long
      if (!digits || text[i + 1] != '0' || *digits < 1 || *digits > kMaxDigits)
        return make_error(
            ErrorCode::kUsage,
            "{}: after % only a frame number as in %04d can stand - write %% for a percent sign",
            text);
      PM_TRY_STATUS(set_digits(static_cast<int>(*digits)));
      i = d + 1;
    } else {
      *target += text[i++];
    }
  }
  return pattern;
}

Result<FramePattern> parse_file_pattern(const std::filesystem::path& file) {
  PM_TRY(FramePattern pattern, parse_pattern(file.filename().string()));
  pattern.before = (file.parent_path() / pattern.before).string();
  return pattern;
}

FramePattern add_number(FramePattern pattern) {
  if (pattern.has_number()) return pattern;
  const std::size_t name_at =
      pattern.before.rfind('/') == std::string::npos ? 0 : pattern.before.rfind('/') + 1;
  const std::size_t dot = pattern.before.rfind('.');
  // A dot in a folder's name or at the start of the file name begins no extension.
  const std::size_t stem_end =
      dot == std::string::npos || dot <= name_at ? pattern.before.size() : dot;
  return {pattern.before.substr(0, stem_end) + ".", pattern.before.substr(stem_end), /*digits=*/4};
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
  // The "x" keeps filename() from being empty where the number begins the file name.
  const std::string prefix_x = fs::path(pattern.before + "x").filename().string();
  const std::string prefix = prefix_x.substr(0, prefix_x.size() - 1);
  std::error_code error;
  std::vector<int> frames;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    const std::string name = entry.path().filename().string();
    if (name.size() <= prefix.size() + pattern.after.size() || !name.starts_with(prefix) ||
        !name.ends_with(pattern.after))
      continue;
    const std::string digits =
        name.substr(prefix.size(), name.size() - prefix.size() - pattern.after.size());
    const auto frame = parse_integer(digits);
    // Accept only names that frame_path() returns: "frame.7.exr" is not frame 7 of
    // "frame.####.exr". 10^8 is also the limit of `range` in scenes.
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

}  // namespace polymorph
