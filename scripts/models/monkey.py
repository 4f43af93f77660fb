"""Monkey head: heart-shaped face, round ears, a quiff and a half smile."""
import numpy as np
from .implicit import (capsule, ellipsoid, mirrored, mix, paint_eye, ripple, rotation, smax,
                       smin, sphere, spline, step01, tube)
from .model import Model, organic

EYE = np.array([0.235, 1.080, 0.435])
EYE_R = 0.160
GAZE = (0.19, -0.01, 0.98)
EAR = np.array([0.80, 1.06, -0.10])
EAR_ROT = rotation(0, 28, -8)


def heart(p):
    """Returns a function that is below 0 on the hairless face: two lobes round the eyes, and the muzzle."""
    q = mirrored(p, 0.02)
    x, y = q[:, 0], q[:, 1]
    lobe = np.sqrt(((x - 0.235) / 0.295) ** 2 + ((y - 1.12) / 0.325) ** 2)
    jaw = np.sqrt((x / 0.46) ** 2 + ((y - 0.62) / 0.46) ** 2)
    return smin(lobe, jaw, 0.22) - 1.0 + 2.5 * step01(0.20, -0.20, p[:, 2])


def skull(p):
    q = mirrored(p, 0.02)
    d = ellipsoid(p, (0, 1.20, -0.12), (0.69, 0.68, 0.70))
    d = smin(d, ellipsoid(p, (0, 0.80, 0.12), (0.56, 0.50, 0.46)), 0.25)
    d = smin(d, ellipsoid(q, (0.34, 0.78, 0.30), (0.22, 0.20, 0.20)), 0.15)     # cheeks
    ruff = np.full(len(p), 9.0)
    for tip in ((0.755, 0.600, -0.03), (0.610, 0.365, 0.05)):
        root = np.array([0.30, 0.74, 0.02])
        offset = np.array(tip) - root
        ruff = smin(ruff, tube(q, [tuple(root) + (0.21,), tuple(root + 0.62 * offset) + (0.115,),
                                   tuple(root + 0.88 * offset) + (0.048,), tip + (0.012,)], 3), 0.05)
    d = smin(d, ruff, 0.12)
    # The fur is 0.03 higher than the hairless face.
    return d + 0.030 * step01(0.10, -0.10, heart(p)) - 0.010


def quiff(p):
    locks = [[(0.00, 1.74, 0.12, 0.150), (0.00, 1.89, 0.20, 0.105), (0.01, 1.985, 0.33, 0.058),
              (0.04, 1.985, 0.45, 0.010)],
             [(0.05, 1.74, 0.10, 0.120), (0.11, 1.86, 0.17, 0.078), (0.19, 1.925, 0.27, 0.036),
              (0.24, 1.915, 0.34, 0.009)],
             [(-0.05, 1.74, 0.10, 0.120), (-0.10, 1.87, 0.16, 0.078), (-0.165, 1.945, 0.25, 0.036),
              (-0.20, 1.945, 0.33, 0.009)],
             [(0.00, 1.74, 0.04, 0.130), (0.01, 1.90, 0.05, 0.085), (0.03, 2.01, 0.08, 0.040),
              (0.06, 2.055, 0.13, 0.009)]]
    d = tube(p, locks[0], 6)
    for lock in locks[1:]:
        d = smin(d, tube(p, lock, 6), 0.05)
    return d


def brow(p):
    q = mirrored(p, 0.015)
    return tube(q, [(0.02, 1.245, 0.570, 0.050), (0.14, 1.315, 0.560, 0.066), (0.28, 1.320, 0.505, 0.062),
                    (0.43, 1.215, 0.395, 0.040)], 4)


def eye(q):
    return sphere(q, EYE, EYE_R)


