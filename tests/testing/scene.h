// Tests that write a small scene and prepare it.
#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <string>

#include "base/file.h"
#include "scene/load_scene.h"
#include "sequence/prepare/prepare.h"
#include "testing/paths.h"
#include "testing/temporary_folder.h"

namespace polymorph {

/// Replaces object `index` of an actor by a changed copy, in the actor's chain and legs.
template <class Change>
void change_object(PreparedActor& actor, std::size_t index, const Change& change) {
  const std::shared_ptr<const PreparedObject> before = actor.objects[index];
  PreparedObject copy = *before;
  change(copy);
  const auto after = std::make_shared<const PreparedObject>(std::move(copy));
  actor.objects[index] = after;
  for (std::shared_ptr<const Leg>& leg : actor.legs) {
    Leg changed = *leg;
    if (changed.from == before) changed.from = after;
    if (changed.to == before) changed.to = after;
    leg = std::make_shared<const Leg>(std::move(changed));
  }
}

/// Fixture with a temporary folder and a CPU engine. `common`: JSON keys that every scene gets; the
/// argument of scene_of() and prepared_of() has the other keys.
class SceneTest : public FolderTest {
 protected:
  explicit SceneTest(std::string common) : common_(std::move(common)) {}

  Scene scene_of(const std::string& chain) {
    EXPECT_TRUE(write_file(folder / "scene.json", "{" + chain + ", " + common_ + "}").ok());
    auto scene = load_scene(folder / "scene.json");
    EXPECT_TRUE(scene.ok()) << scene.error().message;
    return scene.ok() ? *scene : Scene{};
  }
  PreparedScene prepared_of(const std::string& chain) {
    auto prepared = prepare_scene(scene_of(chain), *engine, {shared_cache()});
    EXPECT_TRUE(prepared.ok()) << prepared.error().message;
    return prepared.ok() ? std::move(*prepared) : PreparedScene{};
  }

  const std::unique_ptr<Engine> engine = make_cpu_engine();

 private:
  std::string common_;
};

}  // namespace polymorph
