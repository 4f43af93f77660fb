"""Walking poses of the humanoid and the spider: vertices of the models, turned about their joints."""
import numpy as np
from . import humanoid, spider
from .implicit import mirrored, rotation, step01


def turned(p, joint, degrees, weight):
    """The points turned about a joint, each by its weight's share of the angles about x, y and z."""
    out = p.copy()
    for level in np.unique(weight[weight > 0]):
        at = weight == level
        out[at] = (p[at] - joint) @ rotation(*(level * np.asarray(degrees, float))).T + joint
    return out


def steps(weight):
    """Weights in a few hundred steps, so that points are turned in groups."""
    return np.round(weight * 400) / 400


def walking_humanoid(p, parts, phase):
    """A cycle of two steps; phase in turns."""
    q = mirrored(p)
    limb = np.array([name.split("_")[-1] for name in parts])
    is_arm = (limb == "arm") | (limb == "hand")
    out = p.copy()
    for side in (1, -1):
        swing = np.sin(2 * np.pi * phase) * side
        lift = max(0.0, np.cos(2 * np.pi * phase) * side)
        mirror = np.array([side, 1, 1])
        own = step01(-0.02, 0.02, p[:, 0] * side)
        leg = np.where(is_arm, 0, step01(1.0, 0.84, p[:, 1])) * own
        knee = np.where(is_arm, 0, step01(0.60, 0.48, p[:, 1])) * own
        out = turned(out, humanoid.KNEE * mirror, (12 + 38 * lift, 0, 0), steps(knee))
        out = turned(out, humanoid.HIP * mirror, (-26 * swing - 10 * lift - 4, 0, 0), steps(leg))
        along = (q - humanoid.SHOULDER) @ (humanoid.WRIST - humanoid.SHOULDER)
        arm = np.where(is_arm, step01(0.0, 0.06, along), 0) * own
        fore = np.where(is_arm, step01(0.12, 0.20, along), 0) * own
        out = turned(out, humanoid.ELBOW * mirror, (-22 - 14 * swing, 0, 0), steps(fore))
        out = turned(out, humanoid.SHOULDER * mirror, (30 * swing, 0, 8 * side), steps(arm))
    out[:, 1] += 0.012 * np.cos(4 * np.pi * phase)
    return out


def walking_spider(p, parts, phase):
    """Legs step by turns, neighbours half a cycle apart."""
    out = p.copy()
    for number, (degrees, reach, _) in enumerate(spider.LEGS):
        for side, word in ((1, "left"), (-1, "right")):
            own = parts == "%s_leg_%d" % (word, number + 1)
            turn = 2 * np.pi * (phase + 0.5 * ((number + (side < 0)) % 2))
            a = np.radians(degrees)
            way = np.array([np.sin(a) * side, 0, np.cos(a)])
            base = np.array([0.13 * np.sin(a) * side, 0.37, 0.20 + 0.16 * np.cos(a)])
            weight = np.where(own, step01(0.02, 0.18, (p - base) @ way), 0)
            lift = 14 * max(0.0, np.cos(turn))
            up = np.cross(way, [0, 1, 0]) * lift
            out = turned(out, base, (up[0], 16 * side * np.sin(turn), up[2]), steps(weight))
    return out


WALKS = {"humanoid": walking_humanoid, "spider": walking_spider}
