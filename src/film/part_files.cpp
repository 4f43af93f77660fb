#include "film/part_files.h"

#include <algorithm>
#include <system_error>
#include <variant>

#include "image/exr_header.h"
#include "render/film/part.h"
#include "sequence/frame/render_frame.h"

namespace polymorph {

namespace fs = std::filesystem;

FrameHeader parse_frame_header(std::span<const Attribute> attributes) {
  FrameHeader header;
  for (const Attribute& attribute : attributes) {
    const auto* text = std::get_if<std::string>(&attribute.value);
    if (const int* frame = std::get_if<int>(&attribute.value);
        frame && attribute.name == kFrameAttribute)
      header.frame = *frame;
    if (!text) continue;
    if (attribute.name == kFrameHashAttribute || attribute.name == kPartOfAttribute)
      header.identity = *text;
    if (attribute.name != kPartSamplesAttribute) continue;
    if (const auto range = parse_sample_range(*text)) header.part = *range;
  }
  return header;
}

Result<FrameHeader> read_frame_header(const fs::path& file) {
  PM_TRY(const std::vector<Attribute> attributes, read_exr_attributes(file));
  return parse_frame_header(attributes);
}

Result<std::vector<PartFile>> list_parts(const fs::path& folder) {
  std::error_code error;
  std::vector<fs::path> files;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end;
       entry.increment(error))
    if (entry->path().extension() == ".exr") files.push_back(entry->path());
  if (error)
    return make_error(ErrorCode::kInput, "{}: cannot read the folder: {}", folder.string(),
                      error.message());
  std::sort(files.begin(), files.end());
  std::vector<PartFile> parts;
  for (const fs::path& file : files)
    if (const auto header = read_frame_header(file); header && header->part)
      parts.push_back({file, *header});
  return parts;
}

std::vector<PartFile> find_parts(const fs::path& folder) {
  std::vector<fs::path> folders{folder.empty() ? fs::path(".") : folder};
  std::error_code error;
  for (fs::directory_iterator entry(folders.front(), error), end; !error && entry != end;
       entry.increment(error)) {
    std::error_code ignored;
    if (entry->is_directory(ignored)) folders.push_back(entry->path());
  }
  std::sort(folders.begin() + 1, folders.end());
  std::vector<PartFile> parts;
  for (const fs::path& current : folders)
    if (auto folder_parts = list_parts(current))
      for (PartFile& part : *folder_parts) parts.push_back(std::move(part));
  return parts;
}

std::string format_samples(std::span<const SampleRange> ranges) {
  std::string text;
  for (const SampleRange& range : ranges)
    text += (text.empty() ? "" : ", ") + format_samples(range.first, range.end);
  return text;
}

std::vector<SampleRange> join_ranges(std::vector<SampleRange> ranges) {
  std::sort(ranges.begin(), ranges.end(), [](const SampleRange& a, const SampleRange& b) {
    return a.first != b.first ? a.first < b.first : a.end < b.end;
  });
  std::vector<SampleRange> joined;
  for (const SampleRange& range : ranges)
    if (!joined.empty() && range.first <= joined.back().end)
      joined.back().end = std::max(joined.back().end, range.end);
    else
      joined.push_back(range);
  return joined;
}

std::vector<SampleRange> missing_ranges(std::span<const SampleRange> joined, int total) {
  std::vector<SampleRange> missing;
  int next_sample = 0;
  for (const SampleRange& range : joined) {
    if (range.first > next_sample) missing.push_back({next_sample, range.first, total});
    next_sample = range.end;
  }
  if (next_sample < total) missing.push_back({next_sample, total, total});
  return missing;
}

}  // namespace polymorph
