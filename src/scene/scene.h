// Scene settings as plain structs: the content of a scene file with defaults filled in. Lengths are
// in scene units, angles in degrees, colours scene-linear. scene/describe.h gives each member's
// key, range and meaning. Comments that begin with an enumerator ("kMedial: ...") say which choice
// uses the member. "The report" is J. Gilbert's Real Time Morphing of Polyhedra (Sheffield, 2010).
//
// An actor morphs along a chain of objects: a source, intermediate objects and a target. Each step
// from one object to the next is a leg. Spheres fill an object; balls, the sources of a field, are
// fitted to the object or taken from its spheres. The plan of a leg pairs the balls of its two
// objects, and its motion moves the paired balls.
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

/// Method that fills a model with spheres.
enum class SphereMethod : std::uint8_t {
  kOctree,   ///< one sphere per inside cell of the finest octree level (report 5.1.2.2)
  kActive,   ///< the largest octree cells that are mostly inside (report 5.1.3.2)
  kHubbard,  ///< Voronoi balls of surface samples, merged (Hubbard 1996)
  kMedial,   ///< a greedy cover by medial balls
};
/// Test of whether a point is inside a model.
enum class InsideMethod : std::uint8_t {
  kWinding,  ///< generalized winding number, which takes open meshes, too
  kParity,   ///< parity of the number of faces that a ray from the point crosses
};
/// Origin of an object's balls. Only Gaussian balls are fitted (is_fitted()).
enum class FitKind : std::uint8_t {
  kNone,       ///< balls taken from the spheres, as in the report
  kRound,      ///< fitted balls that stay round
  kEllipsoid,  ///< fitted balls that may stretch
};

struct SphereSettings {
  SphereMethod method = SphereMethod::kMedial;
  int balls = 256;  ///< kHubbard, kMedial: number of balls
  float error = 0;  ///< kMedial: maximum Hausdorff distance, a fraction of the model's diagonal,
                    ///< reached with the fewest balls; 0: use `balls`
  /// kOctree, kActive: R in 1..9, for 2^(R-1) cells per axis. 0 = the finest one with at most 8000
  /// spheres or, with a fit, at most `balls`.
  int resolution = 0;
  float root_margin = 0;  ///< kOctree, kActive: (root cube's edge) / (model's longest side) - 1
  FitKind fit = FitKind::kEllipsoid;
  InsideMethod inside = InsideMethod::kWinding;
  bool solidify = false;  ///< fill cavities and close holes first
  bool coarse = false;    ///< fit to few samples in few steps; set by previews, has no key
};

/// Progress of a ball along its path as a function of time.
enum class Easing : std::uint8_t { kLinear, kSmoothstep, kQuintic, kBezier, kSpring };
/// Field whose level set is the surface between two objects.
enum class Interpolation : std::uint8_t {
  kDistance,  ///< both objects' signed distances, pulled back along one smooth map and mixed
  kBalls,     ///< the field of the moving balls
};
/// Path of a ball.
enum class Path : std::uint8_t {
  kAuto,      ///< kParts if the plan has limbs, else kRigid
  kStraight,  ///< a line
  kBezier,    ///< an arc
  kRigid,     ///< the rotation and growth that lay one object on the other
  kParts,     ///< kRigid limb by limb, with neighbouring balls held together
  kExplode,   ///< thrown out of the first object and, backwards, into the second
};
/// Order in which balls start to move.
enum class Stagger : std::uint8_t {
  kNone,    ///< all at once
  kAxis,    ///< along MotionSettings::stagger_axis
  kRadius,  ///< small balls first
  kLabel,   ///< label by label
  kNoise,   ///< randomly
};

/// A damped spring (report Eq. 3.4); the unit of time is the motion's duration.
struct SpringSettings {
  float mass = 1;
  float stiffness = 120;
  float damping = 14;
  float lag = 0.5f;  ///< a ball's mass is mass * (its volume / mean volume of a ball)^lag
};

