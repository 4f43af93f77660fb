#include "base/file.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstring>
#include <deque>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <utility>

#include "base/input_files.h"
#include "base/input_recorder.h"
#include "base/memory.h"
#include "base/random.h"
#include "base/text.h"

namespace polymorph {
namespace {

namespace fs = std::filesystem;

/// A file descriptor that closes itself.
struct Descriptor {
  int fd = -1;
  ~Descriptor() {
    if (fd >= 0) ::close(fd);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  explicit Descriptor(int f) : fd(f) {}
};

/// A temporary file, removed by the destructor unless `keep` is set.
struct Temporary {
  fs::path path;
  bool keep = false;
  explicit Temporary(fs::path p) : path(std::move(p)) {}
  Temporary(const Temporary&) = delete;
  Temporary& operator=(const Temporary&) = delete;
  ~Temporary() {
    if (!keep) ::unlink(path.c_str());
  }
};

std::atomic<int> deferred_signal{0};  // 0 = none
void defer_signal(int signal_number) { deferred_signal = signal_number; }

/// Defers SIGINT, SIGTERM and SIGHUP during its lifetime, because ending the process between the
/// renames of several files would leave a mixture of old and new ones. Blocking them in the signal
/// mask would affect this thread only.
class DeferredSignals {
 public:
  DeferredSignals() {
    deferred_signal = 0;
    struct sigaction deferred {};
    deferred.sa_handler = defer_signal;
    sigemptyset(&deferred.sa_mask);
    deferred.sa_flags = SA_RESTART;
    for (std::size_t i = 0; i < std::size(kSignals); ++i) {
      ::sigaction(kSignals[i], nullptr, &previous_[i]);
      if (previous_[i].sa_handler != SIG_IGN) ::sigaction(kSignals[i], &deferred, nullptr);
    }
  }
  ~DeferredSignals() {
    for (std::size_t i = 0; i < std::size(kSignals); ++i)
      ::sigaction(kSignals[i], &previous_[i], nullptr);
    if (deferred_signal != 0) std::raise(deferred_signal);
  }
  DeferredSignals(const DeferredSignals&) = delete;
  DeferredSignals& operator=(const DeferredSignals&) = delete;

 private:
  static constexpr int kSignals[] = {SIGINT, SIGTERM, SIGHUP};
  struct sigaction previous_[std::size(kSignals)]{};
};

Error write_error(const fs::path& path, int errno_value, const char* remedy) {
  return make_error(ErrorCode::kOutput, "{}: cannot write: {} - {}", path.string(),
                    std::strerror(errno_value), remedy);
}

const char* suggest_remedy(int errno_value) {
  switch (errno_value) {
    case ENOSPC:
    case EDQUOT:
      return "free some space or choose another folder with -o";
    case EFBIG:
      return "raise the file size limit (ulimit -f)";
    case EACCES:
    case EPERM:
    case EROFS:
      return "choose a folder you may write to with -o";
    case EISDIR:
      return "a folder of that name is in the way";
    case ENOTDIR:
      return "a part of the path is a file, not a folder";
    default:
      return "choose another place with -o";
  }
}

// A temporary is called ".NAME.0123456789ab.part".
constexpr std::size_t kTagDigits = 12;
constexpr std::string_view kTemporaryEnd = ".part";

// Makes a name with a random tag, because processes in different containers may share the folder
// and have equal host names and process ids.
fs::path temporary_name(const fs::path& path) {
  static std::uint64_t counter = 0;
  const auto now = std::chrono::steady_clock::now().time_since_epoch().count();
  const std::uint64_t tag =
      random_u64(static_cast<std::uint64_t>(now), static_cast<std::uint64_t>(::getpid()),
                 __atomic_fetch_add(&counter, 1, __ATOMIC_RELAXED));
  // The shift leaves the tag's highest kTagDigits hex digits.
  return path.parent_path() / fmt::format(".{}.{:0{}x}{}", path.filename().string(),
                                          tag >> (64 - 4 * kTagDigits), kTagDigits, kTemporaryEnd);
}

bool is_temporary_name(std::string_view name) {
  if (!name.starts_with('.') || !name.ends_with(kTemporaryEnd)) return false;
  name.remove_suffix(kTemporaryEnd.size());
  if (name.size() <= kTagDigits + 2) return false;  // no NAME between the dots
  const std::string_view tag = name.substr(name.size() - kTagDigits - 1);
  return tag[0] == '.' && tag.find_first_not_of("0123456789abcdef", 1) == std::string_view::npos;
}

/// Device and inode of a file: its identity, independent of its name.
using FileIdentity = std::pair<dev_t, ino_t>;
/// Returns nothing if `path` is not a regular file.
std::optional<FileIdentity> find_identity(const fs::path& path) {
  struct stat info {};
  if (::stat(path.c_str(), &info) != 0 || !S_ISREG(info.st_mode)) return std::nullopt;
  return FileIdentity(info.st_dev, info.st_ino);
}

/// The files that this run reads, with the names under which it read them.
class Inputs {
 public:
  void begin() { reset(/*active=*/true); }
  void end() { reset(/*active=*/false); }
  void add(const fs::path& path) {
    std::error_code ignored;
    const std::lock_guard<std::mutex> lock(mutex_);
    if (!active_) return;
    if (const auto identity = find_identity(path)) names_[*identity] = fs::absolute(path, ignored);
  }
  bool contains(const fs::path& path) {
    const auto identity = find_identity(path);
    if (!identity) return false;
    const std::lock_guard<std::mutex> lock(mutex_);
    const auto entry = names_.find(*identity);
    // The inode of a removed file may have been reused by another file.
    return entry != names_.end() && find_identity(entry->second) == identity;
  }
  std::vector<fs::path> paths() {
    const std::lock_guard<std::mutex> lock(mutex_);
    std::set<fs::path> unique;
    for (const auto& [identity, path] : names_) unique.insert(path);
    return {unique.begin(), unique.end()};
  }

