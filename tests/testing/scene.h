// Tests that write a small scene and prepare it.
#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <string>

#include "base/file.h"
#include "scene/load_scene.h"
#include "sequence/prepare.h"
#include "testing/paths.h"
#include "testing/temporary_folder.h"

namespace polymorph {

/// A folder of its own for each test. `common` stands behind every scene's own keys.
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
    auto prepared = prepare_scene(scene_of(chain), *engine, shared_cache());
    EXPECT_TRUE(prepared.ok()) << prepared.error().message;
    return prepared.ok() ? std::move(*prepared) : PreparedScene{};
  }

  const std::unique_ptr<Engine> engine = make_cpu_engine();

 private:
  std::string common_;
};

}  // namespace polymorph