struct MotionSettings {
  Interpolation interpolate = Interpolation::kDistance;
  Path path = Path::kAuto;
  float bend = 0.25f;  ///< kBezier: height of the arc / RMS length of all paths
  float burst = 4;     ///< kExplode: initial speed, in object sizes per motion
  float gravity = 1;   ///< kExplode: factor; at 1 a ball comes down within the motion
  Easing easing = Easing::kSmoothstep;
  std::vector<float> bezier{0.42f, 0.0f, 0.58f, 1.0f};  ///< inner control points: x1, y1, x2, y2
  SpringSettings spring;
  Stagger stagger = Stagger::kNone;
  float stagger_share = 0.4f;  ///< (last start - first start) / duration of the motion
  Vec3 stagger_axis{0, 1, 0};  ///< kAxis: balls start in the order of their positions along it
  std::uint64_t seed = 0;      ///< random seed of Stagger::kNoise and Path::kExplode
  /// Move the level so that at progress u the surface encloses the volume (1-u) V_A + u V_B of the
  /// objects' volumes V_A and V_B.
  bool keep_volume = true;
};

/// Axis of a model's file that points up.
enum class UpAxis : std::uint8_t { kY, kZ, kX };

/// Direction in a model's file that its front faces. kAuto: found by mirror symmetry, if at all
/// (morph/facing.h).
enum class Front : std::uint8_t { kAuto, kPlusX, kMinusX, kPlusY, kMinusY, kPlusZ, kMinusZ };

struct ObjectSettings {
  std::string name;             ///< default: the file's stem or the shape's name
  std::filesystem::path model;  ///< absolute; empty when `shape` is given
  /// Numbers of a mesh sequence's files (scene/mesh_numbers.h): first, last and, unless it is 1,
  /// the step. Empty for every other object.
  std::vector<int> range;
  std::optional<float> fps;  ///< meshes per second; empty: the scene's frames.fps
  std::optional<bool> loop;  ///< restart after the last mesh; empty: false
  std::string shape;         ///< built-in shape; empty when `model` is given
  UpAxis up = UpAxis::kY;    ///< rotated to y before every other transform
  Front front = Front::kAuto;
  bool meta = false;    ///< shown as balls only, never as the model
  bool arrange = true;  ///< Scene::arrange applies to it
  Vec3 translate;
  Vec3 rotate;  ///< degrees about x, then y, then z
  Vec3 scale{1, 1, 1};
  std::optional<Vec3> color;                        ///< replaces the model's colours and textures
  std::optional<float> roughness, metallic, glass;  ///< override the values of all its materials
  /// Edges whose faces meet at more than this angle, in degrees, are shown sharp. If given, it
  /// replaces the file's normals; else kCreaseDegrees applies to files without normals.
  std::optional<float> crease;
  SphereSettings spheres;
  MotionSettings motion;  ///< motion of the leg that ends at this object
  int hold = 0;  ///< extra frames that it stands still between its legs, or on its last mesh
  /// Fraction of the motion to this object after which the morph goes on to the next one; 1: this
  /// object is reached.
  float retarget = 1;
  std::optional<float> weight;  ///< weight in its actor's blend; empty in a chain
};

/// Names of the built-in shapes (model/shapes.h).
inline const std::vector<std::string> kShapeNames{"sphere", "cube", "torus", "puddle", "drops"};
/// Tests whether `name` is one of kShapeNames.
inline bool is_shape_name(std::string_view name) {
  return std::find(kShapeNames.begin(), kShapeNames.end(), name) != kShapeNames.end();
}

/// Placement of the objects, which their own scale and translation follow.
enum class Arrange : std::uint8_t {
  kStand,  ///< each object gets the first source's size, stands on y = 0, centred on the y axis
  kNone,   ///< coordinates as in the files
};

struct FieldSettings {
  FieldKind kind = FieldKind::kGaussian;
  float blobbiness = 0;  ///< |B| of Blinn 1982, for balls without a fit; 0 = a default per method
  bool even = true;      ///< kOctree, kActive: strengths that equalize the field at all centres
  float blob_constant = 1.0f;  ///< the report's blobConstant; inverse-square only
  float magnitude = 1.0f;    ///< the report's metaball magnitude; a ball has strength magnitude R^2
  float threshold = 1.0f;    ///< the report's threshold
  bool match_volume = true;  ///< choose the level so that each model's surface encloses its volume
};

