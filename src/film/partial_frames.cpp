#include "film/partial_frames.h"

#include <algorithm>
#include <map>

#include "film/part_files.h"

namespace polymorph {

std::vector<PartialFrames> find_partial_frames(const std::filesystem::path& folder,
                                               std::span<const int> frames,
                                               std::span<const FileState> states,
                                               const ExpectedHashes& hashes) {
  // Collect the parts of each frame. PartialFrames::frames stays empty.
  std::map<int, PartialFrames> groups_by_frame;
  for (const PartFile& part : find_parts(folder)) {
    const auto frame_in_list = std::lower_bound(frames.begin(), frames.end(), part.header.frame);
    const auto i = static_cast<std::size_t>(frame_in_list - frames.begin());
    if (frame_in_list == frames.end() || *frame_in_list != part.header.frame ||
        states[i] == FileState::kCurrent || part.header.identity != hashes.frames[i])
      continue;
    PartialFrames& group = groups_by_frame[*frame_in_list];
    group.ranges.push_back(*part.header.part);
    group.folders.insert(part.path.parent_path());
  }
  // Group the frames whose parts have the same samples.
  std::map<std::string, PartialFrames> groups;
  for (auto& [frame, frame_group] : groups_by_frame) {
    frame_group.ranges = join_ranges(frame_group.ranges);
    PartialFrames& group = groups[format_samples(frame_group.ranges)];
    group.ranges = frame_group.ranges;
    group.frames.push_back(frame);
    group.folders.merge(frame_group.folders);
  }
  std::vector<PartialFrames> list;
  for (auto& [samples, group] : groups) list.push_back(std::move(group));
  return list;
}

}  // namespace polymorph
