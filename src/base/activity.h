// Activities: named stages of the work before the first frame, shown to the user.
#pragma once

#include <string>

namespace polymorph {

/// Form in which stages are shown.
enum class ActivityDisplay {
  kNone,
  kLine,  ///< a status line at the bottom of a terminal, if a stage lasts longer than 0.1 seconds
  kLog,   ///< a line of the log, if a stage lasts longer than three seconds
  kJson,  ///< like kLog, but {"stage": NAME, "seconds": S} on standard error
};

/// Sets the display of stages. Unless it is kNone, starts a thread that ends with the program.
void show_activities(ActivityDisplay display);

/// Returns the name of the innermost stage that is active on any thread; "" if there is none.
std::string current_activity();

/// Marks a stage, e.g. "fitting 256 balls to teapot", for the lifetime of the object. Stages may be
/// nested; the innermost is shown. Usable on any thread.
class Activity {
 public:
  explicit Activity(std::string name);
  ~Activity();
  Activity(const Activity&) = delete;
  Activity& operator=(const Activity&) = delete;

 private:
  unsigned long long id_;  ///< unique number of the stage
};

}  // namespace polymorph
