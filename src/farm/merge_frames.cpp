#include "farm/merge_frames.h"

#include <algorithm>
#include <map>
#include <set>
#include <system_error>
#include <utility>

#include "base/file.h"
#include "base/text.h"
#include "film/part_files.h"
#include "image/exr_header.h"
#include "image/image_io.h"
#include "render/film/part.h"
#include "sequence/frame/render_frame.h"

namespace polymorph {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMaxNamedFrames = 20;  // frames that one error message lists

/// Reads the header of a part. Errors (kInput): the file is no part.
Result<PartFile> read_part_header(const fs::path& file) {
  PM_TRY(FrameHeader header, read_frame_header(file));
  if (header.part && !header.identity.empty()) return PartFile{file, std::move(header)};
  return make_error(ErrorCode::kInput,
                    "{}: is no part of a frame - parts are rendered with --samples "
                    "FIRST-LAST/TOTAL",
                    file.string());
}

/// Lists the parts that the inputs name, each once, in the order of the inputs. Errors: kInput for
/// an input without a part; kUsage for a wrong pattern.
Result<std::vector<PartFile>> collect_parts(const std::vector<std::string>& inputs) {
  std::vector<PartFile> parts;
  for (const std::string& input : inputs) {
    std::error_code error;
    if (fs::is_directory(input, error)) {
      PM_TRY(const std::vector<PartFile> folder_parts, list_parts(input));
      if (folder_parts.empty())
        return make_error(ErrorCode::kInput,
                          "{}: has no parts - they are rendered with --samples FIRST-LAST/TOTAL",
                          input);
      parts.insert(parts.end(), folder_parts.begin(), folder_parts.end());
      continue;
    }
    // A name with # or % is a pattern, unless a file has that very name.
    if (fs::exists(input, error) || input.find_first_of("#%") == std::string::npos) {
      PM_TRY(PartFile part, read_part_header(input));
      parts.push_back(std::move(part));
      continue;
    }
    PM_TRY(const FramePattern pattern, parse_pattern(input));
    PM_TRY(const std::vector<int> frames, existing_frames(pattern));
    if (frames.empty()) return make_error(ErrorCode::kInput, "{}: there is no such frame", input);
    for (const int frame : frames) {
      PM_TRY(PartFile part, read_part_header(frame_path(pattern, frame)));
      parts.push_back(std::move(part));
    }
  }
  // Drop files that several inputs name.
  std::set<fs::path> unique;
  std::erase_if(parts, [&](const PartFile& part) {
    std::error_code error;
    return !unique.insert(fs::weakly_canonical(part.path, error)).second;
  });
  return parts;
}

std::string describe(const PartFile& part) {
  return fmt::format("{} ({})", part.path.string(), format_sample_range(*part.header.part));
}

/// Checks that a frame's parts, in the order of their samples, belong to one picture and have no
/// samples in common. Errors: kInput.
Status check_one_picture(int frame, const std::vector<PartFile>& parts) {
  for (std::size_t i = 1; i < parts.size(); ++i) {
    const PartFile &first = parts.front(), &previous = parts[i - 1], &part = parts[i];
    if (part.header.part->total != first.header.part->total)
      return make_error(ErrorCode::kInput,
                        "frame {}: {} and {} are parts of pictures with different numbers of "
                        "samples",
                        frame, describe(first), describe(part));
    if (part.header.identity != first.header.identity)
      return make_error(ErrorCode::kInput,
                        "frame {}: {} and {} are not of one picture: their scenes, settings or "
                        "builds of the program differ",
                        frame, describe(first), describe(part));
    if (part.header.part->first < previous.header.part->end)
      return make_error(ErrorCode::kInput, "frame {}: {} and {} have samples in common", frame,
                        describe(previous), describe(part));
  }
  return Ok{};
}

/// Describes the samples that are missing for a frame or, with `partial`, for a larger part without
/// gaps. Returns "" if no sample is missing, or if the merge makes a draft.
std::string describe_missing_samples(const FrameMerge& merge, bool partial) {
  const std::vector<SampleRange>& joined = merge.ranges;
  const int total = merge.samples.total;
  // A draft may have gaps between its ranges; a larger part must be a single range.
  if (merge.is_draft || (joined.size() == 1 && (partial || merge.samples.is_whole()))) return "";
  std::string options;
  for (const SampleRange& range : missing_ranges(joined, total))
    options +=
        fmt::format("{}--samples {}", options.empty() ? "" : " and ", format_sample_range(range));
  return fmt::format("frame {}: there are samples {} of {} - render the others with {}{}",
                     merge.frame, format_samples(joined), total, options,
                     joined.size() == 1 ? ", or write a larger part with --partial" : "");
}

}  // namespace

