"""Humanoid: an artist's wooden mannequin in a relaxed A pose."""
import numpy as np
from .implicit import (capsule, ellipsoid, mirrored, mix, ripple, rotation, smax, smin, sphere,
                       step01, tube)
from .model import Model, organic

SHOULDER = np.array([0.205, 1.570, -0.010])
ELBOW = np.array([0.325, 1.290, -0.022])
WRIST = np.array([0.432, 1.050, 0.035])
HIP, KNEE, ANKLE = np.array([0.098, 0.98, 0.0]), np.array([0.112, 0.545, 0.012]), np.array([0.120, 0.095, -0.022])


def head(p):
    q = mirrored(p, 0.006)
    d = ellipsoid(p, (0, 1.902, -0.010), (0.080, 0.098, 0.100))
    d = smin(d, ellipsoid(p, (0, 1.832, 0.022), (0.060, 0.078, 0.066)), 0.05)
    d = smin(d, ellipsoid(p, (0, 1.778, 0.060), (0.028, 0.024, 0.024)), 0.04)             # chin
    # An abstract face: one ridge for brow and nose, hollows for the eyes and
    # a soft fold for the mouth.
    d = smin(d, tube(q, [(0.006, 1.907, 0.084, 0.010), (0.034, 1.912, 0.076, 0.011),
                         (0.060, 1.900, 0.054, 0.009)], 4), 0.025)
    d = smax(d, -ellipsoid(q, (0.034, 1.878, 0.102), (0.022, 0.017, 0.020)), 0.035)
    d = smin(d, tube(p, [(0, 1.902, 0.084, 0.009), (0, 1.868, 0.100, 0.010), (0, 1.848, 0.108, 0.0125)], 4), 0.022)
    d = smin(d, ellipsoid(q, (0.010, 1.843, 0.098), (0.010, 0.008, 0.010)), 0.012)
    d = smin(d, ellipsoid(p, (0, 1.811, 0.072), (0.034, 0.018, 0.022)), 0.030)
    ear = ellipsoid(q, (0.080, 1.868, -0.008), (0.011, 0.032, 0.021), rotation(-12, -18, -6))
    ear = smax(ear, -ellipsoid(q, (0.091, 1.870, -0.002), (0.007, 0.019, 0.011), rotation(-12, -18, -6)), 0.008)
    return smin(d, ear, 0.010)


def neck(p):
    return tube(p, [(0, 1.56, -0.022, 0.062), (0, 1.66, -0.018, 0.052), (0, 1.74, -0.006, 0.049),
                    (0, 1.80, 0.0, 0.050)], 3)


def torso(p):
    q = mirrored(p, 0.012)
    d = ellipsoid(p, (0, 1.400, -0.005), (0.158, 0.200, 0.108))                            # ribs
    d = smin(d, ellipsoid(p, (0, 1.170, 0.004), (0.128, 0.200, 0.086)), 0.09)              # waist
    d = smin(d, ellipsoid(p, (0, 1.015, 0.0), (0.146, 0.120, 0.104)), 0.09)                # pelvis
    d = smin(d, ellipsoid(q, (0.072, 0.965, -0.052), (0.074, 0.092, 0.066)), 0.06)         # seat
    d = smin(d, tube(q, [(0.02, 1.570, -0.012, 0.062), (0.12, 1.578, -0.015, 0.056),
                         (0.195, 1.566, -0.012, 0.054)], 3), 0.07)                         # shoulders
    d = smin(d, tube(q, [(0.035, 1.655, -0.030, 0.030), (0.14, 1.600, -0.028, 0.034)], 2), 0.06)
    d = smin(d, ellipsoid(q, (0.076, 1.478, 0.058), (0.084, 0.060, 0.038), rotation(0, 18, 0)), 0.05)
    d = smin(d, ellipsoid(q, (0.105, 1.430, -0.070), (0.075, 0.120, 0.042), rotation(0, 0, -12)), 0.05)
    spine = tube(p, [(0, 1.60, -0.135, 0.018), (0, 1.40, -0.140, 0.020), (0, 1.18, -0.108, 0.020),
                     (0, 1.06, -0.128, 0.012)], 3)
    d = smax(d, -spine, 0.05)
    return d


