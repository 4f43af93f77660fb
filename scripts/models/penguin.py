"""Penguin: a stout bird in a tailcoat, with a dab of gold at the neck."""
import numpy as np
from .implicit import (capsule, curve, ellipsoid, mirrored, mix, paint_eye, ripple, rotation, smax,
                       smin, sphere, step01, tube)
from .model import Model, organic

EYE = np.array([0.148, 1.640, 0.256])
EYE_R = 0.066
GAZE = (0.46, 0.02, 0.89)
SOCKET = (0.53, 0.02, 0.85)      # direction in which the eyeball protrudes


def body(p):
    d = ellipsoid(p, (0, 0.70, 0.02), (0.50, 0.60, 0.455))
    d = smin(d, ellipsoid(p, (0, 1.06, 0.0), (0.395, 0.42, 0.355)), 0.22)
    return smin(d, ellipsoid(p, (0, 1.36, 0.02), (0.232, 0.22, 0.225)), 0.15)


def head(p):
    q = mirrored(p, 0.01)
    d = ellipsoid(p, (0, 1.625, 0.045), (0.268, 0.262, 0.282))
    d = smin(d, ellipsoid(p, (0, 1.60, 0.19), (0.15, 0.125, 0.14)), 0.10)        # face
    d = smin(d, ellipsoid(q, (0.125, 1.53, 0.15), (0.12, 0.10, 0.12)), 0.08)     # cheeks
    brow = tube(q, [(0.070, 1.715, 0.270, 0.020), (0.135, 1.728, 0.252, 0.027),
                    (0.205, 1.695, 0.195, 0.022)], 3)
    d = smin(d, brow, 0.06)
    return smax(d, -sphere(q, EYE + 0.030 * np.array(GAZE), EYE_R * 1.25), 0.04)  # sockets


def upper_beak(p):
    d = tube(p, [(0, 1.610, 0.22, 0.088), (0, 1.606, 0.34, 0.071), (0, 1.592, 0.46, 0.047),
                 (0, 1.560, 0.555, 0.027), (0, 1.522, 0.592, 0.013)], 10)
    return d


def lower_beak(p):
    return tube(p, [(0, 1.560, 0.22, 0.070), (0, 1.546, 0.33, 0.050), (0, 1.536, 0.44, 0.031),
                    (0, 1.530, 0.53, 0.015)], 10)


def beak(p):
    return smin(upper_beak(p), lower_beak(p), 0.020)


def wing(q):
    """Flipper in the half space x > 0; thin across, broadest above the middle."""
    r = q - np.array([0.395, 1.20, -0.005])
    r = r @ rotation(-5, 0, 19)
    t = -r[:, 1] / 0.72                               # 0 at the shoulder, 1 at the tip
    bend = r[:, 0] - 0.085 * t * t + 0.03 * t
    sweep = r[:, 2] + 0.13 * np.clip(t, 0, 2) ** 2
    width = 0.145 * (1.08 - 0.62 * np.clip(t, -0.2, 1.2) ** 1.0 * np.clip(t, 0, 1.2))
    s = np.stack([bend, r[:, 1] + 0.32, sweep * (0.145 / np.maximum(width, 0.03))], 1)
    return ellipsoid(s, (0, 0, 0), (0.052, 0.43, 0.150))


TOES = [(0.130, 0.045, 0.375), (0.225, 0.045, 0.415), (0.320, 0.045, 0.360)]


def foot(q):
    d = capsule(q, (0.20, 0.20, 0.02), (0.205, 0.08, 0.09), 0.105, 0.075)
    for t in TOES:
        t = np.array(t)
        knuckle = np.array([0.205, 0.075, 0.12]) * 0.45 + t * 0.55 + [0, 0.016, 0]
        toe = smin(capsule(q, (0.205, 0.075, 0.10), knuckle, 0.060, 0.044),
                   capsule(q, knuckle, t, 0.044, 0.036), 0.02)
        toe = smin(toe, capsule(q, t + [0, 0.012, 0.02], t + (t - [0.205, 0.045, 0.10]) * 0.20
                                + [0, -0.012, 0], 0.020, 0.007), 0.012)
        d = smin(d, toe, 0.03)
    web = ellipsoid(q, (0.222, 0.036, 0.235), (0.125, 0.026, 0.125))
    d = smin(d, web, 0.03)
    return smax(d, -q[:, 1], 0.012)                   # flat soles


