// File input and atomic file output: files are read as a whole, and written completely or not at
// all.
#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"

namespace polymorph {

/// Reads a regular file of at most `limit` bytes. Directories, FIFOs and devices are refused
/// without being opened for reading. Errors: kInput, naming the path.
Result<std::string> read_file(const std::filesystem::path& path, std::uint64_t limit = 2ull << 30);

/// Writes `bytes` to `path` atomically: temporary file in the same folder, write, fsync, rename,
/// fsync of the folder. Missing parent folders are created. A pipe or a device is written to, not
/// replaced; a pipe without a reader is an error, not a wait. Errors: kOutput, naming the path and
/// the reason.
Status write_file(const std::filesystem::path& path, std::string_view bytes);

/// When set, for instance by a signal handler, every wait for the reader of a pipe ends, and
/// writing to the pipe fails (kOutput).
extern std::atomic<bool> stop_waiting_for_readers;

/// Returns the next bytes of a file, empty at its end. They are valid until the next call.
using ByteSource = std::function<Result<std::string_view>()>;
/// Makes a source of all bytes at once; they must outlive it.
ByteSource make_source(std::string_view bytes);
/// Writes a file piece by piece, without having it in memory. If `next` fails, the path stays
/// unchanged.
Status write_file(const std::filesystem::path& path, const ByteSource& next);

/// Removes temporaries of write_file() from `folder` that killed runs left there: those older than
/// a day, ".NAME.0123456789ab.part". Failures are ignored.
void remove_old_temporaries(const std::filesystem::path& folder);

/// A file to be written.
struct NewFile {
  std::filesystem::path path;
  std::string bytes;
};
/// Writes all files or none: after any failure or signal (which is deferred until the end) every
/// path has its old file or every path its new one. Only a kill or a power cut between the renames
/// at the end, a millisecond, can leave both. Pipes and devices are written last. Errors: kOutput.
Status write_files(const std::vector<NewFile>& files);

/// Checks early that write_file(path) can work. Errors (kOutput): the parent folder is missing and
/// cannot be created, a directory has that name, no permission, a file that this run reads. Creates
/// nothing.
Status check_writable(const std::filesystem::path& path);

/// Checks an output before any work: an existing file is replaced only with `overwrite`; then
/// check_writable(). Every output uses this rule. Errors: kOutput.
Status check_output(const std::filesystem::path& path, bool overwrite);

/// Registers a file that this run reads. During the lifetime of an InputGuard no function of this
/// header overwrites it, under whatever name and regardless of `overwrite`: files are identified by
/// device and inode. Names of other than regular files are ignored.
void remember_input(const std::filesystem::path& path);

/// Marks the duration of a run, of which a process has one at a time. Without it remember_input()
/// has no effect.
class InputGuard {
 public:
  InputGuard();
  ~InputGuard();
  InputGuard(const InputGuard&) = delete;
  InputGuard& operator=(const InputGuard&) = delete;
};

}  // namespace polymorph
