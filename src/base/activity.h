// Activities: a name for every stage before the first frame, shown to someone who waits.
#pragma once

#include <string>

namespace polymorph {

enum class ActivityDisplay {
  kNone,
  kLine,  ///< a status line at the foot of a terminal
  kLog,   ///< a line of the log when a stage lasts longer than three seconds
  kJson,  ///< the same as {"stage": NAME, "seconds": S} on standard error
};

/// From now on stages are shown so. Starts a thread unless `display` is kNone; it ends with the
/// program.
void show_activities(ActivityDisplay display);

/// As long as it lives the program is at `name` ("fitting 256 balls to teapot"). Stages may contain
/// others: the innermost is shown. On any thread.
class Activity {
 public:
  explicit Activity(std::string name);
  ~Activity();
  Activity(const Activity&) = delete;
  Activity& operator=(const Activity&) = delete;

 private:
  unsigned long long id_;
};

}  // namespace polymorph