 private:
  void reset(bool active) {
    const std::lock_guard<std::mutex> lock(mutex_);
    active_ = active;
    names_.clear();
  }

  std::mutex mutex_;
  bool active_ = false;
  std::map<FileIdentity, fs::path> names_;  ///< absolute path of each file
};

Inputs& inputs() {
  static Inputs all;
  return all;
}

/// Checks that `path` is no directory, block device, socket or registered input. Errors: kOutput.
Status check_target(const fs::path& path) {
  std::error_code ignored;  // opening the file reports other problems
  const fs::file_type type = fs::status(path, ignored).type();
  if (type == fs::file_type::directory) return write_error(path, EISDIR, suggest_remedy(EISDIR));
  if (type == fs::file_type::block || type == fs::file_type::socket)
    return make_error(ErrorCode::kOutput,
                      "{}: cannot write: it is a block device or a socket - choose another name",
                      path.string());
  if (inputs().contains(path))
    return make_error(ErrorCode::kOutput,
                      "{}: is not written, because this command reads it - choose another name",
                      path.string());
  return Ok{};
}

/// Tests for pipes and devices (/dev/stdout, /dev/null), which are written to and never replaced.
bool is_stream(const fs::path& path) {
  std::error_code ignored;
  const fs::file_type type = fs::status(path, ignored).type();
  return type == fs::file_type::fifo || type == fs::file_type::character;
}

Status make_parent(const fs::path& path) {
  const fs::path parent = path.parent_path();
  if (parent.empty()) return Ok{};
  std::error_code error;
  fs::create_directories(parent, error);
  if (error) return write_error(path, error.value(), suggest_remedy(error.value()));
  return Ok{};
}

Status write_all(int fd, std::string_view bytes, const fs::path& path) {
  while (!bytes.empty()) {
    const ssize_t n = ::write(fd, bytes.data(), bytes.size());
    if (n < 0 && errno == EINTR) continue;
    if (n < 0 && errno == EAGAIN) {  // the pipe is full
      // Look at the flag now and then: a signal that another thread receives does not end poll().
      constexpr int kPollMilliseconds = 100;
      pollfd wait{fd, POLLOUT, 0};
      if (::poll(&wait, 1, kPollMilliseconds) >= 0 && !stop_waiting_for_readers) continue;
      return make_error(ErrorCode::kOutput, "{}: stopped by a signal while its reader waited",
                        path.string());
    }
    if (n < 0) return write_error(path, errno, suggest_remedy(errno));
    bytes.remove_prefix(static_cast<std::size_t>(n));
  }
  return Ok{};
}

Status write_all(int fd, const ByteSource& next, const fs::path& path) {
  for (;;) {
    PM_TRY(const std::string_view bytes, next());
    if (bytes.empty()) return Ok{};
    PM_TRY_STATUS(write_all(fd, bytes, path));
  }
}

Status write_stream(const fs::path& path, const ByteSource& next) {
  // O_NONBLOCK: opening a pipe must not wait for a reader.
  const Descriptor stream(::open(path.c_str(), O_WRONLY | O_CLOEXEC | O_NONBLOCK));
  if (stream.fd < 0 && errno == ENXIO)
    return make_error(ErrorCode::kOutput,
                      "{}: cannot write: nobody reads this pipe - start its reader first",
                      path.string());
  if (stream.fd < 0) return write_error(path, errno, suggest_remedy(errno));
  return write_all(stream.fd, next, path);
}

/// Writes the bytes durably to the temporary file.
Status write_temporary(const fs::path& path, const ByteSource& next, Temporary& temporary) {
  PM_TRY_STATUS(make_parent(path));
  const Descriptor file(
      ::open(temporary.path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666));
  if (file.fd < 0) {
    const int errno_value = errno;
    temporary.keep = true;  // the file was not created, so do not remove it
    return write_error(path, errno_value, suggest_remedy(errno_value));
  }
  PM_TRY_STATUS(write_all(file.fd, next, path));
  // EINVAL and EROFS mean that the file system does not support fsync() for this file.
  if (::fsync(file.fd) != 0 && errno != EINVAL && errno != EROFS)
    return write_error(path, errno, suggest_remedy(errno));
  return Ok{};
}

/// Makes a rename durable, if the file system supports it.
void sync_folder(const fs::path& path) {
  const fs::path parent = path.has_parent_path() ? path.parent_path() : fs::path(".");
  const Descriptor folder(::open(parent.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (folder.fd >= 0) ::fsync(folder.fd);
}

/// A pending replacement of `path`. The old file is kept for undo() until the destructor removes
/// it.
struct Replacement {
  const fs::path& path;
  Temporary new_file, old_file;
  bool had_old_file = false;
  explicit Replacement(const fs::path& p)
      : path(p), new_file(temporary_name(p)), old_file(temporary_name(p)) {}

  /// Replaces the file. Returns 0, or the errno value of a failure, after which the path is
  /// unchanged.
  int replace() {
    had_old_file = ::link(path.c_str(), old_file.path.c_str()) == 0;
    if (!had_old_file && errno != ENOENT) {
      // The file system has no hard links: rename the old file instead.
      std::error_code ignored;
      if (fs::is_directory(fs::symlink_status(path, ignored))) return EISDIR;
      if (::rename(path.c_str(), old_file.path.c_str()) != 0) return errno;
      had_old_file = true;
    }
    if (::rename(new_file.path.c_str(), path.c_str()) == 0) {
      new_file.keep = true;
      return 0;
    }
    const int errno_value = errno;
    if (had_old_file) undo();
    return errno_value;
  }
  /// Restores the old file; if that fails, the old file keeps its temporary name. If there was no
  /// old file, removes the new one.
  void undo() {
    if (had_old_file)
      old_file.keep = ::rename(old_file.path.c_str(), path.c_str()) != 0;
    else
      ::unlink(path.c_str());
  }
};

}  // namespace

std::atomic<bool> stop_waiting_for_readers{false};

void remove_old_temporaries(const fs::path& folder) {
  const auto yesterday = fs::file_time_type::clock::now() - std::chrono::hours(24);
  std::error_code error;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end;
       entry.increment(error)) {
    std::error_code ignored;
    if (!is_temporary_name(entry->path().filename().string())) continue;
    if (!fs::is_regular_file(entry->symlink_status(ignored))) continue;
    if (const auto time = entry->last_write_time(ignored); !ignored && time < yesterday)
      fs::remove(entry->path(), ignored);
  }
}

Result<std::string> read_file(const fs::path& path, std::uint64_t limit) {
  // Open the file, and check its type and size. O_NONBLOCK: opening a FIFO must not wait for a
  // writer.
  Descriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  if (file.fd < 0) {
    std::error_code ignored;
    const std::string from =
        path.is_absolute() ? "" : fmt::format(" (from {})", fs::current_path(ignored).string());
    return make_error(ErrorCode::kInput, "{}: cannot read: {}{} - check the path", path.string(),
                      std::strerror(errno), from);
  }
  struct stat info {};
  if (::fstat(file.fd, &info) != 0)
    return make_error(ErrorCode::kInput, "{}: cannot read: {}", path.string(),
                      std::strerror(errno));
  if (S_ISDIR(info.st_mode))
    return make_error(ErrorCode::kInput, "{}: is a directory - name a file in it", path.string());
  if (!S_ISREG(info.st_mode))
    return make_error(ErrorCode::kInput, "{}: is not a regular file", path.string());
  const auto size = static_cast<std::uint64_t>(info.st_size);
  if (size > limit)
    return make_error(ErrorCode::kInput, "{}: is too large ({} bytes, the limit is {})",
                      path.string(), size, limit);
  // The memory budget is not checked for files of up to 1 MiB.
  constexpr std::uint64_t kSmall = 1 << 20;
  if (const std::uint64_t available = size > kSmall ? remaining_memory() : size; size > available)
    return make_error(ErrorCode::kResource,
                      "{}: reading it takes {} of memory, and the limit leaves {} - use a smaller "
                      "file or raise --max-memory",
                      path.string(), format_bytes(static_cast<double>(size)),
                      format_bytes(static_cast<double>(available)));
  // Read the bytes.
  std::string bytes(size, '\0');
  std::size_t done = 0;
  while (done < bytes.size()) {
    const ssize_t n = ::read(file.fd, bytes.data() + done, bytes.size() - done);
    if (n < 0 && errno == EINTR) continue;
    if (n < 0)
      return make_error(ErrorCode::kInput, "{}: cannot read: {}", path.string(),
                        std::strerror(errno));
    if (n == 0) break;  // another process has shortened the file
    done += static_cast<std::size_t>(n);
  }
  bytes.resize(done);
  record_input(path, bytes);
  return bytes;
}

ByteSource make_source(std::string_view bytes) {
  return [bytes]() mutable -> Result<std::string_view> { return std::exchange(bytes, {}); };
}

Status write_file(const fs::path& path, std::string_view bytes) {
  return write_file(path, make_source(bytes));
}

Status write_file(const fs::path& path, const ByteSource& next) {
  PM_TRY_STATUS(check_target(path));
  if (is_stream(path)) return write_stream(path, next);
  Temporary temporary(temporary_name(path));
  PM_TRY_STATUS(write_temporary(path, next, temporary));
  if (::rename(temporary.path.c_str(), path.c_str()) != 0)
    return write_error(path, errno, suggest_remedy(errno));
  temporary.keep = true;
  sync_folder(path);
  return Ok{};
}

Status write_files(const std::vector<NewFile>& files) {
  for (const NewFile& file : files) PM_TRY_STATUS(check_writable(file.path));
  // Write all new files under temporary names, then rename them. If a renaming fails, undo those
  // before it.
  const DeferredSignals deferred;
  std::deque<Replacement> replacements;
  for (const NewFile& file : files)
    if (!is_stream(file.path))
      PM_TRY_STATUS(write_temporary(file.path, make_source(file.bytes),
                                    replacements.emplace_back(file.path).new_file));
  for (std::size_t i = 0; i < replacements.size(); ++i) {
    const int errno_value = replacements[i].replace();
    if (errno_value == 0) continue;
    for (std::size_t done = i; done > 0; --done) replacements[done - 1].undo();
    return write_error(replacements[i].path, errno_value, suggest_remedy(errno_value));
  }
  // Pipes come last, because writing to them cannot be undone.
  for (const NewFile& file : files)
    if (is_stream(file.path)) PM_TRY_STATUS(write_stream(file.path, make_source(file.bytes)));
  std::set<fs::path> folders;
  for (const NewFile& file : files)
    if (folders.insert(file.path.parent_path()).second) sync_folder(file.path);
  return Ok{};
}

Status check_writable(const fs::path& path) {
  std::error_code error;
  PM_TRY_STATUS(check_target(path));
  if (is_stream(path)) {
    if (::access(path.c_str(), W_OK) != 0) return write_error(path, errno, suggest_remedy(errno));
    return Ok{};
  }
  // Check the nearest existing folder; write_file() creates those below it.
  fs::path folder = path.has_parent_path() ? path.parent_path() : fs::path(".");
  while (!fs::exists(folder, error) && folder.has_parent_path() && folder != folder.parent_path())
    folder = folder.parent_path();
  if (folder.empty() || !fs::exists(folder, error)) folder = ".";
  if (!fs::is_directory(folder, error)) return write_error(path, ENOTDIR, suggest_remedy(ENOTDIR));
  if (::access(folder.c_str(), W_OK | X_OK) != 0)
    return write_error(path, errno, suggest_remedy(errno));
  return Ok{};
}

Status check_output(const fs::path& path, bool overwrite) {
  PM_TRY_STATUS(check_target(path));
  std::error_code ignored;
  if (!overwrite && fs::exists(path, ignored) && !is_stream(path))
    return make_error(ErrorCode::kOutput, "{}: exists - add --overwrite to replace it",
                      path.string());
  return check_writable(path);
}

void remember_input(const fs::path& path) {
  inputs().add(path);
  record_input(path);
}

std::vector<fs::path> input_files() { return inputs().paths(); }

InputGuard::InputGuard() { inputs().begin(); }
InputGuard::~InputGuard() { inputs().end(); }

}  // namespace polymorph
