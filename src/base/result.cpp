#include "base/result.h"

namespace polymorph {

void throw_bug(const char* file, int line, const char* condition) {
  throw BugError(fmt::format("{}:{}: check failed: {}", file, line, condition));
}

}  // namespace polymorph