/// Assignment of balls to balls.
enum class PlanMethod : std::uint8_t {
  kIndex,      ///< pairs in list order, surplus balls with random ones (report 5.2.7)
  kNearest,    ///< pairs each ball of either object with the cheapest ball of the other
  kTransport,  ///< optimal transport of the balls' masses: balls split and merge
};

/// Transform that lays one object on the other before balls are paired.
enum class AlignMethod : std::uint8_t {
  kNone,        ///< costs and paths use the objects' own placement
  kTranslate,   ///< aligns the centres of mass
  kRigid,       ///< kTranslate with the best rotation
  kSimilarity,  ///< kRigid with the best scale
};

/// Use of labels, the names of the models' face groups.
enum class LabelMode : std::uint8_t {
  kOff,   ///< ignores labels
  kSoft,  ///< adds PlanWeights::label to the cost of pairing different labels
  kHard,  ///< pairs no different labels
};

/// A named point of an object in its file's coordinates, before any transform.
struct LandmarkPoint {
  std::optional<Vec3> point;  ///< if empty, `vertex` gives the position
  long long vertex = 0;       ///< number of a vertex in the file, from 1; 0 if `point` is given
  /// Position in the scene file, for messages; 0 if it came from the command line.
  int line = 0, column = 0;
  std::string pointer;  ///< JSON pointer of the landmark: "/plan/landmarks/elk.obj/nose"
};
/// Landmarks of an object by name. Neighbours in a chain correspond at landmarks of equal names.
using ObjectLandmarks = std::map<std::string, LandmarkPoint>;
/// Landmarks by object. The key is its file's name or stem, or its name in the scene.
using LandmarkSettings = std::map<std::string, ObjectLandmarks>;
inline constexpr std::size_t kMaxLandmarks = 64;  ///< per object

/// Constants of the plan's cost and alignment, calibrated together. They have no keys.
struct PlanWeights {
  float align_gain = 0.5f;  ///< a rotation is kept only if it lowers the cost by this fraction
  /// A rotation about an axis that is not vertical is kept only if (mean squared distance of paired
  /// balls) / (their mean squared radius) is at most this. Copies of an object are below 0.15. 0
  /// keeps none.
  float align_tip_residual = 0.15f;
  /// Weights of the cost's terms beside the squared distance in unit-RMS coordinates.
  float size = 0.1f;      ///< (ln R / R')^2
  float feature = 0.3f;   ///< squared difference of the features (morph/cost.h)
  float landmark = 1.0f;  ///< squared difference of the distances to each landmark
  float label = 1.0f;     ///< 1 if the labels differ, with LabelMode::kSoft
};

/// Use of limbs in a plan. kAuto pairs each limb with its counterpart if both objects' limbs match
/// for certain.
enum class PlanStructure : std::uint8_t { kOff, kAuto };

struct PlanSettings {
  PlanMethod method = PlanMethod::kTransport;
  std::uint64_t seed = 0;  ///< PlanMethod::kIndex: random seed of surplus balls
  AlignMethod align = AlignMethod::kSimilarity;
  PlanWeights weights;
  LabelMode label_mode = LabelMode::kSoft;
  PlanStructure structure = PlanStructure::kAuto;
  /// Maps a label of one object, "object.label" or "label", to one of another. Equal names
  /// correspond without an entry.
  std::map<std::string, std::string> labels;
  LandmarkSettings landmarks;
};

/// Change between a model and its balls at the ends of a leg.
enum class BoundaryMethod : std::uint8_t {
  kProject,    ///< the mesh moves onto the balls' surface; kBlend if under 98 % of it arrives there
  kBlend,      ///< one solid interpolated between the model and the balls
  kCrossfade,  ///< the model shrinks while the balls grow, as in the report
  kCut,        ///< a hard cut
};

struct BoundarySettings {
  BoundaryMethod method = BoundaryMethod::kProject;
  /// Fractions of a leg's time, at each end that shows a model.
  float look_share = 0.12f;      ///< fade between the model's materials and Scene::look
  float boundary_share = 0.13f;  ///< change between model and balls
};

