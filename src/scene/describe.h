// Every key of a scene file, once: its name, its place in the structs, its range and its meaning. A
// visitor walks this description: one reads JSON into the structs, one writes the JSON Schema, one
// writes a scene back. To add a setting, add a member in scene.h and a line here.
//
// A visitor `v` offers integer, number, boolean, choice, text, text_map, path, vector, scale,
// color, integers, numbers, object, objects, actors. In a keyed_object every number, vector and
// colour may have keyframes (scene/keyframes.h) except a constant_number; a keyed_number may have
// them anywhere.
#pragma once

#include "scene/scene.h"

namespace polymorph {

/// Of a setting with keyframes, beside its list of "keys".
template <class V>
void describe(V& v, KeyframeTrack& s) {
  v.choice("easing", s.easing,
           {{"smooth", KeyEasing::kSmooth},
            {"linear", KeyEasing::kLinear},
            {"smoothstep", KeyEasing::kSmoothstep},
            {"quintic", KeyEasing::kQuintic},
            {"hold", KeyEasing::kHold}},
           "how the value goes from key to key: along one smooth curve through all of them, in "
           "straight lines, stopping gently at each (smoothstep, quintic), or in jumps");
}

/// When a key is: one of these stands beside its "value".
struct KeyMoment {
  std::optional<float> share, frame, leg;
};
template <class V>
void describe(V& v, KeyMoment& s) {
  v.number("t", s.share, 0, 1, "share of the film: 0 is its first frame, 1 its last");
  v.number("frame", s.frame, 1, 1e5, "number of a frame");
  v.number("leg", s.leg, 1, 1e5,
           "of the first actor: 1 is the start of its first leg, 1.5 the middle, 2 its end");
}

template <class V>
void describe(V& v, SphereSettings& s) {
  v.choice("method", s.method,
           {{"medial", SphereMethod::kMedial},
            {"hubbard", SphereMethod::kHubbard},
            {"octree", SphereMethod::kOctree},
            {"active", SphereMethod::kActive}},
           "how the model is filled: a cover by medial balls; merged Voronoi balls; the report's "
           "octree (every finest cell); or its active nodes (the largest cells with more than 4 "
           "corners inside)");
  v.integer("balls", s.balls, 1, 4096, "how many, for medial and hubbard");
  v.number("error", s.error, 0, 0.5,
           "medial: the fewest balls whose surface keeps this Hausdorff distance, as a share of "
           "the model's diagonal, instead of `balls`; 0: off");
  v.integer(
      "resolution", s.resolution, 0, 9,
      "R of octree and active: 2^(R-1) cells along an axis at the finest level; 0: the finest "
      "with at most 8000 spheres, with a fit at most `balls`");
  v.choice(
      "fit", s.fit,
      {{"ellipsoid", FitKind::kEllipsoid}, {"round", FitKind::kRound}, {"none", FitKind::kNone}},
      "Gaussian field: fit the balls so that their surface is the model, free to stretch or "
      "round; or take them from the spheres as the report does (then field.blobbiness counts)");
  v.choice("inside", s.inside,
           {{"winding", InsideMethod::kWinding}, {"parity", InsideMethod::kParity}},
           "inside test: generalized winding number (takes open meshes), or the parity of one ray");
  v.boolean("solidify", s.solidify,
            "first fill the cavities and close the holes of the model: for thin shells and open "
            "meshes");
}

template <class V>
void describe(V& v, ObjectSettings& s) {
  v.text("name", s.name, "name in messages and reports; default: the file's stem or the shape");
  v.model_path("model", s.model, "a Wavefront OBJ file, relative to the scene file");
  v.text("shape", s.shape,
         "a built-in shape instead of a file: sphere, cube, torus, puddle or drops");
  v.boolean("meta", s.meta,
            "pass through the object as balls only, never showing the model itself");
  v.boolean("arrange", s.arrange, "take part in the scene's \"arrange\"");
  v.vector("translate", s.translate, "shift, in scene units, after everything else");
  v.vector("rotate", s.rotate, "degrees about x, then y, then z");
  v.scale("scale", s.scale, "one factor, or one an axis");
  v.color("color", s.color, "paint the whole object in this colour instead of its materials");
  v.number("roughness", s.roughness, 0, 1, "of all its materials, 0 is a mirror");
  v.number("metallic", s.metallic, 0, 1, "of all its materials, 1 is metal");
  v.number("glass", s.glass, 0, 1, "of all its materials: the share of light that goes through");
  v.object("spheres", s.spheres, "sphere settings of this object; default: the scene's");
  v.object("motion", s.motion, "of the balls on their way to this object; default: the scene's");
  v.integer("hold", s.hold, 0, 10000,
            "frames that an object on the way stands still, the one that shows it not counted");
  v.number("retarget", s.retarget, 0.01, 1,
           "of an object on the way: the share of the motion's time after which the morph changes "
           "its mind and goes on to the next object from where the balls are; 1: it is reached");
}

template <class V>
void describe(V& v, FrameSettings& s) {
  v.integer("count", s.count, 0, 100000,
            "frames in all, holds included; 0: as many as the actors need, 24 a leg without "
            "per_leg");
  v.integers(
      "per_leg", s.per_leg, 1, 100000,
      "frames of each leg (object to next object) of every actor without its own; instead of "
      "count");
  v.number("fps", s.fps, 0.1, 1000, "frames a second, for GIF and movie and the EXR header");
  v.integer("hold_start", s.hold_start, 0, 10000, "extra frames that stand still at the start");
  v.integer("hold_end", s.hold_end, 0, 10000, "extra frames that stand still at the end");
  v.integer("turntable", s.turntable, 0, 100000,
            "instead of the film: a turn of the camera around its frame `still`, in so many "
            "frames; 0: the film");
  v.integer("still", s.still, 1, 100000, "turntable: the frame that is turned");
}

template <class V>
void describe(V& v, FieldSettings& s) {
  v.choice("kind", s.kind,
           {{"gaussian", FieldKind::kGaussian},
            {"wyvill", FieldKind::kWyvill},
            {"inverse_square", FieldKind::kInverseSquare}},
           "what a ball adds to the field: Blinn's Gaussian, Wyvill's soft object, or k r^2 / d^2");
  v.number(
      "blobbiness", s.blobbiness, 0, 50,
      "gaussian without a fit: |B|; small melts balls together, large keeps them apart; 0: 0.12 "
      "for octree and active, 6 for hubbard and medial");
  v.boolean("even", s.even,
            "gaussian, octree and active without a fit: strengths such that the field is alike at "
            "all centres, so that thin parts stay");
  v.number("blob_constant", s.blob_constant, 1e-6, 1e6, "inverse_square: factor of every ball");
  v.number("magnitude", s.magnitude, 1e-6, 1e6,
           "inverse_square: strength of a ball, times its radius squared");
  v.number("threshold", s.threshold, 1e-6, 1e6, "inverse_square: field value at the surface");
  v.boolean("match_volume", s.match_volume,
            "shift the level so that the surface encloses the model's volume at both ends");
}

template <class V>
void describe(V& v, LandmarkSettings& s) {
  v.integer("leg", s.leg, 1, 100000, "which leg of the chain it is for; 1 leaves the source");
  v.vector("from", s.from, "a point of the leg's first object, in scene units");
  v.vector("to", s.to, "the point of its second object that belongs to it");
}

template <class V>
void describe(V& v, PlanSettings& s) {
  v.choice("method", s.method,
           {{"index", PlanMethod::kIndex},
            {"nearest", PlanMethod::kNearest},
            {"transport", PlanMethod::kTransport}},
           "which ball becomes which: in list order with surplus balls paired at random, every "
           "ball with the cheapest one, or optimal transport of the volume");
  v.integer("seed", s.seed, 0, 9007199254740991, "of everything random in the plan");
  v.choice("align", s.align,
           {{"none", AlignMethod::kNone},
            {"translate", AlignMethod::kTranslate},
            {"rigid", AlignMethod::kRigid},
            {"similarity", AlignMethod::kSimilarity}},
           "how the objects are laid upon each other before balls are paired");
  v.number("align_gain", s.align_gain, 0, 1,
           "a turn is kept only if it makes the plan this share cheaper");
  v.number("align_tip_residual", s.align_tip_residual, 0, 100,
           "a turn that tips the object over is kept only if it leaves at most this mean squared "
           "distance between paired balls, over their mean squared radius; 0 = never");
  v.number("size_weight", s.size_weight, 0, 1000, "of unlike ball sizes in the cost");
  v.number("feature_weight", s.feature_weight, 0, 1000,
           "of unlike features: distance along the body, linear or flat surroundings, which way "
           "is out");
  v.number("landmark_weight", s.landmark_weight, 0, 1000, "of unlike distances to the landmarks");
  v.number("label_weight", s.label_weight, 0, 1000, "of a change of label, where labels are soft");
  v.choice("label_mode", s.label_mode,
           {{"off", LabelMode::kOff}, {"soft", LabelMode::kSoft}, {"hard", LabelMode::kHard}},
           "what the models' face groups mean: nothing, a cost for leaving one's label, or no "
           "ball leaves its label");
  v.text_map("labels", s.labels,
             "which group becomes which, {\"teapot.spout\": \"penguin.beak\"}; groups of the "
             "same name belong together");
  v.objects("landmarks", s.landmarks, "pairs of points that belong together");
}

template <class V>
void describe(V& v, SpringSettings& s) {
  v.number("mass", s.mass, 1e-3, 1e3, "of a ball of mean volume");
  v.number("stiffness", s.stiffness, 1e-2, 1e5, "force per way; the motion lasts one unit of time");
  v.number("damping", s.damping, 0, 1e4, "force per speed; critical at 2 sqrt(mass stiffness)");
  v.number("lag", s.lag, 0, 1, "how much more mass big balls have than small ones");
}

template <class V>
void describe(V& v, MotionSettings& s) {
  v.choice("interpolate", s.interpolate,
           {{"distance", Interpolation::kDistance}, {"balls", Interpolation::kBalls}},
           "what the surface between two objects is made of: their signed distances, carried along "
           "a smooth map and mixed, or the field of the moving balls (always so on the path "
           "explode, to and from the shape drops, and in fields that are not gaussian)");
  v.choice("path", s.path,
           {{"straight", Path::kStraight},
            {"bezier", Path::kBezier},
            {"rigid", Path::kRigid},
            {"parts", Path::kParts},
            {"explode", Path::kExplode}},
           "the way of a ball: a line, an arc, the turn and growth that lays one object on the "
           "other, the same label by label with neighbours held together, or a throw out of the "
           "one and, backwards, into the other");
  v.number("bend", s.bend, -2, 2, "bezier: how far a path bows out, as a share of its length");
  v.number("burst", s.burst, 0, 100, "explode: speed, in the objects' sizes a motion");
  v.number("gravity", s.gravity, 0, 100, "explode: 1 brings balls down within the motion");
  v.number(
      "soften", s.soften, 0, 0.9,
      "gaussian: how much softer balls are half way between unlike objects, so that they do not "
      "show singly");
  v.choice("easing", s.easing,
           {{"linear", Easing::kLinear},
            {"smoothstep", Easing::kSmoothstep},
            {"quintic", Easing::kQuintic},
            {"bezier", Easing::kBezier},
            {"spring", Easing::kSpring}},
           "how time runs along a leg's motion");
  v.numbers("bezier", s.bezier, {{0, 1}, {-2, 3}, {0, 1}, {-2, 3}},
            "easing bezier: x1, y1, x2, y2 of the curve's inner points");
  v.object("spring", s.spring, "easing spring");
  v.choice("stagger", s.stagger,
           {{"none", Stagger::kNone},
            {"axis", Stagger::kAxis},
            {"radius", Stagger::kRadius},
            {"label", Stagger::kLabel},
            {"noise", Stagger::kNoise}},
           "which balls start later: none, by place along stagger_axis, the bigger ones, label by "
           "label, or at random");
  v.number("stagger_share", s.stagger_share, 0, 0.9,
           "of the motion's time lies between the first start and the last");
  v.vector("stagger_axis", s.stagger_axis, "stagger axis: the last balls lie this way");
  v.integer("seed", s.seed, 0, 9007199254740991, "of everything random in the motion");
  v.boolean("keep_volume", s.keep_volume,
            "shift the level of every frame so that the volume goes evenly from one object's to "
            "the next's");
}

template <class V>
void describe(V& v, BoundarySettings& s) {
  v.choice(
      "method", s.method,
      {{"project", BoundaryMethod::kProject},
       {"blend", BoundaryMethod::kBlend},
       {"crossfade", BoundaryMethod::kCrossfade},
       {"cut", BoundaryMethod::kCut}},
      "model to balls: the model's own mesh moves onto their surface (or, where under 98 % of it "
      "arrives, blend), one solid between both, the report's crossfade, or a hard cut");
  v.number("look_share", s.look_share, 0, 0.4,
           "of a leg's time at each full end: the model fades to the common look");
  v.number("boundary_share", s.boundary_share, 0, 0.4,
           "of a leg's time at each full end: the model becomes balls");
}

template <class V>
void describe(V& v, SurfaceSettings& s) {
  v.integer("resolution", s.resolution, 8, 1024,
            "cells of the marching cubes along the longest side of an actor's box");
  v.choice("method", s.method,
           {{"marching_cubes", SurfaceMethod::kMarchingCubes}, {"matrix", SurfaceMethod::kMatrix}},
           "what is drawn: the surface, or a cube at each grid point inside");
  v.choice("placement", s.placement,
           {{"root", Placement::kRoot}, {"midpoint", Placement::kMidpoint}},
           "where vertices lie on grid edges: where the field is at its level, or half way");
  v.boolean("flat", s.flat, "every triangle has its own normal");
  v.integer("influence", s.influence, 1, 16,
            "cells between the points at which the field is computed; it is interpolated between");
  v.number("min_component_share", s.min_component_share, 0, 0.1,
           "parts below this share of the volume are left out of moving surfaces; 0 keeps all");
}

template <class V>
void describe(V& v, CameraSettings& s) {
  v.vector("position", s.position,
           "where the camera stands; default: placed by azimuth, elevation and framing");
  v.vector("target", s.target, "what it looks at; default: the middle of all objects");
  v.vector("up", s.up, "which way is up");
  v.number("fov", s.fov, 1, 150, "vertical field of view, degrees");
  v.number("azimuth", s.azimuth, -360, 360, "degrees from +z towards +x");
  v.number("elevation", s.elevation, -89, 89, "degrees above the horizon");
  v.constant_number("orbit", s.orbit, -36000, 36000,
                    "degrees that the camera goes round its target during the film, evenly; whole "
                    "turns close without a seam");
  v.number("dolly", s.dolly, 0.01, 100,
           "factor on the distance from the target: below 1 is nearer than framing or `position` "
           "puts the camera");
  v.number("margin", s.margin, 0, 0.45,
           "free border on each side when framing automatically, as a share of the picture");
  v.number("aperture", s.aperture, 0, 1e6,
           "diameter of the lens in scene units: what is out of focus blurs; 0: all sharp");
  v.number("focus", s.focus, 1e-6, 1e6,
           "distance that is sharp, along the view axis; default: that of the middle of all "
           "objects, or of `target`");
  v.number("shutter", s.shutter, 0, 4,
           "motion blur: how many frames long the shutter is open, around the frame's moment; 0.5 "
           "is a film camera's");
}

template <class V>
void describe(V& v, LampSettings& s) {
  v.choice(
      "kind", s.kind,
      {{"lamp", LampKind::kLamp}, {"panel", LampKind::kPanel}, {"sun", LampKind::kSun}},
      "a glowing ball or point, a rectangle that glows towards its target, or a disc far away");
  v.vector("position", s.position, "lamp, panel: of its middle");
  v.vector("target", s.target,
           "lamp, panel: where `intensity` holds, and what a panel faces; default: the middle of "
           "all objects");
  v.number("radius", s.radius, 0, 1e6, "lamp: 0 is a point, with hard shadows");
  v.number("width", s.width, 1e-6, 1e6, "panel");
  v.number("height", s.height, 1e-6, 1e6, "panel");
  v.number("azimuth", s.azimuth, -360, 360, "sun: degrees from the camera's azimuth");
  v.number("elevation", s.elevation, -10, 90, "sun: degrees above the horizon");
  v.number("size", s.size, 0, 60, "sun: apparent diameter in degrees");
  v.number("intensity", s.intensity, 0, 1000,
           "irradiance it gives a surface at its target that faces it");
  v.color("color", s.color, "of its light");
}

template <class V>
void describe(V& v, LightSettings& s) {
  v.number("key_azimuth", s.key_azimuth, -360, 360,
           "of the key light, degrees from the camera's azimuth");
  v.number("key_elevation", s.key_elevation, -10, 90, "degrees above the horizon");
  v.number("key_size", s.key_size, 0, 60,
           "apparent diameter in degrees; larger is softer, 0 is a hard shadow");
  v.number("key_intensity", s.key_intensity, 0, 1000,
           "irradiance the key light gives a surface facing it");
  v.color("key_color", s.key_color, "of the key light");
  v.path("environment", s.environment,
         "lat-long image (EXR, HDR, PNG, JPEG, TIFF); default: the built-in `sky`");
  v.choice("sky", s.sky, {{"studio", SkyKind::kStudio}, {"day", SkyKind::kDay}},
           "built-in: soft boxes in a studio, or a clear sky whose sun is the key light");
  v.number("turbidity", s.turbidity, 2, 10, "sky day: 2 is very clear, 10 hazy");
  v.number("sky_intensity", s.sky_intensity, 0, 1000, "factor on the environment or the sky");
  v.boolean("follow_camera", s.follow_camera,
            "the key light, suns and the studio turn with a camera that moves; else they stand as "
            "its first frame sees them");
  v.objects("lamps", s.lamps, "more lights, at most 16; only mirrors see them");
}

template <class V>
void describe(V& v, GroundSettings& s) {
  v.boolean("enabled", s.enabled, "a floor that catches shadows");
  v.number("height", s.height, -1e6, 1e6, "of the floor; default: below everything");
  v.color("color", s.color, "of the floor");
  v.boolean("shadow_only", s.shadow_only,
            "keep only the shadows it catches, in alpha, for putting the picture on another");
}

template <class V>
void describe(V& v, LookSettings& s) {
  v.choice("kind", s.kind,
           {{"own", LookKind::kOwn},
            {"metal", LookKind::kMetal},
            {"matte", LookKind::kMatte},
            {"glass", LookKind::kGlass}},
           "what the surface wears between the models: their own colours and textures, carried "
           "along, or "
           "one common look that they fade to and from");
  v.color("color", s.color, "of the common look");
  v.number("roughness", s.roughness, 0, 1, "of the metal or the glass: 0 is a mirror");
  v.number("ior", s.ior, 1, 3, "refractive index of the glass");
}

template <class V>
void describe(V& v, ImageSettings& s) {
  v.integer("width", s.width, 1, 32768, "pixels");
  v.integer("height", s.height, 1, 32768, "pixels");
  v.integer("samples", s.samples, 1, 65536, "a pixel; with `noise`, the most for one");
  v.number("noise", s.noise, 0, 1,
           "sample until a pixel's estimated error, over the root of its brightness, is below this "
           "(0.01 is clean, 0.05 a draft); 0: the same number everywhere");
  v.integer("max_depth", s.max_depth, 1, 64, "longest light path, in bounces");
  v.integer("seed", s.seed, 0, 9007199254740991, "of the sampling noise");
  v.boolean("steady", s.steady,
            "what stands still under a camera that stands still keeps its noise from frame to "
            "frame; what moves has new noise in each");
  v.boolean("denoise", s.denoise,
            "clean the colours with Open Image Denoise, where it is installed (docs/films.md)");
  v.keyed_number("exposure", s.exposure, -20, 20,
                 "stops, for PNG, GIF and strips; EXR stays as it is");
  v.boolean("transparent", s.transparent, "alpha 0 instead of a backdrop");
  v.text("aovs", s.aovs,
         "layers of an EXR beside R, G, B, A: Z, N, P, albedo, uv, motion, morph, label, id, "
         "crypto_object, crypto_material, crypto_label, separated by commas, or all, or none");
}

template <class V>
void describe(V& v, OutputSettings& s) {
  v.text("file", s.file,
         "frame file names when -o is not given, from where the program runs; #### is the frame "
         "number");
  v.boolean("png", s.png, "write a PNG beside each EXR");
  v.integer("png_bits", s.png_bits, 8, 16, "a channel of a PNG: 8 or 16");
  v.boolean("dither", s.dither, "round randomly in PNGs, against bands in soft gradients");
}

/// What an actor is made of; a scene with one may say it at the top.
template <class V>
void describe_chain(V& v, ActorSettings& s) {
  v.object("source", s.source,
           "where the morph starts: an object, or just its OBJ file or shape as a string");
  v.objects("intermediate", s.intermediate, "objects on the way, in order");
  v.object("target", s.target, "where the morph ends");
}

template <class V>
void describe(V& v, ActorSettings& s) {
  v.text("name", s.name, "name in messages, reports and meshes; default: the source's");
  describe_chain(v, s);
  v.integer("start", s.start, 1, 100000,
            "the frame from which it moves; before, it stands still (frames.hold_start comes on "
            "top)");
  v.integers("per_leg", s.per_leg, 1, 100000,
             "frames of each of its legs; default: the scene's, else it moves until the scene "
             "ends");
  v.vector("translate", s.translate, "shift on the stage, in scene units, after everything else");
  v.vector("rotate", s.rotate, "degrees about x, then y, then z, about the stage's origin");
  v.scale("scale", s.scale, "one factor, or one an axis, about the stage's origin");
  v.object("plan", s.plan, "which ball becomes which; default: the scene's");
}

template <class V>
void describe(V& v, Scene& s) {
  v.integer("polymorph", s.version, 1, 1, "version of the scene format");
  v.text("description", s.description, "a line for people");
  v.object("spheres", s.spheres, "how models are approximated");
  v.object("motion", s.motion, "how balls move");
  v.object("plan", s.plan, "which ball becomes which");
  v.before_actors(s);  // an actor's and an object's own settings start from the scene's
  v.actors("actors", s.actors,
           "several morphs in one scene, each with its own chain, place and time; instead of "
           "source, intermediate and target");
  v.choice("arrange", s.arrange, {{"stand", Arrange::kStand}, {"none", Arrange::kNone}},
           "stand: every object gets the first source's size, centred, standing on y = 0; none: "
           "as in the files");
  v.object("frames", s.frames, "how many frames, and how fast");
  v.object("field", s.field, "the metaball field");
  v.object("boundary", s.boundary, "the change between model and balls");
  v.object("surface", s.surface, "the extracted surface");
  v.keyed_object("camera", s.camera, "");
  v.keyed_object("lights", s.lights, "");
  v.keyed_object("ground", s.ground, "");
  v.keyed_object(
      "look", s.look,
      "what the surface wears between the models: their own colours and textures, carried "
      "along, or "
      "one common look that they fade to and from");
  v.object("image", s.image, "size and quality of the frames");
  v.object("output", s.output, "");
}

}  // namespace polymorph
