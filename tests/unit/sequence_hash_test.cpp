#include <gtest/gtest.h>

#include <functional>
#include <set>

#include "assets/content_hash.h"
#include "scene/describe.h"
#include "testing/texture.h"

namespace polymorph {
namespace {

Model triangle() {
  Model model;
  model.name = "triangle";
  model.points = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  model.triangles = {Triangle{{0, 1, 2}}};
  model.corner_normals.assign(3, {0, 0, 1});
  model.corner_uvs = {{0, 0}, {1, 0}, {0, 1}};
  model.labels = {0};
  model.label_names = {"skin", "bone"};
  model.triangle_materials = {0};
  model.materials.resize(2);
  model.textures = {float_texture(make_image(2, 2, {"R", "G", "B"}))};
  return model;
}

Scene scene() {
  Scene scene;
  scene.path = "/a/scene.json";
  scene.actors.resize(1);
  ActorSettings& actor = scene.actors[0];
  actor.name = actor.source.name = "penguin";
  actor.source.model = "/a/penguin.obj";
  actor.target.name = "monkey";
  actor.target.model = "/a/monkey.obj";
  return scene;
}

std::string hash_of(const Scene& scene, const Model& model, const Image* environment = nullptr,
                    std::string_view program = program_identity()) {
  const std::vector<ChainObject> chain = chain_objects(scene);
  return content_hash({scene, chain, std::span(&model, 1), environment}, program);
}

/// A visitor of describe() that changes the field of number `target`, and names all fields.
class ChangeField {
 public:
  explicit ChangeField(int target) : target_(target) {}
  std::vector<std::string> names;

  template <class T>
  void integer(const char* key, T& value, Range<long long> range, const char*) {
    if (turn(key))
      value = static_cast<T>(value == static_cast<T>(range.low) ? range.high : range.low);
  }
  void number(const char* key, float& value, Range<double> range, const char*,
              Keyframes = Keyframes::kAsObject) {
    if (turn(key))
      value = static_cast<float>(value == static_cast<float>(range.low) ? range.high : range.low);
  }
  void number(const char* key, std::optional<float>& value, Range<double> range, const char*,
              Keyframes = Keyframes::kAsObject) {
    if (turn(key)) value = static_cast<float>(0.3 * range.low + 0.7 * range.high);
  }
  void boolean(const char* key, bool& value, const char*) {
    if (turn(key)) value = !value;
  }
  void boolean(const char* key, std::optional<bool>& value, const char*) {
    if (turn(key)) value = !value.value_or(false);
  }
  template <class E>
  void choice(const char* key, E& value, std::initializer_list<std::pair<const char*, E>> choices,
              const char*) {
    if (!turn(key)) return;
    for (const auto& [name, meaning] : choices) {
      if (meaning == value) continue;
      value = meaning;
      return;
    }
  }
  void text(const char* key, std::string& value, const char*) {
    if (turn(key)) value += "x";
  }
  void text_map(const char* key, std::map<std::string, std::string>& value, const char*) {
    if (turn(key)) value["x"] = "y";
  }
  void landmarks(const char* key, LandmarkSettings& value, const char*) {
    if (turn(key)) value["x"]["nose"].vertex = 1;
  }
  void path(const char* key, std::filesystem::path& value, const char*) {
    if (turn(key)) value = "another.file";
  }
  void model_path(const char* key, std::filesystem::path& value, const char* doc) {
    path(key, value, doc);
  }
  void vector(const char* key, Vec3& value, const char*) {
    if (turn(key)) value.y += 1;
  }
  void vector(const char* key, std::optional<Vec3>& value, const char*) {
    if (turn(key)) value = Vec3{1, 2, 3};
  }
  void scale(const char* key, Vec3& value, const char* doc) { vector(key, value, doc); }
  void color(const char* key, Vec3& value, const char* doc) { vector(key, value, doc); }
  void color(const char* key, std::optional<Vec3>& value, const char* doc) {
    vector(key, value, doc);
  }
  void integers(const char* key, std::vector<int>& value, Range<long long> range, const char*) {
    if (turn(key)) value.push_back(static_cast<int>(range.low));
  }
  void numbers(const char* key, std::vector<float>& values, std::initializer_list<Range<double>>,
               const char*) {
    if (!turn(key)) return;
    if (values.empty()) values.push_back(0);
    values[0] += 0.25f;
  }
  template <class T>
  void object(const char* key, T& value, const char*) {
    const std::string outer = prefix_;
    prefix_ += std::string(key) + "/";
    describe(*this, value);
    prefix_ = outer;
  }
  template <class T>
  void keyed_object(const char* key, T& value, const char* doc) {
    object(key, value, doc);
  }
  template <class T>
  void objects(const char* key, std::vector<T>& values, const char* doc) {
    for (std::size_t i = 0; i < values.size(); ++i)
      object((key + std::to_string(i)).c_str(), values[i], doc);
    if (turn(key)) values.emplace_back();
  }
  void actors(const char* key, std::vector<ActorSettings>& values, const char* doc) {
    objects(key, values, doc);
  }
  void before_actors(Scene&) {}
  void retired(const char*, const char*) {}