struct FrameSettings {
  int count = 0;             ///< frames in all, holds included; 0 = as many as the actors need
  std::vector<int> per_leg;  ///< frames of each leg of actors without their own; overrides count
  float fps = 24;
  int hold_start = 0;  ///< extra still frames at the start
  int hold_end = 0;    ///< extra still frames at the end
  /// Above 0: number of frames in which the camera turns once around frame `still`; these frames
  /// replace the film. 0: the film.
  int turntable = 0;
  int still = 1;  ///< number of a frame of the film, from 1
};

struct SurfaceSettings {
  int resolution = 128;  ///< cells along the longest side of an actor's box
  SurfaceMethod method = SurfaceMethod::kMarchingCubes;
  Placement placement = Placement::kRoot;  ///< position of vertices on grid edges
  bool flat = false;                       ///< triangles without shared normals
  int influence = 1;  ///< spacing in cells of the points at which the field is computed
  /// Components of the surface below this fraction of the volume are removed; 0 keeps all.
  float min_component_share = 1e-4f;
};

struct CameraSettings {
  std::optional<Vec3> position;  ///< default: by azimuth, elevation and framing
  std::optional<Vec3> target;    ///< default: middle of the scene's box
  Vec3 up{0, 1, 0};
  float fov = 30;        ///< vertical, degrees
  float azimuth = 28;    ///< degrees from +z towards +x
  float elevation = 16;  ///< degrees above the horizon
  float orbit = 0;       ///< degrees around the target during the film
  float dolly = 1;       ///< factor on the distance from the target
  float margin = 0.05f;  ///< automatic framing: free border per side, a fraction of the picture
  float aperture = 0;    ///< diameter of the lens; 0 = a pinhole
  std::optional<float> focus;  ///< distance along the view axis; default: that of the target
  float shutter = 0;           ///< open time in frames, centred on the frame's time
};

/// Built-in sky, for scenes without an environment image.
enum class SkyKind : std::uint8_t {
  kStudio,  ///< soft boxes around the objects; the camera sees a seamless backdrop
  kDay,     ///< clear sky whose sun is the key light
};

enum class LampKind : std::uint8_t {
  kLamp,   ///< a glowing sphere or a point
  kPanel,  ///< a rectangle that emits towards its target
  kSun,    ///< a disc at infinity, like the key light
};

/// A light in addition to the key light and the sky. The camera sees it only in mirrors.
struct LampSettings {
  LampKind kind = LampKind::kLamp;
  Vec3 position{1, 2, 2};       ///< kLamp, kPanel
  std::optional<Vec3> target;   ///< kLamp, kPanel; default: the middle of all objects
  float radius = 0.1f;          ///< kLamp; 0 = a point
  float width = 1, height = 1;  ///< kPanel
  float azimuth = 120;          ///< kSun, like LightSettings::key_azimuth
  float elevation = 30;         ///< kSun
  float size = 1;               ///< kSun: apparent diameter in degrees
  float intensity = 1;          ///< irradiance on a surface at the target that faces it
  Vec3 color{1, 1, 1};
};

inline constexpr std::size_t kMaxLamps = 16;

struct LightSettings {
  float key_azimuth = -40;     ///< degrees from +z towards +x, relative to the camera's azimuth
  float key_elevation = 48;    ///< degrees above the horizon
  float key_size = 12;         ///< apparent diameter in degrees; 0 = hard shadow
  float key_intensity = 2.4f;  ///< irradiance on a surface that faces the light
  Vec3 key_color{1.0f, 0.96f, 0.90f};
  std::filesystem::path environment;  ///< lat-long image; empty = a built-in sky
  SkyKind sky = SkyKind::kStudio;
  float turbidity = 3;         ///< kDay: 2 very clear .. 10 hazy
  float sky_intensity = 1.0f;  ///< factor on the environment or the sky
  bool follow_camera = false;  ///< azimuths are relative to each frame's camera, not the first's
  std::vector<LampSettings> lamps;
};

