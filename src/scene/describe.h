// Scene file keys (reflection): the name, struct member, range and meaning of every key. Visitors
// of this description read JSON into the structs, write the JSON Schema and write a scene back. To
// add a setting, add a member in scene.h and a line here. Each function binds all members of its
// struct, so it does not compile while one is missing.
//
// A visitor `v` has one function per type of value (integer, number, choice ...). v.retired names a
// key of former versions, whose use is an error that names its successor (nullptr: there is none).
// In JSON, a struct with a constant kShort may be written as an object or as the value of its key
// kShort alone: "easing": "linear". In a keyed_object every number, vector and colour may have
// keyframes (scene/keyframes.h), unless its argument `Keyframes` says otherwise. Seeds are at most
// 2^53 - 1 = 9007199254740991, because larger integers are not exact in every JSON reader.
#pragma once

#include "scene/max_frames.h"
#include "scene/scene.h"

namespace polymorph {

/// Range of a number, both ends included.
template <class T>
struct Range {
  T low, high;
};

/// Permission of a number to have keyframes.
enum class Keyframes {
  kAsObject,  ///< if it is in a keyed_object
  kAllowed,   ///< always
  kNone,      ///< never
};

/// The JSON keys of a keyframed setting, without its list "keys".
template <class V>
void describe(V& v, KeyframeTrack& s) {
  v.choice("easing", s.easing,
           {{"smooth", KeyEasing::kSmooth},
            {"linear", KeyEasing::kLinear},
            {"smoothstep", KeyEasing::kSmoothstep},
            {"quintic", KeyEasing::kQuintic},
            {"hold", KeyEasing::kHold}},
           "The value goes from key to key along one smooth curve through all of them, in straight "
           "lines, with a gentle stop at each (smoothstep, quintic), or in jumps.");
}

/// The time of a keyframe, written beside its "value". Exactly one member is given.
struct KeyframeTime {
  std::optional<float> share, frame, leg;
};
template <class V>
void describe(V& v, KeyframeTime& s) {
  v.number("t", s.share, {0, 1}, "share of the film: 0 is its first frame, 1 its last");
  v.number("frame", s.frame, {1, 1e5}, "number of a frame");
  v.number("leg", s.leg, {1, 1e5},
           "leg of the first actor: 1 is the start of its first leg, 1.5 the middle, 2 its end");
}

template <class V>
void describe(V& v, SphereSettings& s) {
  [[maybe_unused]] auto& [method, balls, error, resolution, root_margin, fit, inside, solidify,
                          coarse] = s;  // some members have their keys in ReportKeys
  v.choice("method", method,
           {{"medial", SphereMethod::kMedial},
            {"hubbard", SphereMethod::kHubbard},
            {"octree", SphereMethod::kOctree},
            {"active", SphereMethod::kActive}},
           "filling of the model: a cover by medial balls; merged Voronoi balls; the report's "
           "octree (every finest cell); or its active nodes (the largest cells with more than 4 "
           "corners inside)");
  v.integer("balls", balls, {1, 4096}, "number of balls of medial and hubbard");
  v.number("error", error, {0, 0.5},
           "medial: the fewest balls whose surface keeps this Hausdorff distance, as a share of "
           "the model's diagonal, instead of `balls`; 0: off");
  v.integer(
      "resolution", resolution, {0, 9},
      "R of octree and active: 2^(R-1) cells along an axis at the finest level; 0: the finest "
      "with at most 8000 spheres, with a fit at most `balls`");
  v.retired("root_margin", "report.root_margin");
  v.choice(
      "fit", fit,
      {{"ellipsoid", FitKind::kEllipsoid}, {"round", FitKind::kRound}, {"none", FitKind::kNone}},
      "Gaussian field: fit the balls so that their surface is the model, free to stretch or "
      "round; or take them from the spheres as the report does (then field.blobbiness counts)");
  v.retired("inside", "report.inside");
  v.boolean("solidify", solidify,
            "first fill the cavities and close the holes of the model: for thin shells and open "
            "meshes");
  v.retired("coarse", "the option --preview");
}

template <class V>
void describe(V& v, ObjectSettings& s) {
  auto& [name, model, range, fps, loop, shape, up, front, meta, arrange, translate, rotate, scale,
         color, roughness, metallic, glass, crease, spheres, motion, hold, retarget, weight] = s;
  v.text("name", name, "name in messages and reports; default: the file's stem or the shape");
  v.model_path(
      "model", model,
      "an OBJ, glTF, FBX, PLY, STL, DAE, OFF or 3DS file, relative to the scene file; or "
      "a mesh sequence, seq.####.ply: it plays alone as a source without a target, and goes "
      "on through a morph");
  v.integers("range", range, {0, 100000000},
             "mesh sequence: first and last number of its files, last first to play it backwards, "
             "and the step between two where it is not 1; default: the files that are there");
  v.number(
      "fps", fps, {0.001, 1000},
      "mesh sequence: meshes per second; default: frames.fps, a mesh per frame; of an animated "
      "model its own rate");
  v.boolean("loop", loop, "mesh sequence: begin again after the last mesh, until the scene ends");
  v.text("shape", shape,
         "a built-in shape instead of a file: sphere, cube, torus, puddle or drops");
  v.choice("up", up, {{"y", UpAxis::kY}, {"z", UpAxis::kZ}, {"x", UpAxis::kX}},
           "axis of the model's file that points up");
  v.choice("front", front,
           {{"auto", Front::kAuto},
            {"+x", Front::kPlusX},
            {"-x", Front::kMinusX},
            {"+y", Front::kPlusY},
            {"-y", Front::kMinusY},
            {"+z", Front::kPlusZ},
            {"-z", Front::kMinusZ}},
           "direction of the model's file in which its front looks; between two objects whose "
           "fronts are known the morph turns by the angle between these; auto: by their mirror "
           "planes, where they have one");
  v.boolean("meta", meta, "pass through the object as balls only, never showing the model itself");
  v.boolean("arrange", arrange, "take part in the scene's \"arrange\"");
  v.vector("translate", translate, "shift, in scene units, after everything else");
  v.vector("rotate", rotate, "degrees about x, then y, then z");
  v.scale("scale", scale, "one factor, or one per axis");
  v.color("color", color, "paint the whole object in this colour instead of its materials");
  v.number("roughness", roughness, {0, 1}, "roughness of all its materials, 0 is a mirror");
  v.number("metallic", metallic, {0, 1}, "metalness of all its materials, 1 is metal");
  v.number("glass", glass, {0, 1}, "share of the light that goes through, for all its materials");
  v.number("crease", crease, {0, 180},
           "degrees: edges whose faces meet at more are shown sharp, others smooth, whatever "
           "normals the file has; default: the file's normals, and 50 where it has none");
  v.object("spheres", spheres, "sphere settings of this object; default: the scene's");
  v.object("motion", motion, "motion of the balls towards this object; default: the scene's");
  v.integer("hold", hold, {0, 10000},
            "frames that an object on the way stands still, the one that shows it not counted; or "
            "that the last mesh of a mesh sequence stays, in each round");
  v.number(
      "retarget", retarget, {0.01, 1},
      "share of the motion's time after which the actor leaves for the next object, from where "
      "its balls are, for an object on the way; 1: it is reached");
  v.number("weight", weight, {0, 1e6},
           "blend: share of this object, over the sum of all weights; may have keyframes",
           Keyframes::kAllowed);
}

template <class V>
void describe(V& v, FrameSettings& s) {
  auto& [count, per_leg, fps, hold_start, hold_end, turntable, still] = s;
  v.integer("count", count, {0, kMaxFrames},
            "frames in all, holds included; 0: as many as the actors need, 24 per leg without "
            "per_leg");
  v.integers(
      "per_leg", per_leg, {1, kMaxFrames},
      "frames of each leg (object to next object) of every actor without its own; instead of "
      "count");
  v.number("fps", fps, {0.1, 1000}, "frames per second, for GIF and movie and the EXR header");
  v.integer("hold_start", hold_start, {0, 10000}, "extra frames that stand still at the start");
  v.integer("hold_end", hold_end, {0, 10000}, "extra frames that stand still at the end");
  v.integer("turntable", turntable, {0, kMaxFrames},
            "instead of the film: a turn of the camera around its frame `still`, in so many "
            "frames; 0: the film");
  v.integer("still", still, {1, kMaxFrames}, "turntable: the frame that is turned");
}

template <class V>
void describe(V& v, FieldSettings& s) {
  [[maybe_unused]] auto& [kind, blobbiness, even, blob_constant, magnitude, threshold,
                          match_volume] = s;  // some members have their keys in ReportKeys
  v.choice("kind", kind,
           {{"gaussian", FieldKind::kGaussian},
            {"wyvill", FieldKind::kWyvill},
            {"inverse_square", FieldKind::kInverseSquare}},
           "contribution of a ball to the field: Blinn's Gaussian, Wyvill's soft object or k r^2 / "
           "d^2");
  v.number(
      "blobbiness", blobbiness, {0, 50},
      "gaussian without a fit: |B|; small melts balls together, large keeps them apart; 0: 0.12 "
      "for octree and active, 6 for hubbard and medial");
  v.retired("even", "report.even");
  v.retired("blob_constant", "report.blob_constant");
  v.retired("magnitude", "report.magnitude");
  v.retired("threshold", "report.threshold");
  v.boolean("match_volume", match_volume,
            "shift the level so that the surface encloses the model's volume at both ends");
}

template <class V>
void describe(V& v, PlanSettings& s) {
  [[maybe_unused]] auto& [method, seed, align, weights, label_mode, structure, labels, landmarks] =
      s;  // `weights` has no keys
  v.choice("method", method,
           {{"index", PlanMethod::kIndex},
            {"nearest", PlanMethod::kNearest},
            {"transport", PlanMethod::kTransport}},
           "assignment of balls: in list order with surplus balls paired at random, every "
           "ball with the cheapest one, or optimal transport of the volume");
  v.integer("seed", seed, {0, 9007199254740991}, "random seed of the plan");
  v.choice("align", align,
           {{"none", AlignMethod::kNone},
            {"translate", AlignMethod::kTranslate},
            {"rigid", AlignMethod::kRigid},
            {"similarity", AlignMethod::kSimilarity}},
           "transform that lays the objects upon each other before balls are paired");
  for (const char* key : {"align_gain", "align_tip_residual", "size_weight", "feature_weight",
                          "landmark_weight", "label_weight"})
    v.retired(key, nullptr);
  v.choice("label_mode", label_mode,
           {{"off", LabelMode::kOff}, {"soft", LabelMode::kSoft}, {"hard", LabelMode::kHard}},
           "meaning of the models' face groups: nothing, a cost for leaving one's label, or no "
           "ball leaves its label");
  v.choice("structure", structure, {{"off", PlanStructure::kOff}, {"auto", PlanStructure::kAuto}},
           "use of limbs: none, or each becomes its counterpart where both objects' limbs match "
           "for certain; labels and landmarks go first");
  v.text_map("labels", labels,
             "group that each group becomes, {\"teapot.spout\": \"penguin.beak\"}; groups of the "
             "same name belong together");
  v.landmarks("landmarks", landmarks,
              "points that become each other exactly, {\"elk.obj\": {\"nose\": [x, y, z], "
              "\"left_hand\": \"v1234\"}, \"spot.obj\": {\"nose\": ...}}: by an object's "
              "file or name, in its file's own coordinates or by the number of a vertex, from 1");
}

/// The path of the balls, and the parameters of each kind of path.
struct PathKeys {
  static constexpr const char* kShort = "kind";
  Path& kind;
  float &bend, &burst, &gravity;
};
template <class V>
void describe(V& v, PathKeys& s) {
  v.choice("kind", s.kind,
           {{"auto", Path::kAuto},
            {"straight", Path::kStraight},
            {"bezier", Path::kBezier},
            {"rigid", Path::kRigid},
            {"parts", Path::kParts},
            {"explode", Path::kExplode}},
           "path of a ball: parts where limbs become each other and else rigid, a line, an arc, "
           "the rotation and growth that lays one object on the other, the same part by part with "
           "neighbours held together, or a throw out of the one and, backwards, into the other");
  v.number("bend", s.bend, {-2, 2},
           "bezier: height of the arc that the paths follow, as a share of their length");
  v.number("burst", s.burst, {0, 100}, "explode: speed, in the objects' sizes per motion");
  v.number("gravity", s.gravity, {0, 100}, "explode: 1 brings balls down within the motion");
}

/// The easing of a leg's motion, and the parameters of each kind of easing.
struct EasingKeys {
  static constexpr const char* kShort = "kind";
  Easing& kind;
  std::vector<float>& bezier;
  SpringSettings& spring;
};
template <class V>
void describe(V& v, EasingKeys& s) {
  v.choice("kind", s.kind,
           {{"linear", Easing::kLinear},
            {"smoothstep", Easing::kSmoothstep},
            {"quintic", Easing::kQuintic},
            {"bezier", Easing::kBezier},
            {"spring", Easing::kSpring}},
           "course of time along a leg's motion");
  v.numbers("bezier", s.bezier, {{0, 1}, {-2, 3}, {0, 1}, {-2, 3}},
            "bezier: x1, y1, x2, y2 of the curve's inner points");
  auto& [mass, stiffness, damping, lag] = s.spring;
  v.number("mass", mass, {1e-3, 1e3}, "spring: mass of a ball of mean volume");
  v.number("stiffness", stiffness, {1e-2, 1e5},
           "spring: force per displacement; the motion lasts one unit of time");
  v.number("damping", damping, {0, 1e4},
           "spring: force per speed; critical at 2 sqrt(mass stiffness)");
  v.number("lag", lag, {0, 1},
           "spring: exponent by which big balls have more mass than small ones");
}

/// The order in which balls start.
struct StaggerKeys {
  static constexpr const char* kShort = "kind";
  Stagger& kind;
  float& share;
  Vec3& axis;
};
template <class V>
void describe(V& v, StaggerKeys& s) {
  v.choice("kind", s.kind,
           {{"none", Stagger::kNone},
            {"axis", Stagger::kAxis},
            {"radius", Stagger::kRadius},
            {"label", Stagger::kLabel},
            {"noise", Stagger::kNoise}},
           "balls that start later: none, those further along `axis`, the bigger ones, label by "
           "label, or at random");
  v.number("share", s.share, {0, 0.9},
           "share of the motion's time between the first start and the last");
  v.vector("axis", s.axis, "axis: direction in which the last balls lie");
}

template <class V>
void describe(V& v, MotionSettings& s) {
  auto& [interpolate, path, bend, burst, gravity, easing, bezier, spring, stagger, stagger_share,
         stagger_axis, seed, keep_volume] = s;
  PathKeys path_keys{path, bend, burst, gravity};
  EasingKeys easing_keys{easing, bezier, spring};
  StaggerKeys stagger_keys{stagger, stagger_share, stagger_axis};
  v.choice("interpolate", interpolate,
           {{"distance", Interpolation::kDistance}, {"balls", Interpolation::kBalls}},
           "source of the surface between two objects: their signed distances, carried along "
           "a smooth map and mixed, or the field of the moving balls (always so on the path "
           "explode, to and from the shape drops, and in fields that are not gaussian)");
  v.object("path", path_keys, "path of the balls; its kind alone may stand for it");
  v.retired("bend", "motion.path.bend");
  v.retired("burst", "motion.path.burst");
  v.retired("gravity", "motion.path.gravity");
  v.retired("soften", nullptr);
  v.object("easing", easing_keys, "course of time; its kind alone may stand for it");
  v.retired("bezier", "motion.easing.bezier");
  v.retired("spring", "motion.easing");
  v.object("stagger", stagger_keys, "order of starting; its kind alone may stand for it");
  v.retired("stagger_share", "motion.stagger.share");
  v.retired("stagger_axis", "motion.stagger.axis");
  v.integer("seed", seed, {0, 9007199254740991}, "random seed of the motion");
  v.boolean("keep_volume", keep_volume,
            "shift the level of every frame so that the volume goes evenly from one object's to "
            "the next's");
}

template <class V>
void describe(V& v, BoundarySettings& s) {
  auto& [method, look_share, boundary_share] = s;
  v.choice(
      "method", method,
      {{"project", BoundaryMethod::kProject},
       {"blend", BoundaryMethod::kBlend},
       {"crossfade", BoundaryMethod::kCrossfade},
       {"cut", BoundaryMethod::kCut}},
      "model to balls: the model's own mesh moves onto their surface (or, where under 98 % of it "
      "arrives, blend), one solid between both, the report's crossfade, or a hard cut");
  v.number("look_share", look_share, {0, 0.4},
           "share of a leg's time at each full end in which the model fades to the common look");
  v.number("boundary_share", boundary_share, {0, 0.4},
           "share of a leg's time at each full end in which the model becomes balls");
}

template <class V>
void describe(V& v, SurfaceSettings& s) {
  // Some members have their keys in ReportKeys.
  [[maybe_unused]] auto& [resolution, method, placement, flat, influence, min_component_share] = s;
  v.integer("resolution", resolution, {8, 4096},
            "cells of the marching cubes along the longest side of an actor's box");
  v.retired("method", "report.surface");
  v.retired("placement", "report.placement");
  v.retired("flat", "report.flat");
  v.retired("influence", "report.influence");
  v.retired("crumbs", "surface.min_component_share");
  v.number("min_component_share", min_component_share, {0, 0.1},
           "separate components below this share of the volume are left out of moving surfaces; 0 "
           "keeps all");
}

/// Settings that reproduce the report (scene/scene.h); polymorph's defaults differ from it.
struct ReportKeys {
  SphereSettings& spheres;
  FieldSettings& field;
  SurfaceSettings& surface;
};
template <class V>
void describe(V& v, ReportKeys& s) {
  v.number("root_margin", s.spheres.root_margin, {0, 1},
           "spheres octree and active: excess of the root cube over the model's longest side, as "
           "a share of it; the report's counts of spheres come nearest with 0.092");
  v.choice("inside", s.spheres.inside,
           {{"winding", InsideMethod::kWinding}, {"parity", InsideMethod::kParity}},
           "inside test: generalized winding number (takes open meshes), or the parity of one ray");
  v.boolean(
      "even", s.field.even,
      "field gaussian, spheres octree and active without a fit: strengths such that the field "
      "is alike at all centres, so that thin parts stay");
  v.number("blob_constant", s.field.blob_constant, {1e-6, 1e6},
           "field inverse_square: factor of every ball");
  v.number("magnitude", s.field.magnitude, {1e-6, 1e6},
           "field inverse_square: strength of a ball, times its radius squared");
  v.number("threshold", s.field.threshold, {1e-6, 1e6},
           "field inverse_square: field value at the surface");
  v.choice("surface", s.surface.method,
           {{"marching_cubes", SurfaceMethod::kMarchingCubes}, {"matrix", SurfaceMethod::kMatrix}},
           "drawing: the surface by marching cubes, or a cube at each grid point inside");
  v.choice("placement", s.surface.placement,
           {{"root", Placement::kRoot}, {"midpoint", Placement::kMidpoint}},
           "position of vertices on grid edges: at the field's level, or half way");
  v.boolean("flat", s.surface.flat, "every triangle has its own normal");
  v.integer("influence", s.surface.influence, {1, 16},
            "cells between the points at which the field is computed; it is interpolated between");
}

template <class V>
void describe(V& v, CameraSettings& s) {
  auto& [position, target, up, fov, azimuth, elevation, orbit, dolly, margin, aperture, focus,
         shutter] = s;
  v.vector("position", position,
           "place of the camera; default: placed by azimuth, elevation and framing");
  v.vector("target", target, "point that it looks at; default: the middle of all objects");
  v.vector("up", up, "direction that is up in the picture");
  v.number("fov", fov, {1, 150}, "vertical field of view, degrees");
  v.number("azimuth", azimuth, {-360, 360}, "degrees from +z towards +x");
  v.number("elevation", elevation, {-89, 89}, "degrees above the horizon");
  v.number("orbit", orbit, {-36000, 36000},
           "degrees that the camera goes round its target during the film, evenly; whole "
           "turns close without a seam",
           Keyframes::kNone);
  v.number("dolly", dolly, {0.01, 100},
           "factor on the distance from the target: below 1 is nearer than framing or `position` "
           "puts the camera");
  v.number("margin", margin, {0, 0.45},
           "free border on each side when framing automatically, as a share of the picture");
  v.number("aperture", aperture, {0, 1e6},
           "diameter of the lens in scene units: things out of focus blur; 0: all is sharp");
  v.number("focus", focus, {1e-6, 1e6},
           "distance that is sharp, along the view axis; default: that of the middle of all "
           "objects, or of `target`");
  v.number("shutter", shutter, {0, 4},
           "motion blur: how many frames long the shutter is open, around the frame's moment; 0.5 "
           "is a film camera's");
}

template <class V>
void describe(V& v, LampSettings& s) {
  auto& [kind, position, target, radius, width, height, azimuth, elevation, size, intensity,
         color] = s;
  v.choice(
      "kind", kind,
      {{"lamp", LampKind::kLamp}, {"panel", LampKind::kPanel}, {"sun", LampKind::kSun}},
      "a glowing ball or point, a rectangle that glows towards its target, or a disc far away");
  v.vector("position", position, "lamp, panel: place of its middle");
  v.vector("target", target,
           "lamp, panel: where `intensity` holds, and what a panel faces; default: the middle of "
           "all objects");
  v.number("radius", radius, {0, 1e6}, "lamp: 0 is a point, with hard shadows");
  v.number("width", width, {1e-6, 1e6}, "panel: width in scene units");
  v.number("height", height, {1e-6, 1e6}, "panel: height in scene units");
  v.number("azimuth", azimuth, {-360, 360}, "sun: degrees from the camera's azimuth");
  v.number("elevation", elevation, {-10, 90}, "sun: degrees above the horizon");
  v.number("size", size, {0, 60}, "sun: apparent diameter in degrees");
  v.number("intensity", intensity, {0, 1000},
           "irradiance it gives a surface at its target that faces it");
  v.color("color", color, "colour of its light");
}

template <class V>
void describe(V& v, LightSettings& s) {
  auto& [key_azimuth, key_elevation, key_size, key_intensity, key_color, environment, sky,
         turbidity, sky_intensity, follow_camera, lamps] = s;
  v.number("key_azimuth", key_azimuth, {-360, 360},
           "bearing of the key light, degrees from the camera's azimuth");
  v.number("key_elevation", key_elevation, {-10, 90}, "degrees above the horizon");
  v.number("key_size", key_size, {0, 60},
           "apparent diameter in degrees; larger is softer, 0 is a hard shadow");
  v.number("key_intensity", key_intensity, {0, 1000},
           "irradiance the key light gives a surface facing it");
  v.color("key_color", key_color, "colour of the key light");
  v.path("environment", environment,
         "lat-long image (EXR, HDR, PNG, JPEG, TIFF); default: the built-in `sky`");
  v.choice("sky", sky, {{"studio", SkyKind::kStudio}, {"day", SkyKind::kDay}},
           "built-in: soft boxes in a studio, or a clear sky whose sun is the key light");
  v.number("turbidity", turbidity, {2, 10}, "sky day: 2 is very clear, 10 hazy");
  v.number("sky_intensity", sky_intensity, {0, 1000}, "factor on the environment or the sky");
  v.boolean("follow_camera", follow_camera,
            "the key light, suns and the studio turn with a camera that moves; else they stand as "
            "its first frame sees them");
  v.objects("lamps", lamps, "more lights, at most 16; only mirrors see them");
}

template <class V>
void describe(V& v, GroundSettings& s) {
  auto& [enabled, height, color, shadow_only, contact] = s;
  v.boolean("enabled", enabled, "a floor that catches shadows");
  v.number("height", height, {-1e6, 1e6}, "height of the floor; default: below everything");
  v.color("color", color, "colour of the floor");
  v.boolean("shadow_only", shadow_only,
            "keep only the shadows it catches, in alpha, for putting the picture on another");
  v.boolean("contact", contact,
            "contact with the floor: between two objects whose lowest points are equally high, the "
            "surface is raised or lowered so that its own stays there");
}

inline constexpr const char* kLookHelp =
    "material of the surface while it morphs: the objects' own colours and textures, carried "
    "along, or one common look that the models fade to and from";

template <class V>
void describe(V& v, LookSettings& s) {
  auto& [kind, color, roughness, ior] = s;
  v.choice("kind", kind,
           {{"own", LookKind::kOwn},
            {"metal", LookKind::kMetal},
            {"matte", LookKind::kMatte},
            {"glass", LookKind::kGlass}},
           kLookHelp);
  v.color("color", color, "colour of the common look");
  v.number("roughness", roughness, {0, 1}, "roughness of the metal or the glass: 0 is a mirror");
  v.number("ior", ior, {1, 3}, "refractive index of the glass");
}

template <class V>
void describe(V& v, ImageSettings& s) {
  auto& [width, height, samples, noise, max_depth, seed, steady, denoise, smooth, exposure,
         transparent, aovs] = s;
  v.integer("width", width, {1, 32768}, "width in pixels");
  v.integer("height", height, {1, 32768}, "height in pixels");
  v.integer("samples", samples, {1, 65536},
            "samples per pixel; with `noise`, the maximum for one pixel");
  v.number("noise", noise, {0, 1},
           "sample until a pixel's estimated error, over the root of its brightness, is below this "
           "(0.01 is clean, 0.05 a draft); 0: the same number everywhere");
  v.integer(
      "max_depth", max_depth, {0, 64},
      "longest light path, in bounces; 0: direct light from the lights' centres, and a sky that "
      "nothing hides");
  v.integer("seed", seed, {0, 9007199254740991}, "random seed of the samples");
  v.boolean("steady", steady,
            "things that stand still under a camera that stands still keep their noise from frame "
            "to frame; those that move have new noise in each");
  v.boolean("denoise", denoise,
            "clean the colours with Open Image Denoise, where it is installed (docs/films.md)");
  v.boolean("smooth", smooth,
            "smooth the noise of few samples where surfaces are even, as --preview does; edges and "
            "textures keep theirs");
  v.number("exposure", exposure, {-20, 20}, "stops, for PNG, GIF and strips; EXR stays as it is",
           Keyframes::kAllowed);
  v.boolean("transparent", transparent, "alpha 0 instead of a backdrop");
  v.text("aovs", aovs,
         "layers of an EXR beside R, G, B, A: Z, N, P, albedo, uv, motion, morph, label, id, "
         "crypto_object, crypto_material, crypto_label, separated by commas, or all, or none");
}

template <class V>
void describe(V& v, OutputSettings& s) {
  auto& [file, png, color_space, multipart, png_bits] = s;
  v.text("file", file,
         "frame file names when -o is not given, from where the program runs; #### is the frame "
         "number");
  v.boolean("png", png, "write a PNG beside each EXR");
  v.integer("png_bits", png_bits, {8, 16},
            "bits per channel of a PNG: 16, or 8 with dither against bands in soft gradients");
  v.choice("colorspace", color_space,
           {{"rec709", ColorSpace::kRec709}, {"acescg", ColorSpace::kAcesCg}},
           "space of the colours in EXR files: linear Rec. 709, in which the program computes, or "
           "ACEScg; the header says which");
  v.boolean("multipart", multipart,
            "write each layer of an EXR as a part of its own, so that readers take only those that "
            "they need: rgba of 16-bit numbers, the others of 32-bit ones");
  v.retired("dither", nullptr);
}

/// The chain of an actor; a scene with one actor may have it at the top.
template <class V>
void describe_chain(V& v, ActorSettings& s) {
  v.object("source", s.source,
           "start of the morph: an object, or just its model file or shape as a string");
  v.objects("intermediate", s.intermediate, "objects on the way, in order");
  v.object("target", s.target, "end of the morph; none where the source is a mesh sequence");
  v.objects("blend", s.blend,
            "two objects or more, each with a `weight`, mixed by them instead of following each "
            "other; the order of the list changes nothing");
}

template <class V>
void describe(V& v, ActorSettings& s) {
  auto& [name, source, intermediate, target, blend, start, per_leg, translate, rotate, scale,
         plan] = s;
  v.text("name", name, "name in messages, reports and meshes; default: the source's, or blend");
  describe_chain(v, s);
  v.integer("start", start, {1, kMaxFrames},
            "the frame from which it moves; before, it stands still (frames.hold_start comes on "
            "top)");
  v.integers("per_leg", per_leg, {1, kMaxFrames},
             "frames of each of its legs; default: the scene's, else it moves until the scene "
             "ends");
  v.vector("translate", translate, "shift in the scene, in scene units, after everything else");
  v.vector("rotate", rotate, "degrees about x, then y, then z, about the scene's origin");
  v.scale("scale", scale, "one factor, or one per axis, about the scene's origin");
  v.object("plan", plan, "assignment of balls; default: the scene's");
}

template <class V>
void describe(V& v, Scene& s) {
  auto& [path, version, description, arrange, actors, spheres, frames, field, plan, motion,
         boundary, surface, camera, lights, ground, look, image, output, tracks] = s;
  v.integer("polymorph", version, {1, 1}, "version of the scene format");
  v.text("description", description, "a line for people");
  v.object("spheres", spheres, "approximation of the models by spheres and balls");
  ReportKeys report{spheres, field, surface};
  v.object("report", report, "the report's own choices, where polymorph has others");
  v.object("motion", motion, "motion of the balls");
  v.object("plan", plan, "assignment of balls to balls");
  v.before_actors(s);  // settings of actors and objects default to the scene's
  v.actors("actors", actors,
           "several morphs in one scene, each with its own chain, place and time; instead of "
           "source, intermediate and target, or blend");
  v.choice("arrange", arrange, {{"stand", Arrange::kStand}, {"none", Arrange::kNone}},
           "stand: every object gets the first source's size, centred, standing on y = 0; none: "
           "as in the files");
  v.object("frames", frames, "number and rate of the frames");
  v.object("field", field, "the metaball field");
  v.object("boundary", boundary, "the change between model and balls");
  v.object("surface", surface, "the extracted surface");
  v.keyed_object("camera", camera, "place of the camera, its lens and shutter");
  v.keyed_object("lights", lights, "key light, sky and lamps");
  v.keyed_object("ground", ground, "the floor below the objects");
  v.keyed_object("look", look, kLookHelp);
  v.object("image", image, "size and quality of the frames");
  v.object("output", output, "files that are written");
}

}  // namespace polymorph
