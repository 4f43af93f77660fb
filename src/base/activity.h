// Activities: named stages of the work before the first frame, shown to the user.
#pragma once

#include <string>

namespace polymorph {

/// Form in which stages are shown.
enum class ActivityDisplay {
  kNone,
  kLine,  ///< a status line at the foot of a terminal
  kLog,   ///< a line of the log when a stage lasts longer than three seconds
  kJson,  ///< the same as {"stage": NAME, "seconds": S} on standard error
};

/// Sets the display of stages. Starts a thread unless `display` is kNone; it ends with the program.
void show_activities(ActivityDisplay display);

/// Returns the name of the innermost stage that is active on any thread; "" if there is none.
std::string current_activity();

/// Marks a stage, e.g. "fitting 256 balls to teapot", for its lifetime. Stages may be nested: the
/// innermost is shown. Usable on any thread.
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