def arm(q):
    d = tube(q, [(0.198, 1.574, -0.010, 0.064), (0.232, 1.518, -0.010, 0.062), (0.272, 1.425, -0.015, 0.050),
                 tuple(ELBOW) + (0.041,), (0.358, 1.215, -0.010, 0.043), (0.395, 1.130, 0.012, 0.036),
                 tuple(WRIST) + (0.0265,)], 4)
    d = smin(d, ellipsoid(q, (0.262, 1.440, 0.014), (0.034, 0.085, 0.034), rotation(0, 0, 24)), 0.03)
    return d


def hand(q):
    """The palm faces the thigh, the thumb the front; fingers are slightly curled."""
    along_arm = np.array([0.30, -0.945, 0.13])
    along_arm /= np.linalg.norm(along_arm)
    front = np.array([0.0, 0.136, 0.99])                       # across the knuckles
    front -= along_arm * (front @ along_arm)
    front /= np.linalg.norm(front)
    inward = np.cross(front, along_arm)                              # out of the palm
    if inward[0] > 0:
        inward = -inward

    def at(along, across, depth):
        return WRIST + along * along_arm + across * front + depth * inward
    d = tube(q, [tuple(at(-0.01, 0, 0)) + (0.025,), tuple(at(0.02, 0.002, 0)) + (0.024,)], 2)
    r = q - at(0.052, 0.000, 0.002)
    palm = ellipsoid(np.stack([r @ along_arm, r @ front, r @ inward], 1), (0, 0, 0), (0.050, 0.038, 0.019))
    d = smin(d, palm, 0.022)
    for k, (across, length) in enumerate(((0.0290, 0.084), (0.0100, 0.096), (-0.0092, 0.089), (-0.0275, 0.070))):
        fan = across * 1.62
        rows = [tuple(at(0.070, across * 0.9, 0.001)) + (0.0098,),
                tuple(at(0.092 + 0.1 * length, across, 0.002)) + (0.0096,),
                tuple(at(0.092 + 0.55 * length, (across + fan) / 2, 0.007)) + (0.0090,),
                tuple(at(0.090 + 0.98 * length, fan, 0.021)) + (0.0080,)]
        d = smin(d, tube(q, rows, 3), 0.013)
    thumb = [tuple(at(0.018, 0.018, 0.006)) + (0.016,), tuple(at(0.050, 0.041, 0.014)) + (0.0145,),
             tuple(at(0.082, 0.052, 0.018)) + (0.0118,), tuple(at(0.106, 0.053, 0.020)) + (0.0098,)]
    return smin(d, tube(q, thumb, 3), 0.014)


def leg(q):
    d = tube(q, [(0.086, 0.985, 0.0, 0.086), (0.096, 0.87, 0.008, 0.086), (0.108, 0.72, 0.014, 0.076),
                 tuple(KNEE) + (0.057,), (0.114, 0.46, -0.004, 0.056), (0.117, 0.37, -0.016, 0.056),
                 (0.119, 0.23, -0.020, 0.043), tuple(ANKLE) + (0.034,)], 4)
    d = smin(d, ellipsoid(q, KNEE + [0, 0.0, 0.040], (0.034, 0.040, 0.024)), 0.03)          # knee cap
    d = smin(d, ellipsoid(q, (0.120, 0.385, -0.042), (0.036, 0.095, 0.030)), 0.03)          # calf
    return d


def foot(q):
    d = tube(q, [(0.120, 0.050, -0.044, 0.036), (0.121, 0.058, -0.006, 0.040), (0.126, 0.048, 0.060, 0.040),
                 (0.132, 0.030, 0.125, 0.036)], 4)
    d = smin(d, ellipsoid(q, (0.134, 0.024, 0.105), (0.047, 0.026, 0.055), rotation(0, 8, 0)), 0.03)
    for x, z, r in ((0.104, 0.166, 0.0190), (0.131, 0.168, 0.0150), (0.150, 0.158, 0.0140),
                    (0.166, 0.145, 0.0130), (0.180, 0.129, 0.0120)):
        root = (0.134 + (x - 0.134) * 0.8, 0.026, 0.110 - abs(x - 0.125) * 0.4)
        d = smin(d, capsule(q, root, (x, r * 0.95, z), 0.018, r), 0.007)
    d = smin(d, capsule(q, ANKLE, (0.120, 0.055, -0.035), 0.034, 0.036), 0.03)
    return smax(d, -q[:, 1], 0.008)


