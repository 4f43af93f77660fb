#include "base/archive.h"

#include <archive.h>
#include <archive_entry.h>

#include <memory>

#include "base/file.h"
#include "base/odd_names.h"

namespace polymorph {
namespace {

namespace fs = std::filesystem;
using Files = std::map<std::string, std::string>;

constexpr std::size_t kMaxFiles = 100000;

Error make_too_large_error(const fs::path& path, std::size_t max_bytes) {
  return make_error(ErrorCode::kInput, "{}: more than {} MiB or {} files in it", path.string(),
                    max_bytes >> 20, kMaxFiles);
}

Result<Files> read_folder(const fs::path& folder,
                          const std::function<bool(const std::string&)>& is_selected,
                          std::size_t max_bytes) {
  Files files;
  std::size_t total = 0;
  std::error_code error;
  for (fs::recursive_directory_iterator entry(folder, error), end; !error && entry != end;
       entry.increment(error)) {
    std::error_code ignored;
    if (!fs::is_regular_file(entry->symlink_status(ignored))) continue;
    const std::string name = entry->path().lexically_relative(folder).generic_string();
    if (!is_selected(name)) continue;
    PM_TRY(std::string bytes, read_file(entry->path(), max_bytes));
    total += bytes.size();
    if (total > max_bytes || files.size() >= kMaxFiles)
      return make_too_large_error(folder, max_bytes);
    remember_name(name);
    files[name] = std::move(bytes);
  }
  if (error)
    return make_error(ErrorCode::kInput, "{}: cannot be read: {}", folder.string(),
                      error.message());
  return files;
}

}  // namespace

Result<Files> read_tree(const fs::path& path,
                        const std::function<bool(const std::string&)>& is_selected,
                        std::size_t max_bytes) {
  std::error_code error;
  if (fs::is_directory(path, error)) return read_folder(path, is_selected, max_bytes);
  // Opening a pipe would wait for its writer.
  if (fs::is_other(path, error))
    return make_error(ErrorCode::kInput, "{}: is not a regular file", path.string());
  // Open the archive; libarchive recognizes its format and compression.
  const auto make_read_error = [&](archive* reader) {
    const char* const reason = archive_error_string(reader);
    return make_error(ErrorCode::kInput,
                      "{}: not a folder, nor a .zip or .tar that can be read{}{}", path.string(),
                      reason ? ": " : "", reason ? reason : "");
  };
  const std::unique_ptr<archive, int (*)(archive*)> reader(archive_read_new(), archive_read_free);
  if (!reader) return make_error(ErrorCode::kResource, "out of memory");
  archive_read_support_filter_gzip(reader.get());
  archive_read_support_filter_bzip2(reader.get());
  archive_read_support_filter_xz(reader.get());
  archive_read_support_filter_zstd(reader.get());
  archive_read_support_format_zip(reader.get());
  archive_read_support_format_tar(reader.get());
  if (archive_read_open_filename(reader.get(), path.c_str(), /*block_size=*/1 << 16) != ARCHIVE_OK)
    return make_read_error(reader.get());
  // Read the entries.
  Files files;
  std::size_t total = 0;
  archive_entry* entry = nullptr;
  int code = ARCHIVE_OK;
  while ((code = archive_read_next_header(reader.get(), &entry)) == ARCHIVE_OK) {
    const char* const stored_path = archive_entry_pathname(entry);
    if (!stored_path || archive_entry_filetype(entry) != AE_IFREG) continue;
    std::string name = fs::path(stored_path).lexically_normal().generic_string();
    if (!is_selected(name)) continue;
    if (files.size() >= kMaxFiles) return make_too_large_error(path, max_bytes);
    std::string bytes;
    char buffer[1 << 16];
    la_ssize_t count = 0;
    while ((count = archive_read_data(reader.get(), buffer, sizeof buffer)) > 0) {
      total += static_cast<std::size_t>(count);
      if (total > max_bytes) return make_too_large_error(path, max_bytes);
      bytes.append(buffer, static_cast<std::size_t>(count));
    }
    if (count < 0) return make_read_error(reader.get());
    remember_name(name);
    files[std::move(name)] = std::move(bytes);
  }
  if (code != ARCHIVE_EOF) return make_read_error(reader.get());
  return files;
}

}  // namespace polymorph