struct GroundSettings {
  bool enabled = true;          ///< the scene has a floor
  std::optional<float> height;  ///< default: just below everything
  Vec3 color{0.42f, 0.42f, 0.44f};
  bool shadow_only = false;  ///< the picture shows only the shadows on the floor, in alpha
  /// Between two objects whose lowest points are equally high, move the surface up or down so that
  /// its lowest point stays at this height.
  bool contact = true;
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
  float roughness = 0.12f;  ///< kMetal, kGlass; 0 = a mirror
  float ior = 1.5f;         ///< kGlass: refractive index
};

struct ImageSettings {
  int width = 640;
  int height = 480;
  int samples = 16;  ///< per pixel; with `noise`, the maximum
  float noise = 0;  ///< above 0: limit of a pixel's error / sqrt(its brightness); 0: `samples` each
  /// Surfaces at which a path may scatter, not counting the first two sharp mirrors and glass
  /// (render/path/path.h); 0: no paths.
  int max_depth = 4;
  std::uint64_t seed = 0;
  bool steady = true;        ///< still objects have the same noise in every frame
  bool denoise = false;      ///< use Open Image Denoise if it is found
  bool smooth = false;       ///< smooth the noise of few samples (render/film/smooth.h)
  float exposure = 0;        ///< stops; not applied to EXR, which stays linear
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
/// Tests whether image.aovs includes a layer.
inline bool includes_aov(std::string_view aovs, std::string_view layer) {
  const std::vector<std::string> chosen = split(aovs, ',');
  return aovs == "all" || std::find(chosen.begin(), chosen.end(), layer) != chosen.end();
}

struct OutputSettings {
  std::string file = "frame.####.exr";           ///< used when the command line names none
  bool png = false;                              ///< a PNG beside each EXR
  ColorSpace color_space = ColorSpace::kRec709;  ///< space of the colours in EXR files
  bool multipart = false;                        ///< an EXR has one part per layer
  int png_bits = 8;                              ///< 16, or 8 with dither
};

/// One chain of objects, its place in the scene and the frame at which it starts.
struct ActorSettings {
  std::string name;  ///< default: the source's name
  ObjectSettings source;
  std::vector<ObjectSettings> intermediate;
  ObjectSettings target;  ///< without model and shape if `source` is a sequence that plays alone
  /// Objects that are mixed by their weights, in the order of their names (scene/blends.h). They
  /// replace the chain; empty: the actor has a chain.
  std::vector<ObjectSettings> blend;
  int start = 1;             ///< first frame of its motion, not counting frames.hold_start
  std::vector<int> per_leg;  ///< frames of each leg; empty: FrameSettings::per_leg
  /// Placement in the scene: rotation and scale about the origin, then translation.
  Vec3 translate;
  Vec3 rotate;  ///< degrees about x, then y, then z
  Vec3 scale{1, 1, 1};
  PlanSettings plan;
};

/// Calls `function` with each object, including a target that the actor does not use.
template <class Function>
void for_each_object(ActorSettings& actor, const Function& function) {
  function(actor.source);
  for (ObjectSettings& object : actor.intermediate) function(object);
  function(actor.target);
  for (ObjectSettings& object : actor.blend) function(object);
}

struct Scene {
  std::filesystem::path path;  ///< path of the scene file
  int version = 1;
  std::string description;
  Arrange arrange = Arrange::kStand;
  /// Actors, at least one. A scene file with one may write its chain without a list around it.
  std::vector<ActorSettings> actors = std::vector<ActorSettings>(1);
  SphereSettings spheres;  ///< default of ObjectSettings::spheres
  FrameSettings frames;
  FieldSettings field;
  PlanSettings plan;      ///< default of ActorSettings::plan
  MotionSettings motion;  ///< default of ObjectSettings::motion
  BoundarySettings boundary;
  SurfaceSettings surface;
  CameraSettings camera;
  LightSettings lights;
  GroundSettings ground;
  LookSettings look;
  ImageSettings image;
  OutputSettings output;
  /// Keyframes of settings that change over the film (scene/keyframes.h). The settings themselves
  /// hold the first key's value.
  std::vector<KeyframeTrack> tracks;
};

/// Tests whether frames with these settings need the surface's motion.
inline bool needs_motion(const Scene& scene) {
  return scene.camera.shutter > 0 || includes_aov(scene.image.aovs, "motion") ||
         includes_aov(scene.image.aovs, "morph");
}

}  // namespace polymorph