 private:
  bool turn(const char* key) {
    names.push_back(prefix_ + key);
    return static_cast<int>(names.size()) - 1 == target_;
  }
  int target_;
  std::string prefix_;
};

TEST(ContentHash, EveryKeyOfASceneCounts) {
  // Where a file is, what it is called and what people read of a scene decides no pixel; the files'
  // contents count by themselves.
  const auto is_free = [](const std::string& name) {
    return name == "polymorph" || name == "description" || name == "lights/environment" ||
           name.ends_with("/model") || name.starts_with("output/");
  };
  Scene whole = scene();
  whole.actors[0].intermediate.resize(1);
  whole.lights.lamps.resize(1);
  const Model model = triangle();
  const auto hash_with = [&](int target, std::vector<std::string>* names = nullptr) {
    Scene changed = whole;
    ChangeField change(target);
    describe(change, changed);
    if (names) *names = change.names;
    return hash_of(changed, model);
  };
  std::vector<std::string> names;
  const std::string base = hash_with(-1, &names);
  ASSERT_GT(names.size(), 150u);
  std::set<std::string> hashes{base};
  for (std::size_t i = 0; i < names.size(); ++i) {
    const std::string hash = hash_with(static_cast<int>(i));
    if (is_free(names[i]))
      EXPECT_EQ(hash, base) << names[i];
    else
      EXPECT_TRUE(hashes.insert(hash).second) << names[i];
  }
}

TEST(ContentHash, ContentsCountAndSpellingsDoNot) {
  Scene other = scene();
  other.path = "../a/scene.json";
  other.actors[0].source.model = "/a/../a/penguin.obj";
  other.actors[0].target.model = "/b/monkey.obj";
  other.output.file = "another.####.exr";
  Model renamed = triangle();
  renamed.name = "another";
  renamed.materials[0].name = "another";
  const Model model = triangle();
  EXPECT_EQ(hash_of(other, renamed), hash_of(scene(), model));
}

TEST(ContentHash, EverythingThatDecidesAFrameCounts) {
  const std::vector<std::function<void(Model&)>> changes{
      [](Model&) {},
      [](Model& m) { m.points[0].x = 0.5f; },
      [](Model& m) { m.triangles[0].v[0] = 1; },
      [](Model& m) { m.corner_normals[0].x = 1; },
      [](Model& m) { m.corner_uvs[0].x = 1; },
      [](Model& m) { m.labels[0] = 1; },
      [](Model& m) { std::swap(m.label_names[0], m.label_names[1]); },
      [](Model& m) { m.label_names.pop_back(); },
      [](Model& m) {
        m.label_names = {"skinbone", ""};
      },
      [](Model& m) { m.triangle_materials[0] = 1; },
      [](Model& m) { m.materials.pop_back(); },
      [](Model& m) { m.materials[0].color.x = 0; },
      [](Model& m) { m.materials[0].specular.x = 0; },
      [](Model& m) { m.materials[0].roughness = 0; },
      [](Model& m) { m.materials[0].metallic = 1; },
      [](Model& m) { m.materials[0].transmission = 1; },
      [](Model& m) { m.materials[0].ior = 1.3f; },
      [](Model& m) { m.materials[0].texture = 0; },
      [](Model& m) { m.textures.clear(); },
  };
  std::set<std::string> hashes;
  for (const auto& change : changes) {
    Model model = triangle();
    change(model);
    hashes.insert(hash_of(scene(), model));
  }
  EXPECT_EQ(hashes.size(), changes.size());
  const Model model = triangle();
  const std::vector<std::function<void(Scene&)>> settings{
      [](Scene& s) { s.image.smooth = true; }, [](Scene& s) { s.image.samples = 7; },
      [](Scene& s) { s.actors[0].target.name = "torus"; }};
  for (const auto& change : settings) {
    Scene changed = scene();
    change(changed);
    EXPECT_TRUE(hashes.insert(hash_of(changed, model)).second);
  }
  const Image sky = make_image(2, 1, {"R", "G", "B"});
  EXPECT_TRUE(hashes.insert(hash_of(scene(), model, &sky)).second);
  EXPECT_TRUE(hashes.insert(hash_of(scene(), model, nullptr, "another build")).second);
  EXPECT_FALSE(program_identity().empty());
}

}  // namespace
}  // namespace polymorph
