// Result<T>, the error type of the program (like std::expected): a value or an Error. Functions
// return errors that the outside world can cause; only a bug violates a PM_CHECK.
#pragma once

#include <fmt/format.h>

#include <stdexcept>
#include <string>
#include <utility>
#include <variant>

namespace polymorph {

/// Why something failed. The number is the program's exit code.
enum class ErrorCode : int {
  kAnswerNo = 1,       ///< the question was answered "no": images differ, check found errors
  kUsage = 2,          ///< the command line is wrong
  kInput = 3,          ///< scene, model or texture is bad; do not retry
  kOutput = 4,         ///< cannot write: disk full, permission
  kResource = 5,       ///< device absent, out of memory
  kPartial = 6,        ///< some frames failed under --keep-going
  kInternal = 70,      ///< a bug
  kResumable = 75,     ///< stopped on purpose before the end; run again to resume
  kInterrupted = 130,  ///< SIGINT
  kTerminated = 143,   ///< SIGTERM
};

struct Error {
  ErrorCode code = ErrorCode::kInternal;
  std::string
      message;  ///< "FILE:LINE:COL: what (why) - what to do"; lower case; may have several lines
};

template <class... Args>
Error make_error(ErrorCode code, fmt::format_string<Args...> text, Args&&... args) {
  return {code, fmt::format(text, std::forward<Args>(args)...)};
}

template <class T>
class [[nodiscard]] Result {
 public:
  Result(T value)
      : state_(std::in_place_index<0>, std::move(value)) {}  // NOLINT(google-explicit-constructor)
  Result(Error error)
      : state_(std::in_place_index<1>, std::move(error)) {}  // NOLINT(google-explicit-constructor)

  explicit operator bool() const { return state_.index() == 0; }
  bool ok() const { return state_.index() == 0; }
  T& value() & { return std::get<0>(state_); }
  const T& value() const& { return std::get<0>(state_); }
  T&& value() && { return std::get<0>(std::move(state_)); }
  T& operator*() & { return value(); }
  const T& operator*() const& { return value(); }
  T&& operator*() && { return std::move(*this).value(); }
  T* operator->() { return &value(); }
  const T* operator->() const { return &value(); }
  const Error& error() const& { return std::get<1>(state_); }
  Error&& error() && { return std::get<1>(std::move(state_)); }

 private:
  std::variant<T, Error> state_;
};

struct Ok {};
/// A Result without a value: `return Ok{};` on success.
using Status = Result<Ok>;

/// Thrown by PM_CHECK; only main() catches it.
class BugError : public std::logic_error {
 public:
  using std::logic_error::logic_error;
};

[[noreturn]] void throw_bug(const char* file, int line, const char* condition);

}  // namespace polymorph

/// Checks a condition that only a bug can violate, in all build types. Throws BugError.
#define PM_CHECK(condition) \
  ((condition) ? (void)0 : ::polymorph::throw_bug(__FILE__, __LINE__, #condition))

#define PM_CONCAT_(a, b) a##b
#define PM_CONCAT(a, b) PM_CONCAT_(a, b)

/// PM_TRY(auto x, call()): x is the value, or the enclosing function returns the error.
#define PM_TRY(declaration, ...)                                                                   \
  auto PM_CONCAT(pm_result_, __LINE__) = (__VA_ARGS__);                                            \
  if (!PM_CONCAT(pm_result_, __LINE__)) return std::move(PM_CONCAT(pm_result_, __LINE__)).error(); \
  declaration = std::move(PM_CONCAT(pm_result_, __LINE__)).value()

/// PM_TRY_STATUS(call()): the enclosing function returns the error, if there is one.
#define PM_TRY_STATUS(...)                                 \
  do {                                                     \
    auto pm_status_ = (__VA_ARGS__);                       \
    if (!pm_status_) return std::move(pm_status_).error(); \
  } while (false)
