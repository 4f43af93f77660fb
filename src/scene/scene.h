// The scene as plain structs: what a scene JSON says after defaults. Lengths in scene units, angles
// in degrees, colours scene-linear. scene/describe.h names every field, its range and its meaning
// once; the parser, the JSON Schema and `info` all read that description.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "kernels/types.h"

namespace polymorph {

enum class SphereMethod : std::uint8_t { kOctree, kActive };
enum class InsideMethod : std::uint8_t { kWinding, kParity };

struct SphereSettings {
  SphereMethod method = SphereMethod::kOctree;
  int resolution = 0;  ///< R: 2^(R-1) cells an axis at the finest level; 1..9; 0 = by sphere count
  InsideMethod inside = InsideMethod::kWinding;
};

struct ObjectSettings {
  std::string name;             ///< default: the file's stem or the shape's name
  std::filesystem::path model;  ///< absolute; empty when `shape` is given
  std::string shape;            ///< built-in shape; empty when `model` is given
  bool meta = false;            ///< passed through as balls only
  bool arrange = true;          ///< take part in the scene's arrangement
  Vec3 translate;
  Vec3 rotate;  ///< degrees about x, then y, then z
  Vec3 scale{1, 1, 1};
  std::optional<Vec3> color;  ///< overrides the model's colours (no texture then)
  SphereSettings spheres;
};

/// The built-in shapes an object may name; model/shapes.h makes them.
inline const std::vector<std::string> kShapeNames{"sphere", "cube", "torus", "puddle"};

enum class Arrange : std::uint8_t {
  kStand,  ///< each object gets the source's size, stands on y = 0, centred on the y axis
  kNone,   ///< coordinates as in the files
};

struct FieldSettings {
  FieldKind kind = FieldKind::kGaussian;
  float blobbiness = 0.12f;    ///< |B| of Blinn 1982; Gaussian only; > 0
  bool even = true;            ///< Gaussian: strengths such that the field is alike at all centres
  float blob_constant = 1.0f;  ///< the report's blobConstant; inverse-square only
  float magnitude = 1.0f;      ///< the report's metaball magnitude, times R^2
  float threshold = 1.0f;      ///< the report's threshold
  bool match_volume = true;  ///< choose the level so that each model's surface encloses its volume
};

enum class PlanMethod : std::uint8_t {
  kIndex,      ///< the report's: list order, surplus balls paired with random ones (5.2.7)
  kBisection,  ///< both sets halved along their longest axis, over and over: neighbours stay
               ///< neighbours
};

struct PlanSettings {
  PlanMethod method = PlanMethod::kBisection;
  std::uint64_t seed = 0;
};

enum class Easing : std::uint8_t { kLinear, kSmoothstep, kQuintic };
enum class Path : std::uint8_t { kStraight };

struct MotionSettings {
  Path path = Path::kStraight;
  Easing easing = Easing::kQuintic;
  bool keep_volume = true;  ///< choose each frame's level so that V(u) = (1-u) V_A + u V_B
};

enum class BoundaryMethod : std::uint8_t { kCrossfade, kCut };

struct BoundarySettings {
  BoundaryMethod method = BoundaryMethod::kCrossfade;
  float look_share = 0.12f;  ///< of a leg's time at each full end: fading to / from the common look
  float boundary_share = 0.13f;  ///< of a leg's time at each full end: model <-> balls
};

struct FrameSettings {
  int count = 0;             ///< frames in all, holds included; 0 = from per_leg, else 24 a leg
  std::vector<int> per_leg;  ///< frames of each leg; overrides count
  float fps = 24;
  int hold_start = 0;  ///< extra frames that stand still at the start
  int hold_end = 0;
};

struct SurfaceSettings {
  int resolution = 96;  ///< cells along the longest side of the scene's box
  SurfaceMethod method = SurfaceMethod::kMarchingCubes;
  Placement placement = Placement::kRoot;
  bool flat = false;  ///< triangles without shared normals
  int influence = 1;  ///< cells between the points at which the field is computed
};

struct CameraSettings {
  std::optional<Vec3>
      position;                ///< given: used as is; else placed by azimuth, elevation and framing
  std::optional<Vec3> target;  ///< default: middle of the scene's box
  Vec3 up{0, 1, 0};
  float fov = 30;        ///< vertical, degrees
  float azimuth = 28;    ///< degrees from +z towards +x
  float elevation = 16;  ///< degrees above the horizon
  float margin =
      0.05f;  ///< free border on each side when framing automatically, a share of the picture
};

struct LightSettings {
  float key_azimuth = -40;  ///< degrees from +z towards +x, relative to the camera's azimuth
  float key_elevation = 48;
  float key_size = 12;  ///< apparent diameter in degrees; 0 = hard shadow
  float key_intensity = 2.4f;
  Vec3 key_color{1.0f, 0.96f, 0.90f};
  std::filesystem::path environment;  ///< lat-long image; empty = the built-in studio sky
  float sky_intensity = 1.0f;
};

struct GroundSettings {
  bool enabled = true;
  std::optional<float> height;  ///< default: just below everything
  Vec3 color{0.42f, 0.42f, 0.44f};
};

enum class LookKind : std::uint8_t {
  kMetal,  ///< reflects the environment (the report's sphere-mapped look)
  kMatte,  ///< one diffuse colour
};

struct LookSettings {
  LookKind kind = LookKind::kMetal;
  Vec3 color{0.92f, 0.93f, 0.95f};
  float roughness = 0.12f;
};

struct ImageSettings {
  int width = 640;
  int height = 480;
  int samples = 16;   ///< a pixel
  int max_depth = 4;  ///< path vertices
  std::uint64_t seed = 0;
  float exposure = 0;  ///< stops, PNG only (EXR stays linear)
};

struct OutputSettings {
  std::string file = "frame.####.exr";  ///< used when the command line names none
  bool png = false;                     ///< a PNG beside each EXR
};

struct Scene {
  std::filesystem::path path;  ///< the file it came from
  int version = 1;
  std::string description;
  Arrange arrange = Arrange::kStand;
  ObjectSettings source;
  std::vector<ObjectSettings> intermediate;
  ObjectSettings target;
  SphereSettings spheres;  ///< default of every object's own
  FrameSettings frames;
  FieldSettings field;
  PlanSettings plan;
  MotionSettings motion;
  BoundarySettings boundary;
  SurfaceSettings surface;
  CameraSettings camera;
  LightSettings lights;
  GroundSettings ground;
  LookSettings look;
  ImageSettings image;
  OutputSettings output;
};

}  // namespace polymorph