Result<std::vector<FrameMerge>> plan_merge(const MergeSettings& settings) {
  PM_TRY(FramePattern output, parse_pattern(settings.output));
  if (frame_path(output, /*frame=*/1).extension() != ".exr")
    return make_error(ErrorCode::kUsage,
                      "{}: frames are merged to EXR files - end the name in .exr", settings.output);
  PM_TRY(const std::vector<PartFile> files, collect_parts(settings.inputs));
  // Group the parts by frame.
  std::map<int, std::vector<PartFile>> frames;
  for (const PartFile& file : files) {
    remember_input(file.path);
    frames[file.header.frame].push_back(file);
  }
  if (frames.size() > 1) output = add_number(output);
  // Check the parts of each frame. One message then lists what all frames lack.
  std::vector<FrameMerge> merges;
  std::vector<std::string> gaps;
  for (auto& [frame, parts] : frames) {
    std::stable_sort(parts.begin(), parts.end(), [](const PartFile& a, const PartFile& b) {
      return a.header.part->first < b.header.part->first;
    });
    PM_TRY_STATUS(check_one_picture(frame, parts));
    const SampleRange &first = *parts.front().header.part, &last = *parts.back().header.part;
    FrameMerge merge{frame,
                     {first.first, last.end, first.total},
                     /*parts=*/{},
                     /*ranges=*/{},
                     /*is_draft=*/false,
                     frame_path(output, frame)};
    std::vector<SampleRange> ranges;
    for (const PartFile& part : parts) {
      merge.parts.push_back(part.path);
      ranges.push_back(*part.header.part);
    }
    merge.ranges = join_ranges(ranges);
    merge.is_draft =
        settings.draft && !(merge.ranges.size() == 1 && merge.ranges.front().is_whole());
    if (std::string gap = describe_missing_samples(merge, settings.partial); !gap.empty())
      gaps.push_back(std::move(gap));
    merges.push_back(std::move(merge));
  }
  if (!gaps.empty()) {
    const std::size_t count = gaps.size();
    if (count > kMaxNamedFrames) gaps.resize(kMaxNamedFrames);
    return make_error(
        ErrorCode::kInput, "{}{}", fmt::join(gaps, "\n"),
        count > kMaxNamedFrames ? fmt::format("\n... and {} more", count - kMaxNamedFrames) : "");
  }
  for (const FrameMerge& merge : merges)
    PM_TRY_STATUS(check_output(merge.output, settings.overwrite));
  return merges;
}

Status merge_frame(const FrameMerge& merge, const std::string& command) {
  ReadImageSettings unlimited;
  unlimited.max_bytes = std::size_t{1} << 40;  // 1 TiB; the process's memory limit still applies
  std::vector<Part> parts;
  for (const fs::path& file : merge.parts) {
    PM_TRY(Image image, read_image(file, unlimited));
    // Take the attributes with the names and values of the file, because they are written again.
    PM_TRY(image.attributes, read_exr_attributes(file));
    const FrameHeader header = parse_frame_header(image.attributes);
    if (!header.part)
      return make_error(ErrorCode::kInput, "{}: has changed while it was read", file.string());
    parts.push_back({file.string(), *header.part, std::move(image)});
  }
  const ExrSettings merged_settings = merged_exr_settings(parts.front().image);
  PM_TRY(Image image, merge_parts(parts, merge.is_draft));
  parts.clear();
  const bool is_whole = merge.samples.is_whole() && !merge.is_draft;
  // The identity that all parts share is the hash of the whole frame.
  for (Attribute& attribute : image.attributes) {
    if (attribute.name == kCommandAttribute) attribute.value = printable(command);
    if (attribute.name == kPartOfAttribute && is_whole) attribute.name = kFrameHashAttribute;
  }
  if (merge.is_draft)
    image.attributes.push_back(
        {kDraftAttribute,
         fmt::format("{} of {}", format_samples(merge.ranges), merge.samples.total)});
  // A larger part is written as all parts are: with default settings.
  return write_image(merge.output, image, /*png=*/{},
                     is_whole || merge.is_draft ? merged_settings : ExrSettings{});
}

}  // namespace polymorph
