// File input and atomic file output: whole files are read, and written completely or not at all.
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

/// The bytes of a regular file of at most `limit` bytes. Directories, FIFOs and devices are refused
/// without being opened for reading. Errors: kInput, naming the path.
Result<std::string> read_file(const std::filesystem::path& path, std::uint64_t limit = 2ull << 30);

/// Writes `bytes` under `path` whole or not at all: a temporary beside it, write, fsync, rename,
/// fsync of the folder. Missing parent folders are made. A pipe or a device is written to, not
/// replaced; a pipe that nobody reads is an error, not a wait. Errors: kOutput, naming the path and
/// the reason.
Status write_file(const std::filesystem::path& path, std::string_view bytes);

/// Set, by a signal handler for instance, it ends every wait for the reader of a pipe; what is
/// written to the pipe fails (kOutput).
extern std::atomic<bool> stop_waiting_for_readers;

/// Gives the next bytes of a file, nothing at its end. What it gives lives until the next call.
using ByteSource = std::function<Result<std::string_view>()>;
/// The bytes at once; they must outlive it.
ByteSource source_of(std::string_view bytes);
/// The same for a file that is larger than memory should be. An error of `next` leaves the path as
/// it was.
Status write_file(const std::filesystem::path& path, const ByteSource& next);

/// Removes from `folder` what runs that were killed left of write_file(): temporaries older than a
/// day, ".NAME.0123456789ab.part". What cannot be removed stays.
void remove_old_temporaries(const std::filesystem::path& folder);

struct NewFile {
  std::filesystem::path path;
  std::string bytes;
};
/// Writes all of them or none: whatever fails, and whatever signal comes (it waits until all is
/// done), every path holds its old file or every path its new one. Only a kill or a power cut
/// between the renames at the end, a millisecond, can leave both. Errors: kOutput.
Status write_files(const std::vector<NewFile>& files);

/// Fails (kOutput) now if write_file(path) could not work later: parent folder missing and not
/// makeable, a directory in the way, no permission, a file that this run reads. Leaves nothing
/// behind.
Status check_writable(const std::filesystem::path& path);

/// The one rule for every output, asked before any work: a file that exists is replaced only with
/// `overwrite`; then check_writable(). Errors: kOutput.
Status check_output(const std::filesystem::path& path, bool overwrite);

/// Remembers a file that this run reads. While an InputGuard lives, nothing in this header writes
/// over it from then on, under whatever name and whether or not `overwrite` is given: files are
/// told apart by device and inode. Names of no regular file are ignored.
void remember_input(const std::filesystem::path& path);

/// The length of a run, of which a process has one at a time; without it remember_input() does
/// nothing.
class InputGuard {
 public:
  InputGuard();
  ~InputGuard();
  InputGuard(const InputGuard&) = delete;
  InputGuard& operator=(const InputGuard&) = delete;
};

}  // namespace polymorph
