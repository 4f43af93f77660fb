#include "image/movie.h"

#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <vector>

#include "base/file.h"
#include "image/rgb_channels.h"
#include "image/srgb.h"

extern char** environ;

namespace polymorph {
namespace {

namespace fs = std::filesystem;

/// A child process that reads from a pipe; its messages go to a file.
class Child {
 public:
  /// Starts the program. If that fails, finish() returns false.
  Child(const fs::path& program, std::vector<std::string> arguments, const fs::path& messages) {
    int pipe_ends[2];  // to read from, to write to
    if (pipe2(pipe_ends, O_CLOEXEC) != 0) return;
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_adddup2(&actions, pipe_ends[0], 0);
    posix_spawn_file_actions_addopen(&actions, 1, "/dev/null", O_WRONLY, 0);
    posix_spawn_file_actions_addopen(&actions, 2, messages.c_str(), O_WRONLY | O_CREAT | O_TRUNC,
                                     /*mode=*/0600);
    std::vector<char*> argv;
    for (std::string& argument : arguments) argv.push_back(argument.data());
    argv.push_back(nullptr);
    if (posix_spawn(&pid_, program.c_str(), &actions, nullptr, argv.data(), environ) != 0)
      pid_ = -1;
    posix_spawn_file_actions_destroy(&actions);
    close(pipe_ends[0]);
    to_child_ = pipe_ends[1];
  }
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;
  ~Child() { finish(); }

  /// Writes all bytes to the pipe; returns false if the program has ended.
  bool write(const std::string& bytes) {
    for (std::size_t written = 0; written < bytes.size();) {
      const ssize_t n = ::write(to_child_, bytes.data() + written, bytes.size() - written);
      if (n <= 0 && errno != EINTR) return false;
      written += static_cast<std::size_t>(std::max<ssize_t>(n, 0));
    }
    return true;
  }
  /// Closes the pipe and waits; returns true if the program succeeded.
  bool finish() {
    if (to_child_ >= 0) close(to_child_);
    to_child_ = -1;
    if (pid_ < 0) return false;
    int state = 0;
    while (waitpid(pid_, &state, 0) < 0 && errno == EINTR) {
    }
    pid_ = -1;
    return WIFEXITED(state) && WEXITSTATUS(state) == 0;
  }

 private:
  pid_t pid_ = -1;     ///< -1: no program runs
  int to_child_ = -1;  ///< writing end of the pipe; -1: closed
};

/// Encodes a frame as ffmpeg's rgb24: three bytes per pixel, with the sRGB curve.
std::string to_rgb_bytes(const Image& image) {
  const SrgbQuantizer& quantizer = SrgbQuantizer::instance();
  const std::array<int, 3> color = find_rgb(image);
  std::string bytes;
  bytes.reserve(static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height) * 3);
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x)
      for (const int c : color)
        // A frame without G or B repeats its first channel.
        bytes.push_back(static_cast<char>(quantizer(image.at(x, y, std::max(c, 0)))));
  return bytes;
}

}  // namespace

fs::path find_ffmpeg() {
  const char* path = std::getenv("PATH");
  std::string_view remaining = path ? path : "";
  while (!remaining.empty()) {
    const std::size_t end = std::min(remaining.find(':'), remaining.size());
    const fs::path candidate = fs::path(remaining.substr(0, end)) / "ffmpeg";
    if (end > 0 && access(candidate.c_str(), X_OK) == 0) return candidate;
    remaining.remove_prefix(std::min(end + 1, remaining.size()));
  }
  return {};
}

Status write_mp4(const fs::path& path, std::span<const Image> frames, float frames_per_second) {
  PM_TRY_STATUS(check_writable(path));
  if (frames.empty()) return make_error(ErrorCode::kInput, "a movie needs at least one frame");
  const int width = frames.front().width, height = frames.front().height;
  for (const Image& frame : frames)
    if (frame.width != width || frame.height != height || frame.find_channel("R") < 0)
      return make_error(ErrorCode::kInput,
                        "the frames of a movie must be of one size and have colours");
  const fs::path program = find_ffmpeg();
  if (program.empty()) return make_error(ErrorCode::kResource, "ffmpeg is not installed");
  // Names that other runs do not use.
  const fs::path temporary = path.string() + fmt::format(".{}.part", getpid());
  const fs::path messages = path.string() + fmt::format(".{}.log.part", getpid());
  // SIGPIPE is ignored, so that writing to a child that has ended returns an error instead of
  // ending this program.
  struct sigaction ignore = {}, previous = {};
  ignore.sa_handler = SIG_IGN;
  sigaction(SIGPIPE, &ignore, &previous);
  // Run ffmpeg, and send it the frames as raw pixels.
  bool succeeded = true;
  {
    Child child(program,
                {"ffmpeg",
                 "-hide_banner",
                 "-loglevel",
                 "error",
                 "-y",
                 "-f",
                 "rawvideo",
                 "-pixel_format",
                 "rgb24",
                 "-video_size",
                 fmt::format("{}x{}", width, height),
                 "-framerate",
                 fmt::format("{}", frames_per_second),
                 "-i",
                 "-",
                 "-vf",
                 "crop=trunc(iw/2)*2:trunc(ih/2)*2,scale=out_color_matrix=bt709:out_range=tv",
                 "-c:v",
                 "libx264",
                 "-crf",
                 "18",
                 "-pix_fmt",
                 "yuv420p",
                 "-colorspace",
                 "bt709",
                 "-color_primaries",
                 "bt709",
                 "-color_trc",
                 "iec61966-2-1",
                 "-movflags",
                 "+faststart",
                 "-f",
                 "mp4",
                 temporary.string()},
                messages);
    for (const Image& frame : frames) succeeded = succeeded && child.write(to_rgb_bytes(frame));
    succeeded = child.finish() && succeeded;
  }
  sigaction(SIGPIPE, &previous, nullptr);
  // Move the movie into its place, or report ffmpeg's messages.
  const auto log = read_file(messages, 1u << 16);  // at most 64 KiB
  std::error_code error;
  fs::remove(messages, error);
  if (succeeded) fs::rename(temporary, path, error);
  if (!succeeded || error) {
    fs::remove(temporary, error);
    return make_error(ErrorCode::kOutput, "{}: ffmpeg could not write it: {}", path.string(),
                      log && !log->empty() ? log->substr(0, log->find_last_not_of(" \n") + 1)
                                           : "no reason given");
  }
  return Ok{};
}

}  // namespace polymorph