def field(p):
    q = mirrored(p)
    d = smin(torso(p), neck(p), 0.05)
    d = smin(d, head(p), 0.025)
    d = smin(d, smin(leg(q), foot(q), 0.045), 0.035)
    return smin(d, smin(arm(q), hand(q), 0.015), 0.035)


def parts(p):
    q = mirrored(p)
    left = p[:, 0] > 0
    far = np.full(len(p), 9.0)
    y = p[:, 1]
    h = np.where(y > 1.735, np.minimum(head(p), neck(p)), head(p))
    t = np.minimum(torso(p), np.where(y <= 1.735, neck(p), far))
    beyond = (q - WRIST) @ np.array([0.30, -0.945, 0.13])
    a = np.where(beyond < 0, arm(q), far) + 0.004
    w = np.where(beyond >= 0, np.minimum(hand(q), arm(q)), far)
    l = np.where(y > 0.10, leg(q), far) + 0.004
    f = np.where(y > 0.10, far, np.minimum(foot(q), leg(q)))
    out = [("head", h), ("torso", t)]
    for name, d in (("arm", a), ("hand", w), ("leg", l), ("foot", f)):
        out += [("left_" + name, np.where(left, d, far)), ("right_" + name, np.where(left, far, d))]
    return out


def paint(p):
    """Pale maple: growth rings along the limbs, dark turned joints."""
    q = mirrored(p)
    y, z = p[:, 1], p[:, 2]
    ring = np.sqrt((q[:, 0] - 0.31) ** 2 + (z + 0.23) ** 2 + 0.002 * y) * 95
    ring = ring + 2.2 * ripple(p * [1, 0.25, 1], 9) + 0.5 * np.sin(3.1 * y)
    grain = (0.5 + 0.5 * np.sin(ring)) ** 2
    c = mix((0.885, 0.735, 0.545), (0.780, 0.585, 0.385), 0.55 * grain)
    c *= (1 + 0.025 * ripple(p * [1, 0.15, 1], 120))[:, None]

    def across(point, normal):
        normal = np.asarray(normal, float)
        return np.abs((q - point) @ (normal / np.linalg.norm(normal)))
    near_arm = step01(0.02, 0.0, np.minimum(arm(q), hand(q)) - torso(p))
    joint = np.zeros(len(p))
    groove = np.zeros(len(p))
    limb = near_arm
    leg_on = step01(1.0, 0.9, y) * (1 - near_arm)
    for point, normal, strength, half in ((ELBOW, WRIST - SHOULDER, limb, 0.018), (WRIST, (0.30, -0.945, 0.13), limb, 0.011),
                                 (KNEE, (0, 1, 0), leg_on, 0.022), (ANKLE, (0, 1, 0), leg_on, 0.012),
                                 (np.array([0, 1.722, 0]), (0, 1, 0.35), 1 - limb, 0.013)):
        a = across(point, normal)
        joint = np.maximum(joint, strength * step01(half + 0.0015, half - 0.0015, a))
        groove = np.maximum(groove, strength * step01(0.0032, 0.0014, np.abs(a - half)))
    c = mix(c, np.array([0.62, 0.42, 0.265]) * (1 + 0.05 * ripple(p, 60))[:, None], joint)
    c = mix(c, (0.24, 0.145, 0.09), 0.85 * groove)
    # The mouth is no more than a soft pencil line.
    bow = np.abs(y - 1.812 - 6.0 * p[:, 0] ** 2)
    mouth = step01(0.0032, 0.0010, bow) * step01(0.027, 0.020, np.abs(p[:, 0])) * step01(0.06, 0.07, z)
    return mix(c, (0.45, 0.28, 0.18), 0.75 * mouth)


def build():
    m = Model("humanoid", "wooden mannequin standing in a relaxed A pose",
              "blended ellipsoids and tubes, surface nets, painted from position in space")

    def weight(p):
        q = mirrored(p)
        hands = step01(0.22, 0.14, sphere(q, WRIST + [0.03, -0.10, 0.01], 0.0))
        face = step01(0.17, 0.10, sphere(p, (0, 1.86, 0.07), 0.0))
        feet = step01(0.09, 0.05, p[:, 1])
        return 1 + 7 * hands + 9 * face + 2 * feet
    density = {"head": 1.6, "left_hand": 1.2, "right_hand": 1.2}
    return [organic(m, field, parts, paint, (-0.62, -0.03, -0.20), (0.62, 2.05, 0.26), 0.0066,
                    10000, weight, density, shine=(0.12, 30), flat=0.08, texture=768)]