def lids(q):
    r = q - EYE
    ball = np.sqrt((r * r).sum(1)) - EYE_R * 1.11
    up = smax(ball, -(r @ np.array([0.10, 0.83, -0.50]) - 0.022), 0.02)
    low = smax(ball, -(r @ np.array([0.0, -0.86, -0.50]) - 0.050), 0.02)
    return np.minimum(up, low)


def muzzle_shape(p):
    q = mirrored(p, 0.03)
    d = ellipsoid(p, (0, 0.575, 0.44), (0.385, 0.285, 0.345))
    d = smin(d, ellipsoid(q, (0.135, 0.590, 0.600), (0.20, 0.175, 0.18)), 0.10)  # upper lip
    return smin(d, ellipsoid(p, (0, 0.375, 0.50), (0.215, 0.150, 0.20)), 0.09)   # chin


def nose(p):
    q = mirrored(p, 0.012)
    d = tube(p, [(0, 1.08, 0.530, 0.060), (0, 0.93, 0.625, 0.060), (0, 0.805, 0.730, 0.066)], 4)
    d = smin(d, ellipsoid(q, (0.066, 0.775, 0.735), (0.068, 0.055, 0.060)), 0.05)
    return d


def nostrils(p):
    q = mirrored(p)
    return ellipsoid(q, (0.060, 0.752, 0.800), (0.030, 0.022, 0.055), rotation(0, 0, 25))


MOUTH = [(-0.345, 0.600, 0.640, 0.008), (-0.315, 0.545, 0.690, 0.020), (-0.20, 0.478, 0.760, 0.022),
         (0.0, 0.452, 0.785, 0.022), (0.20, 0.478, 0.760, 0.022), (0.315, 0.545, 0.690, 0.020),
         (0.345, 0.600, 0.640, 0.008)]


def mouth(p):
    """A thin tube along the smile, which field() subtracts."""
    d = np.full(len(p), 9.0)
    rows = np.array(MOUTH)
    s = spline(rows, 3)
    for a, b in zip(s[:-1], s[1:]):
        d = np.minimum(d, capsule(p, a[:3], b[:3], a[3], b[3]))
    return d


def ear(q):
    r = (q - EAR) @ EAR_ROT
    d = ellipsoid(r, (0, 0, 0), (0.265, 0.300, 0.095))
    d = smin(d, ellipsoid(r, (-0.08, -0.21, 0.0), (0.12, 0.11, 0.07)), 0.06)      # lobe
    d = smax(d, -ellipsoid(r, (-0.02, 0.0, 0.105), (0.195, 0.225, 0.095)), 0.05)  # dish
    fold = tube(r, [(-0.16, -0.12, 0.030, 0.030), (-0.09, -0.02, 0.045, 0.034), (-0.12, 0.10, 0.035, 0.026)], 3)
    return smin(d, fold, 0.05)


def bare(p):
    """Head without eyes and ears."""
    q = mirrored(p)
    d = smin(skull(p), muzzle_shape(p), 0.10)
    d = smin(d, quiff(p), 0.09)
    d = smin(d, brow(p), 0.09)
    d = smax(d, -sphere(q, EYE + [0, 0, 0.10], EYE_R * 1.12), 0.10)              # sockets
    return d


def field(p):
    q = mirrored(p)
    d = smin(bare(p), ear(q), 0.07)
    d = smin(d, lids(q), 0.04)
    d = smin(d, nose(p), 0.06)
    d = smin(d, eye(q), 0.010)
    d = smax(d, -nostrils(p), 0.025)
    return smax(d, -mouth(p), 0.030)


def parts(p):
    q = mirrored(p)
    left = p[:, 0] > 0
    far = np.full(len(p), 9.0)
    e, o = eye(q) + 0.004, ear(q)
    m = np.minimum(np.minimum(muzzle_shape(p), nose(p)), np.abs(mouth(p)))
    return [("head", smin(skull(p), quiff(p), 0.09)), ("brow", brow(p)), ("muzzle", m),
            ("left_eye", np.where(left, e, far)), ("right_eye", np.where(left, far, e)),
            ("left_ear", np.where(left, o, far)), ("right_ear", np.where(left, far, o))]


