// Scene settings as plain structs: the content of a scene file with defaults filled in. Lengths in
// scene units, angles in degrees, colours scene-linear. scene/describe.h names every field, its
// range and its meaning once; the parser, the JSON Schema and `info` all read that description.
#pragma once

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/text.h"
#include "image/color_space.h"
#include "kernels/types.h"
#include "scene/keyframes.h"

namespace polymorph {

enum class SphereMethod : std::uint8_t {
  kOctree,   ///< the report's: one per finest cell (5.1.2.2)
  kActive,   ///< the report's: the largest cells that are mostly inside (5.1.3.2)
  kHubbard,  ///< Voronoi balls of surface samples, merged (Hubbard 1996)
  kMedial,   ///< a greedy cover by medial balls
};
enum class InsideMethod : std::uint8_t { kWinding, kParity };
enum class FitKind : std::uint8_t {
  kNone,       ///< balls straight from the spheres, as in the report
  kRound,      ///< fitted, round
  kEllipsoid,  ///< fitted, free to stretch
};

struct SphereSettings {
  SphereMethod method = SphereMethod::kMedial;
  int balls = 256;  ///< N of hubbard and medial
  float error = 0;  ///< medial: the fewest balls for this Hausdorff distance, as a share of the
                    ///< model's diagonal; 0: `balls`
  int resolution =
      0;  ///< R of octree and active: 2^(R-1) cells per axis; 1..9; 0 = by sphere count
  float root_margin = 0;  ///< octree and active: by how much the root cube is longer than the
                          ///< model's longest side, as a share of it
  FitKind fit = FitKind::kEllipsoid;
  InsideMethod inside = InsideMethod::kWinding;
  bool solidify = false;  ///< fill cavities and close holes first
  bool coarse = false;    ///< fit to few samples in few steps; no key, previews set it
};

enum class Easing : std::uint8_t { kLinear, kSmoothstep, kQuintic, kBezier, kSpring };
/// Field whose surface shows between two objects.
enum class Interpolation : std::uint8_t {
  kDistance,  ///< both objects' signed distances, carried along one smooth map and mixed
  kBalls,     ///< the field of the moving balls
};
/// Path of a ball; kAuto: kParts where the plan knows limbs, else kRigid.
enum class Path : std::uint8_t { kAuto, kStraight, kBezier, kRigid, kParts, kExplode };
enum class Stagger : std::uint8_t { kNone, kAxis, kRadius, kLabel, kNoise };

/// A damped spring (report Eq. 3.4); the unit of time is the motion's duration.
struct SpringSettings {
  float mass = 1;
  float stiffness = 120;
  float damping = 14;
  float lag = 0.5f;  ///< a ball's mass is `mass` times its share of the volume to this power
};

struct MotionSettings {
  Interpolation interpolate = Interpolation::kDistance;
  Path path = Path::kAuto;
  float bend = 0.25f;  ///< bezier: how high an arc the paths go in, as a share of their length
  float burst = 4;     ///< explode: speed, in the objects' sizes per motion
  float gravity = 1;   ///< explode: 1 = what brings a ball down within the motion
  Easing easing = Easing::kSmoothstep;
  std::vector<float> bezier{0.42f, 0.0f, 0.58f, 1.0f};  ///< x1, y1, x2, y2
  SpringSettings spring;
  Stagger stagger = Stagger::kNone;
  float stagger_share = 0.4f;  ///< share of the motion's time between the first start and the last
  Vec3 stagger_axis{0, 1, 0};  ///< stagger axis: balls start in this direction's order
  std::uint64_t seed = 0;      ///< stagger noise
  bool keep_volume = true;     ///< choose each frame's level so that V(u) = (1-u) V_A + u V_B
};

/// Axis of a model's file that points up.
enum class UpAxis : std::uint8_t { kY, kZ, kX };

/// Direction of a model's file in which its front looks; kAuto: found with the plan.
enum class Front : std::uint8_t { kAuto, kPlusX, kMinusX, kPlusY, kMinusY, kPlusZ, kMinusZ };

struct ObjectSettings {
  std::string name;             ///< default: the file's stem or the shape's name
  std::filesystem::path model;  ///< absolute; empty when `shape` is given
  /// Mesh sequence (scene/mesh_numbers.h): first and last number of its files and, if that is not
  /// 1, the step between two; empty for every other object.
  std::vector<int> range;
  std::optional<float> fps;  ///< meshes per second; none: the scene's frames.fps
  std::optional<bool> loop;  ///< begin again after the last mesh
  std::string shape;         ///< built-in shape; empty when `model` is given
  UpAxis up = UpAxis::kY;    ///< turned to y before everything else
  Front front = Front::kAuto;
  bool meta = false;    ///< passed through as balls only
  bool arrange = true;  ///< take part in the scene's arrangement
  Vec3 translate;
  Vec3 rotate;  ///< degrees about x, then y, then z
  Vec3 scale{1, 1, 1};
  std::optional<Vec3> color;  ///< overrides the model's colours (no texture then)
  std::optional<float> roughness, metallic, glass;  ///< override those of all its materials
  /// Faces that meet at more than this angle, in degrees, show a sharp edge. Given: instead of the
  /// file's normals; else those, and kCreaseDegrees where it has none.
  std::optional<float> crease;
  SphereSettings spheres;
  MotionSettings motion;  ///< motion of the leg that ends at this object
  int hold = 0;           ///< frames that it stands still between its two legs, or on its last mesh
  /// Time of the motion to it at which the morph leaves for the next object; 1: it is reached.
  float retarget = 1;
  std::optional<float> weight;  ///< weight in its actor's blend; empty in a chain
};

/// The built-in shapes an object may name; model/shapes.h makes them.
inline const std::vector<std::string> kShapeNames{"sphere", "cube", "torus", "puddle", "drops"};

enum class Arrange : std::uint8_t {
  kStand,  ///< each object gets the first source's size, stands on y = 0, centred on the y axis
  kNone,   ///< coordinates as in the files
};

struct FieldSettings {
  FieldKind kind = FieldKind::kGaussian;
  float blobbiness = 0;  ///< |B| of Blinn 1982, for balls without a fit; 0 = by method
  bool even = true;      ///< octree, active: strengths such that the field is alike at all centres
  float blob_constant = 1.0f;  ///< the report's blobConstant; inverse-square only
  float magnitude = 1.0f;      ///< the report's metaball magnitude, times R^2
  float threshold = 1.0f;      ///< the report's threshold
  bool match_volume = true;  ///< choose the level so that each model's surface encloses its volume
};

enum class PlanMethod : std::uint8_t {
  kIndex,      ///< the report's: list order, surplus balls paired with random ones (5.2.7)
  kNearest,    ///< every ball of either side with the cheapest one of the other
  kTransport,  ///< optimal transport of the balls' masses: balls split and merge
};

enum class AlignMethod : std::uint8_t {
  kNone,        ///< costs and paths see the objects as they stand
  kTranslate,   ///< centres of mass upon each other
  kRigid,       ///< and the turn at which they fit best
  kSimilarity,  ///< and the scale
};

enum class LabelMode : std::uint8_t {
  kOff,   ///< the models' face groups say nothing
  kSoft,  ///< going to another label costs PlanWeights::label
  kHard,  ///< no ball leaves its label
};

/// A named point of an object, as its file has it: before up, scale and everything else.
struct LandmarkPoint {
  std::optional<Vec3> point;  ///< empty: `vertex`
  long long vertex = 0;       ///< number of a vertex, from 1
  /// Its place in the scene file, for messages: 0 where it came from the command line.
  int line = 0, column = 0;
  std::string pointer;  ///< "/plan/landmarks/elk.obj/nose"
};
/// Landmarks of an object by name. Those of the same name of two neighbours in a chain belong
/// together.
using ObjectLandmarks = std::map<std::string, LandmarkPoint>;
/// Landmarks by object: its file's name, that without suffix, or its name in the scene.
using LandmarkSettings = std::map<std::string, ObjectLandmarks>;
inline constexpr std::size_t kMaxLandmarks = 64;  ///< limit of one object

/// Constants of the plan's cost and alignment, calibrated together: no keys of a scene.
struct PlanWeights {
  float align_gain = 0.5f;  ///< a rotation is kept only if it makes the plan this share cheaper
  /// A rotation that tips the object over is kept only if it leaves at most this mean squared
  /// distance between paired balls, over their mean squared radius: copies are below 0.15. 0 =
  /// never.
  float align_tip_residual = 0.15f;
  /// Weights of the cost's terms beside the squared distance in unit-RMS coordinates.
  float size = 0.1f;      ///< (ln R / R')^2
  float feature = 0.3f;   ///< squared difference of the features
  float landmark = 1.0f;  ///< squared difference of the distances to each landmark
  float label = 1.0f;     ///< another label, where labels are soft
};

/// Use of limbs in a plan: none, or each is carried to its counterpart where these are certain.
enum class PlanStructure : std::uint8_t { kOff, kAuto };

struct PlanSettings {
  PlanMethod method = PlanMethod::kTransport;
  std::uint64_t seed = 0;
  AlignMethod align = AlignMethod::kSimilarity;
  PlanWeights weights;
  LabelMode label_mode = LabelMode::kSoft;
  PlanStructure structure = PlanStructure::kAuto;  ///< kAuto: where both objects' limbs are certain
  /// "object.label" or "label" of one object -> of another; equal names belong together anyway.
  std::map<std::string, std::string> labels;
  LandmarkSettings landmarks;
};

enum class BoundaryMethod : std::uint8_t {
  kProject,    ///< the model's own mesh moves onto the balls' surface; kBlend where it cannot
  kBlend,      ///< one solid between the model and the balls' surface
  kCrossfade,  ///< the report's: the model shrinks while the balls grow
  kCut,        ///< nothing between
};

struct BoundarySettings {
  BoundaryMethod method = BoundaryMethod::kProject;
  float look_share = 0.12f;      ///< share of a leg's time, each full end: fade to the common look
  float boundary_share = 0.13f;  ///< share of a leg's time, each full end: model <-> balls
};

struct FrameSettings {
  int count = 0;             ///< frames in all, holds included; 0 = as many as the actors need
  std::vector<int> per_leg;  ///< frames of each leg of actors without their own; overrides count
  float fps = 24;
  int hold_start = 0;  ///< extra frames that stand still at the start
  int hold_end = 0;
  /// Above 0: instead of the film, so many frames of one turn of the camera around its frame
  /// `still`.
  int turntable = 0;
  int still = 1;
};

struct SurfaceSettings {
  int resolution = 128;  ///< cells along the longest side of an actor's box
  SurfaceMethod method = SurfaceMethod::kMarchingCubes;
  Placement placement = Placement::kRoot;
  bool flat = false;  ///< triangles without shared normals
  int influence = 1;  ///< cells between the points at which the field is computed
  /// Components of the surface below this share of the volume are left out; 0 keeps all.
  float min_component_share = 1e-4f;
};

struct CameraSettings {
  std::optional<Vec3>
      position;                ///< given: used as is; else placed by azimuth, elevation and framing
  std::optional<Vec3> target;  ///< default: middle of the scene's box
  Vec3 up{0, 1, 0};
  float fov = 30;        ///< vertical, degrees
  float azimuth = 28;    ///< degrees from +z towards +x
  float elevation = 16;  ///< degrees above the horizon
  float orbit = 0;       ///< degrees that it goes round its target during the film
  float dolly = 1;       ///< factor on its distance from the target
  float margin =
      0.05f;  ///< free border on each side when framing automatically, a share of the picture
  float aperture = 0;          ///< diameter of the lens, scene units; 0 = a pinhole, all sharp
  std::optional<float> focus;  ///< distance along the view axis; default: the target's
  float shutter = 0;           ///< time it is open, in frames, around the frame's own
};

enum class SkyKind : std::uint8_t {
  kStudio,  ///< soft boxes around the objects; the camera sees a paper backdrop
  kDay,     ///< clear sky by the key light, which is the sun
};

enum class LampKind : std::uint8_t {
  kLamp,   ///< a glowing ball, or a point
  kPanel,  ///< a rectangle that glows on the side of its target
  kSun,    ///< a disc infinitely far away, as the key light is
};

/// A light besides the key light and the sky. The camera does not see it; mirrors do.
struct LampSettings {
  LampKind kind = LampKind::kLamp;
  Vec3 position{1, 2, 2};       ///< lamp, panel
  std::optional<Vec3> target;   ///< lamp, panel; default: the middle of all objects
  float radius = 0.1f;          ///< lamp; 0 = a point
  float width = 1, height = 1;  ///< panel
  float azimuth = 120;          ///< sun, as the key's
  float elevation = 30;
  float size = 1;
  float intensity = 1;  ///< irradiance on a surface at the target that faces it
  Vec3 color{1, 1, 1};
};

inline constexpr std::size_t kMaxLamps = 16;

struct LightSettings {
  float key_azimuth = -40;  ///< degrees from +z towards +x, relative to the camera's azimuth
  float key_elevation = 48;
  float key_size = 12;  ///< apparent diameter in degrees; 0 = hard shadow
  float key_intensity = 2.4f;
  Vec3 key_color{1.0f, 0.96f, 0.90f};
  std::filesystem::path environment;  ///< lat-long image; empty = a built-in sky
  SkyKind sky = SkyKind::kStudio;
  float turbidity = 3;  ///< day: 2 very clear .. 10 hazy
  float sky_intensity = 1.0f;
  bool follow_camera = false;  ///< bearings are relative to the camera of each frame, not the first
  std::vector<LampSettings> lamps;
};

struct GroundSettings {
  bool enabled = true;
  std::optional<float> height;  ///< default: just below everything
  Vec3 color{0.42f, 0.42f, 0.44f};
  bool shadow_only = false;  ///< the picture keeps of it only the shadows, in alpha
  bool contact = true;  ///< between two objects that stand equally low, the surface stays as low
};

enum class LookKind : std::uint8_t {
  kOwn,    ///< the objects' own colours and textures, carried along and mixed
  kMetal,  ///< reflects the environment (the report's sphere-mapped look)
  kMatte,  ///< one diffuse colour
  kGlass,  ///< clear, tinted by the colour
};

/// The material of the surface between the objects.
struct LookSettings {
  LookKind kind = LookKind::kOwn;
  Vec3 color{0.92f, 0.93f, 0.95f};
  float roughness = 0.12f;
  float ior = 1.5f;  ///< glass
};

struct ImageSettings {
  int width = 640;
  int height = 480;
  int samples = 16;   ///< per pixel; with `noise` the maximum per pixel
  float noise = 0;    ///< above 0: pixels are sampled until their error is below this
  int max_depth = 4;  ///< path vertices
  std::uint64_t seed = 0;
  bool steady = true;        ///< things that stand still have the same noise in every frame
  bool denoise = false;      ///< use Open Image Denoise, where it is found
  bool smooth = false;       ///< smooth the noise of few samples (render/film/smooth.h)
  float exposure = 0;        ///< stops, PNG only (EXR stays linear)
  bool transparent = false;  ///< no backdrop: alpha 0 where the camera sees no object and no floor
  std::string aovs = "Z,N,id";  ///< EXR layers beside R, G, B, A: names, "all" or "none"
};

/// The layers that image.aovs may name.
inline const std::vector<std::string> kAovNames{"Z",
                                                "N",
                                                "P",
                                                "albedo",
                                                "uv",
                                                "motion",
                                                "morph",
                                                "label",
                                                "id",
                                                "crypto_object",
                                                "crypto_material",
                                                "crypto_label"};
/// Tests whether this layer is among those that image.aovs asks for.
inline bool aov_is_chosen(std::string_view aovs, std::string_view layer) {
  const std::vector<std::string> chosen = split(aovs, ',');
  return aovs == "all" || std::find(chosen.begin(), chosen.end(), layer) != chosen.end();
}

struct OutputSettings {
  std::string file = "frame.####.exr";           ///< used when the command line names none
  bool png = false;                              ///< a PNG beside each EXR
  ColorSpace color_space = ColorSpace::kRec709;  ///< space of the colours in EXR files
  bool multipart = false;                        ///< a part of an EXR for each layer
  int png_bits = 8;                              ///< 16, or 8 with dither
};

/// One chain of objects, its place in the scene and the frame at which it starts.
struct ActorSettings {
  std::string name;  ///< default: the source's
  ObjectSettings source;
  std::vector<ObjectSettings> intermediate;
  ObjectSettings target;
  /// Objects that are mixed by their weights, in the order of their names (scene/blends.h); empty:
  /// the actor goes from object to object.
  std::vector<ObjectSettings> blend;
  int start = 1;             ///< the frame from which it moves, frames.hold_start not counted
  std::vector<int> per_leg;  ///< frames of each leg; empty: the scene's
  /// Its place in the scene: rotated and scaled about the origin, then shifted.
  Vec3 translate;
  Vec3 rotate;  ///< degrees about x, then y, then z
  Vec3 scale{1, 1, 1};
  PlanSettings plan;
};

/// Calls the function with every object of an actor.
template <class Function>
void for_each_object(ActorSettings& actor, const Function& function) {
  function(actor.source);
  for (ObjectSettings& object : actor.intermediate) function(object);
  function(actor.target);
  for (ObjectSettings& object : actor.blend) function(object);
}

struct Scene {
  std::filesystem::path path;  ///< the file it came from
  int version = 1;
  std::string description;
  Arrange arrange = Arrange::kStand;
  /// Actors, at least one. A scene file with one may write its chain without a list around it.
  std::vector<ActorSettings> actors = std::vector<ActorSettings>(1);
  SphereSettings spheres;  ///< default of every object's own
  FrameSettings frames;
  FieldSettings field;
  PlanSettings plan;  ///< default of every actor's own
  MotionSettings motion;
  BoundarySettings boundary;
  SurfaceSettings surface;
  CameraSettings camera;
  LightSettings lights;
  GroundSettings ground;
  LookSettings look;
  ImageSettings image;
  OutputSettings output;
  /// Settings of camera, lights, ground, look and exposure that have keyframes; the settings
  /// themselves hold the first key's value.
  std::vector<KeyframeTrack> tracks;
};

/// Tests whether frames with these settings need the surface's motion.
inline bool wants_flow(const Scene& scene) {
  return scene.camera.shutter > 0 || aov_is_chosen(scene.image.aovs, "motion") ||
         aov_is_chosen(scene.image.aovs, "morph");
}

}  // namespace polymorph
