"""Walking poses of the humanoid and the spider: vertices are rotated about the joints."""
import numpy as np
from . import humanoid, spider
from .implicit import mirrored, rotation, step01


def rotate_about(p, joint, degrees, weight):
    """Rotates each point about a joint, by its weight (0 to 1) times the angles about x, y and z."""
    out = p.copy()
    for level in np.unique(weight[weight > 0]):
        at = weight == level
        out[at] = (p[at] - joint) @ rotation(*(level * np.asarray(degrees, float))).T + joint
    return out


def round_weight(weight):
    """Rounds weights to multiples of 1/400, because rotate_about() makes a matrix for each weight."""
    return np.round(weight * 400) / 400


def walking_humanoid(p, groups, phase):
    """Returns the vertices at `phase`, 0 to 1, of a cycle of two steps."""
    q = mirrored(p)
    limb = np.array([name.split("_")[-1] for name in groups])
    is_arm = (limb == "arm") | (limb == "hand")
    out = p.copy()
    for side in (1, -1):
        swing = np.sin(2 * np.pi * phase) * side
        lift = max(0.0, np.cos(2 * np.pi * phase) * side)
        mirror = np.array([side, 1, 1])
        side_weight = step01(-0.02, 0.02, p[:, 0] * side)
        leg = np.where(is_arm, 0, step01(1.0, 0.84, p[:, 1])) * side_weight
        knee = np.where(is_arm, 0, step01(0.60, 0.48, p[:, 1])) * side_weight
        out = rotate_about(out, humanoid.KNEE * mirror, (12 + 38 * lift, 0, 0), round_weight(knee))
        out = rotate_about(out, humanoid.HIP * mirror, (-26 * swing - 10 * lift - 4, 0, 0), round_weight(leg))
        along = (q - humanoid.SHOULDER) @ (humanoid.WRIST - humanoid.SHOULDER)
        arm = np.where(is_arm, step01(0.0, 0.06, along), 0) * side_weight
        forearm = np.where(is_arm, step01(0.12, 0.20, along), 0) * side_weight
        out = rotate_about(out, humanoid.ELBOW * mirror, (-22 - 14 * swing, 0, 0), round_weight(forearm))
        out = rotate_about(out, humanoid.SHOULDER * mirror, (30 * swing, 0, 8 * side), round_weight(arm))
    out[:, 1] += 0.012 * np.cos(4 * np.pi * phase)
    return out


def walking_spider(p, groups, phase):
    """Returns the vertices at `phase`, 0 to 1, of a cycle. Neighbouring legs are half a cycle apart."""
    out = p.copy()
    for number, (degrees, _length, _) in enumerate(spider.LEGS):
        for side, side_name in ((1, "left"), (-1, "right")):
            is_leg = groups == "%s_leg_%d" % (side_name, number + 1)
            angle = 2 * np.pi * (phase + 0.5 * ((number + (side < 0)) % 2))
            a = np.radians(degrees)
            direction = np.array([np.sin(a) * side, 0, np.cos(a)])
            base = np.array([0.13 * np.sin(a) * side, 0.37, 0.20 + 0.16 * np.cos(a)])
            weight = np.where(is_leg, step01(0.02, 0.18, (p - base) @ direction), 0)
            lift = 14 * max(0.0, np.cos(angle))
            up = np.cross(direction, [0, 1, 0]) * lift
            out = rotate_about(out, base, (up[0], 16 * side * np.sin(angle), up[2]), round_weight(weight))
    return out


WALKS = {"humanoid": walking_humanoid, "spider": walking_spider}