def paint(p):
    x, y, z = np.abs(p[:, 0]), p[:, 1], p[:, 2]
    q = mirrored(p)
    fur = mix((0.40, 0.245, 0.145), (0.30, 0.175, 0.105), step01(1.2, 1.9, y))
    fur = mix(fur, (0.52, 0.34, 0.21), 0.8 * step01(0.9, 0.35, y))
    strand = ripple(p * [1, 0.45, 0.45], 26) * 0.6 + ripple(p, 13, 0.7) * 0.4
    fur *= (1 + 0.055 * strand)[:, None]
    skin = mix((0.915, 0.715, 0.545), (0.955, 0.805, 0.655), step01(0.95, 0.60, y))
    blush = np.sqrt(((x - 0.40) / 0.15) ** 2 + ((y - 0.80) / 0.11) ** 2)
    skin = mix(skin, (0.93, 0.55, 0.45), 0.45 * step01(1.15, 0.2, blush) * step01(0.0, 0.3, z))
    around = np.sqrt(((q - EYE) ** 2).sum(1))
    skin = mix(skin, (0.72, 0.48, 0.36), 0.55 * step01(EYE_R * 1.55, EYE_R * 1.08, around))
    h = heart(p) + 0.025 * np.sin(38 * np.arctan2(p[:, 0], y - 0.85)) * step01(0.7, 1.2, y)
    c = mix(skin, fur, step01(-0.05, 0.05, h))
    # Brows: fur, but only on the ridge.
    b = brow(p)
    c = mix(c, np.array([0.27, 0.155, 0.095]) * (1 + 0.08 * strand)[:, None],
            step01(0.012, -0.004, b) * step01(1.20, 1.27, y + 0.15 * x))
    # Ears
    r = (q - EAR) @ EAR_ROT
    dish = np.sqrt(((r[:, 0] + 0.02) / 0.185) ** 2 + (r[:, 1] / 0.215) ** 2)
    c = mix(c, mix((0.90, 0.62, 0.50), (0.93, 0.72, 0.57), step01(0.2, 1.0, dish)),
            step01(1.04, 0.94, dish) * step01(-0.01, 0.015, r[:, 2]) * step01(0.56, 0.62, x))
    # Nose, nostrils, mouth
    n = nose(p)
    c = mix(c, (0.80, 0.52, 0.41), 0.75 * step01(0.03, -0.01, n) * step01(0.92, 0.80, y))
    c = mix(c, (0.20, 0.09, 0.08), step01(0.016, -0.002, nostrils(p)))
    m = mouth(p)
    c = mix(c, (0.78, 0.46, 0.38), 0.8 * step01(0.055, 0.01, m))
    c = mix(c, (0.30, 0.11, 0.10), step01(0.010, -0.003, m))
    # Lids and eyes
    lid = lids(q)
    c = mix(c, (0.80, 0.57, 0.43), step01(0.012, 0.0, lid) * step01(0.004, 0.010, eye(q)))
    rest = smin(smin(bare(p), lid, 0.04), nose(p), 0.06)
    return paint_eye(c, p, rest, EYE, GAZE, EYE_R, (0.45, 0.24, 0.09), 41, 23, glint=(-0.24, 0.30))


def build():
    m = Model("monkey", "monkey head",
              "blended ellipsoids and tubes, surface nets, painted from position in space")

    def weight(p):
        return 1 + 5 * step01(0.62, 0.25, sphere(p, (0, 0.80, 0.62), 0.0))
    density = {"left_eye": 2.2, "right_eye": 2.2, "muzzle": 1.25}
    return [organic(m, field, parts, paint, (-1.25, 0.0, -0.98), (1.25, 2.15, 1.0), 0.0165,
                    10000, weight, density, shine=(0.08, 24))]