def tail(p):
    r = (p - np.array([0, 0.225, -0.37])) @ rotation(-36, 0, 0)
    taper = 1 - 0.9 * np.clip(r[:, 2] + 0.1, -0.4, 0.2)          # broader toward the end
    return ellipsoid(np.stack([r[:, 0] / taper * 1.1, r[:, 1], r[:, 2]], 1), (0, 0, -0.03), (0.135, 0.046, 0.220))


def field(p):
    q = mirrored(p)
    d = smin(body(p), head(p), 0.10)
    d = smin(d, tail(p), 0.075)
    d = smin(d, wing(q), 0.055)
    d = smin(d, foot(mirrored(p)), 0.035)
    d = smin(d, beak(p), 0.022)
    d = smin(d, sphere(q, EYE, EYE_R), 0.022)
    return smax(d, -p[:, 1], 0.01)


def parts(p):
    q = mirrored(p)
    left = p[:, 0] > 0
    far = np.full(len(p), 9.0)
    w, f = wing(q), foot(q)
    b = body(p) - 0.004
    # The head starts at the narrowest height of the neck.
    h = np.where(p[:, 1] > 1.40, np.minimum(head(p), b) - 0.01, head(p) + 0.05)
    return [("body", b), ("head", h), ("beak", beak(p) - 0.004),
            ("left_wing", np.where(left, w, far) - 0.004),
            ("right_wing", np.where(left, far, w) - 0.004),
            ("left_foot", np.where(left, f, far) + 0.004),
            ("right_foot", np.where(left, far, f) + 0.004), ("tail", tail(p))]


