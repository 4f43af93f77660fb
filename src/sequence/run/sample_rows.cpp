#include "sequence/run/sample_rows.h"

#include <algorithm>
#include <map>

#include "sequence/run/part_files.h"

namespace polymorph {

std::vector<SampleRow> find_samples(const std::filesystem::path& folder,
                                    std::span<const int> frames, std::span<const FileState> states,
                                    const ExpectedHashes& hashes) {
  std::map<int, SampleRow> rows_by_frame;
  for (const PartFile& part : find_parts(folder)) {
    const auto at = std::lower_bound(frames.begin(), frames.end(), part.header.frame);
    const auto i = static_cast<std::size_t>(at - frames.begin());
    if (at == frames.end() || *at != part.header.frame || states[i] == FileState::kCurrent ||
        part.header.identity != hashes.frames[i])
      continue;
    SampleRow& row = rows_by_frame[*at];
    row.ranges.push_back(*part.header.part);
    row.folders.insert(part.path.parent_path());
  }
  std::map<std::string, SampleRow> rows;
  for (auto& [frame, frame_row] : rows_by_frame) {
    frame_row.ranges = join_ranges(frame_row.ranges);
    SampleRow& row = rows[format_samples(frame_row.ranges)];
    row.ranges = frame_row.ranges;
    row.frames.push_back(frame);
    row.folders.merge(frame_row.folders);
  }
  std::vector<SampleRow> list;
  for (auto& [name, row] : rows) list.push_back(std::move(row));
  return list;
}

}  // namespace polymorph
