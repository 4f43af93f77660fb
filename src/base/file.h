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

/// Reads a regular file of at most `limit` bytes. Refuses directories, FIFOs and devices, and never
/// waits for the writer of a FIFO. Errors, naming the path: kInput; kResource if the file exceeds
/// remaining_memory() (base/memory.h).
Result<std::string> read_file(const std::filesystem::path& path, std::uint64_t limit = 2ull << 30);

/// Writes `bytes` to `path` atomically: temporary file in the same folder, write, fsync, rename,
/// fsync of the folder. Missing parent folders are created. Pipes and devices are written to, not
/// replaced; a pipe without a reader is an error. Errors: kOutput, naming the path and the reason.
Status write_file(const std::filesystem::path& path, std::string_view bytes);

/// Setting this flag, for instance in a signal handler, ends every wait for the reader of a pipe;
/// writing to that pipe then fails (kOutput).
extern std::atomic<bool> stop_waiting_for_readers;

/// A function that returns the next bytes of a file, or no bytes at the file's end. The bytes are
/// valid until the next call.
using ByteSource = std::function<Result<std::string_view>()>;
/// Makes a source that returns all bytes at once; `bytes` must outlive the source.
ByteSource make_source(std::string_view bytes);
/// Writes a file from a source, without holding all of it in memory. If `next` fails, the path
/// stays unchanged.
Status write_file(const std::filesystem::path& path, const ByteSource& next);

/// Removes the temporary files of write_file() (".NAME.0123456789ab.part") that killed runs left in
/// `folder`, if they are older than a day. Ignores failures.
void remove_old_temporaries(const std::filesystem::path& folder);

struct NewFile {
  std::filesystem::path path;
  std::string bytes;
};
/// Writes all files or none. After any failure or signal (signals are deferred until the end),
/// every path has its old file, or every path has its new one. Only SIGKILL or a power cut between
/// the renames at the end, which take a millisecond, can leave a mixture. Pipes and devices are
/// written last. Errors: kOutput.
Status write_files(const std::vector<NewFile>& files);

/// Checks early that write_file(path) can work; creates nothing. Errors (kOutput): the parent
/// folder is missing and cannot be created, a directory has that name, permission is missing, or
/// this run reads the file.
Status check_writable(const std::filesystem::path& path);

/// Checks an output path before any work is done, by check_writable(). Without `overwrite`, an
/// existing file is an error. Every output uses this function. Errors: kOutput.
Status check_output(const std::filesystem::path& path, bool overwrite);

/// Registers a file that this run reads. During the lifetime of an InputGuard, no function of this
/// header overwrites it, not even under another name or with `overwrite`: files are identified by
/// device and inode. Anything but a regular file is ignored.
void remember_input(const std::filesystem::path& path);

/// Marks a run, such as one command: the run lasts as long as this object lives. A process has one
/// run at a time. Outside a run, remember_input() protects nothing.
class InputGuard {
 public:
  InputGuard();
  ~InputGuard();
  InputGuard(const InputGuard&) = delete;
  InputGuard& operator=(const InputGuard&) = delete;
};

}  // namespace polymorph