def paint(p):
    x, y, z = np.abs(p[:, 0]), p[:, 1], p[:, 2]
    q = mirrored(p)
    coat = np.array([0.105, 0.135, 0.205])
    c = np.broadcast_to(coat, p.shape).copy()
    c = mix(c, (0.20, 0.27, 0.38), 0.55 * step01(0.45, 1.35, y) * step01(0.1, -0.4, z))
    c *= (1 + 0.07 * ripple(p, 9) + 0.05 * ripple(p, 23, 1.3))[:, None]

    # Shirt front: `edge` is its half width as an angle (degrees) about y, by height.
    ang = np.degrees(np.arctan2(x, z + 0.06))
    edge = curve(y, [0.0, 0.12, 0.4, 0.8, 1.1, 1.25, 1.36, 1.45, 1.50, 1.53],
                 [62, 68, 75, 74, 64, 58, 56, 44, 24, -12])
    edge = edge + 0.4 * ripple(p, 14)
    inside = edge - ang
    belly = np.array([0.965, 0.955, 0.915])
    shirt = np.broadcast_to(belly, p.shape).copy()
    shirt = mix(shirt, (0.90, 0.87, 0.80), 0.8 * step01(0.45, 0.08, y))
    shirt = mix(shirt, (0.985, 0.80, 0.36), 0.85 * step01(1.02, 1.40, y + 0.02 * ripple(p, 7)))
    c = mix(c, coat * 0.45, step01(-9, -2, inside) * step01(0.2, 0.5, y) * step01(1.55, 1.3, y))
    c = mix(c, shirt, step01(-1.6, 1.6, inside))

    # A golden comma behind each cheek; its tail runs down into the shirt.
    cy = y - 1.545
    bow = z - 0.005 - 0.30 * np.clip(-cy, 0, 0.4) - 1.6 * np.clip(-cy, 0, 0.4) ** 2 + 0.5 * np.clip(cy, 0, 1) ** 2
    half = curve(y, [1.22, 1.34, 1.44, 1.52, 1.59, 1.63, 1.652, 1.664, 1.669],
                 [0.028, 0.034, 0.044, 0.064, 0.068, 0.058, 0.040, 0.015, -0.02])
    comma = np.abs(bow) - half
    on_side = step01(0.09, 0.13, x) * step01(1.20, 1.34, y)
    gold = mix((0.99, 0.60, 0.09), (0.99, 0.80, 0.32), step01(1.60, 1.34, y))
    c = mix(c, coat * 0.5, on_side * step01(0.022, 0.006, comma) * step01(0.5, -1.5, inside))
    c = mix(c, gold, on_side * step01(0.005, -0.005, comma))

    # Flippers: dark outside with a pale trailing edge, pale inside.
    body_d, w = np.minimum(body(p), head(p)), wing(q)
    on_wing = step01(0.012, -0.006, w - body_d)
    r = (q - np.array([0.395, 1.20, -0.005])) @ rotation(-5, 0, 19)
    t = -r[:, 1] / 0.72
    within = step01(-0.018, -0.030, r[:, 0] - 0.085 * t * t + 0.03 * t)
    cuff = mix(np.broadcast_to(coat * 1.02, p.shape), (0.20, 0.27, 0.38), 0.35 * step01(0.9, 0.0, t))
    cuff *= (1 + 0.06 * ripple(p, 17))[:, None]
    cuff = mix(cuff, (0.90, 0.89, 0.87), within)
    c = mix(c, cuff, on_wing)

    # Tail
    c = mix(c, coat * 0.8, step01(0.02, -0.005, tail(p) - body_d))

    # Feet: warm orange, darker toward the soles, claws slate.
    f = foot(q)
    skin = mix((0.96, 0.55, 0.16), (0.80, 0.36, 0.10), step01(0.05, 0.0, y))
    skin = mix(skin, (0.99, 0.68, 0.30), step01(0.05, 0.11, y) * 0.7)
    skin *= (1 + 0.05 * ripple(p, 40))[:, None]
    claw = np.full(len(p), 9.0)
    for toe in TOES:
        toe = np.array(toe)
        claw = np.minimum(claw, sphere(q, toe + (toe - [0.205, 0.045, 0.10]) * 0.17 + [0, 0.004, 0], 0.034))
    skin = mix(skin, (0.20, 0.19, 0.22), step01(0.006, -0.003, claw))
    c = mix(c, skin, step01(0.014, 0.004, f) * step01(0.17, 0.145, y))

    # Beak: slate above, coral below, a dark line where they meet.
    up, low = upper_beak(p), lower_beak(p)
    on_beak = step01(0.010, 0.004, np.minimum(up, low)) * step01(0.275, 0.295, z + 0.25 * (y - 1.56))
    horn = mix((0.17, 0.17, 0.21), (0.30, 0.29, 0.33), step01(1.60, 1.68, y))
    horn = mix(horn, (0.97, 0.50, 0.20), step01(0.004, -0.004, low - up))
    horn = mix(horn, (0.10, 0.07, 0.09), 0.9 * step01(0.0045, 0.0015, np.abs(low - up)))
    nostril = ellipsoid(q, (0.047, 1.632, 0.36), (0.02, 0.008, 0.030))
    horn = mix(horn, (0.05, 0.05, 0.06), step01(0.004, -0.001, nostril))
    c = mix(c, horn, on_beak)
    # A pale ring of skin surrounds the eye.  The edge of the eyeball is painted
    # as a cone about its axis, which is rounder than the crease.
    r = q - EYE
    around = np.sqrt((r * r).sum(1))
    axis = np.array(SOCKET) / np.linalg.norm(SOCKET)
    cone = np.arccos(np.clip(r @ axis / np.maximum(around, 1e-9), -1, 1)) - np.radians(63)
    c = mix(c, (0.88, 0.86, 0.84), step01(0.026, 0.020, around - EYE_R))
    rest = around - EYE_R - cone * EYE_R
    return paint_eye(c, p, rest, EYE, GAZE, EYE_R, (0.50, 0.25, 0.09), 52, 33,
                     glint=(-0.30, 0.40), rim=(0.36, 0.30, 0.28), rim_width=0.004, glint_deg=11)


def build():
    m = Model("penguin", "stout penguin with a gold neck",
              "blended ellipsoids and tubes, surface nets, painted from position in space")
    density = {"head": 1.7, "beak": 1.7, "left_foot": 1.15, "right_foot": 1.15}

    def weight(p):
        face = step01(0.42, 0.12, sphere(p, (0, 1.62, 0.30), 0.0))
        eyes = step01(1.7, 1.2, sphere(mirrored(p), EYE, 0.0) / EYE_R)
        return 1 + 6 * face + 9 * eyes + 2 * step01(0.14, 0.08, p[:, 1])
    return [organic(m, field, parts, paint, (-0.9, -0.06, -0.75), (0.9, 1.98, 0.72), 0.0135,
                    10000, weight, density, shine=(0.12, 30))]
