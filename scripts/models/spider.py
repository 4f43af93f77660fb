"""Spider: eight thin legs, a furry body and rather large eyes."""
import numpy as np
from .implicit import (ellipsoid, mirrored, mix, paint_eye, ripple, rotation, smax, smin,
                       sphere, step01, tube)
from .model import Model, organic

# Legs of the left side: direction (degrees from +z), length in the ground plane, height of the knee.
LEGS = [(32, 1.10, 0.74), (68, 0.98, 0.71), (106, 0.97, 0.71), (141, 1.16, 0.77)]
# Eyes of the left side: centre and radius.  GAZES: the directions that they look in.
EYES = [((0.082, 0.452, 0.520), 0.076), ((0.185, 0.470, 0.430), 0.046),
        ((0.150, 0.545, 0.330), 0.030), ((0.160, 0.545, 0.200), 0.034)]
GAZES = [(0.10, 0.06, 1.0), (0.62, 0.12, 0.78), (0.6, 0.6, 0.5), (0.7, 0.6, -0.1)]


def leg_rows(deg, length, knee):
    """Returns rows (x, y, z, radius) of a leg for tube(), from the body to the tip."""
    a = np.radians(deg)
    s, c = np.sin(a), np.cos(a)
    base = np.array([0.13 * s, 0.0, 0.20 + 0.16 * c])
    rows = []
    for out, y, r in ((0.00, 0.365, 0.060), (0.13, 0.375, 0.056), (0.26, 0.515, 0.054), (0.44, knee, 0.047),
                      (0.53, knee - 0.01, 0.046), (0.70, 0.50, 0.038), (0.83, 0.27, 0.033),
                      (0.91, 0.115, 0.026), (0.985, 0.040, 0.022), (1.035, 0.021, 0.019)):
        o = out * (length - 0.14)
        rows.append((base[0] + o * s, y, base[2] + o * c, r))
    return rows


def leg(q, i):
    return tube(q, leg_rows(*LEGS[i]), 3)


def prosoma(p):
    """Front part of the body, with a dent in its back."""
    d = ellipsoid(p, (0, 0.40, 0.20), (0.245, 0.165, 0.31))
    d = smin(d, ellipsoid(p, (0, 0.440, 0.36), (0.205, 0.150, 0.180)), 0.10)
    dent = ellipsoid(p, (0, 0.585, 0.10), (0.020, 0.05, 0.09))
    d = smax(d, -dent, 0.06)
    return smin(d, ellipsoid(p, (0, 0.395, -0.10), (0.085, 0.075, 0.14)), 0.05)


def abdomen(p):
    d = ellipsoid(p, (0, 0.485, -0.53), (0.345, 0.315, 0.43), rotation(8, 0, 0))
    q = mirrored(p)
    return smin(d, tube(q, [(0.045, 0.37, -0.88, 0.05), (0.050, 0.34, -0.985, 0.024)], 2), 0.05)


def jaws(p):
    q = mirrored(p)
    d = tube(q, [(0.075, 0.400, 0.46, 0.075), (0.080, 0.300, 0.540, 0.070), (0.072, 0.205, 0.530, 0.040)], 4)
    fang = tube(q, [(0.070, 0.21, 0.535, 0.028), (0.052, 0.150, 0.535, 0.020), (0.030, 0.115, 0.510, 0.012)], 3)
    return smin(d, fang, 0.02)


def palp(q):
    """Feeler beside the jaws."""
    return tube(q, [(0.130, 0.350, 0.44, 0.045), (0.215, 0.420, 0.590, 0.042), (0.240, 0.400, 0.665, 0.042),
                    (0.215, 0.255, 0.745, 0.037), (0.200, 0.180, 0.760, 0.040)], 4)


def eyes(q):
    d = np.full(len(q), 9.0)
    for c, r in EYES:
        d = np.minimum(d, sphere(q, c, r))
    return d


def field(p):
    q = mirrored(p)
    d = smin(prosoma(p), jaws(p), 0.03)
    d = smin(d, palp(q), 0.03)
    legs = np.full(len(p), 9.0)
    for i in range(4):
        legs = smin(legs, leg(q, i), 0.012)
    d = smin(d, legs, 0.035)
    d = smin(d, abdomen(p), 0.03)
    d = smin(d, eyes(q), 0.012)
    return d


def parts(p):
    q = mirrored(p)
    left = p[:, 0] > 0
    far = np.full(len(p), 9.0)
    out = [("body", np.minimum(prosoma(p), eyes(q)) - 0.004), ("abdomen", abdomen(p)),
           ("fangs", jaws(p))]
    w = palp(q)
    out += [("left_palp", np.where(left, w, far)), ("right_palp", np.where(left, far, w))]
    for i in range(4):
        w = leg(q, i) + 0.006
        out += [("left_leg_%d" % (i + 1), np.where(left, w, far)),
                ("right_leg_%d" % (i + 1), np.where(left, far, w))]
    return out


def paint(p):
    x, y, z = np.abs(p[:, 0]), p[:, 1], p[:, 2]
    q = mirrored(p)
    fuzz = 0.5 * ripple(p, 19, 0.4) + 0.5 * ripple(p, 37, 2.0)
    dark = np.array([0.205, 0.155, 0.135])
    warm = np.array([0.78, 0.40, 0.16])
    cream = np.array([0.90, 0.79, 0.60])
    c = np.broadcast_to(dark, p.shape).copy()
    # Carapace: a pale stripe along the back and a pale border.
    stripe = x - 0.040 - 0.03 * np.sin(9 * z)
    c = mix(c, warm * 0.85, step01(0.012, -0.012, stripe) * step01(0.47, 0.50, y) * step01(0.36, 0.28, z))
    # Abdomen: pale-edged chevrons on the back, plain lighter flanks.
    # They are spaced by the angle about an axis along x, so that they are also
    # straight where the abdomen curves toward the waist and the spinnerets.
    angle = np.arctan2(-(z + 0.53), np.maximum(y - 0.36, 0.01)) / np.pi
    t = 1.1 * angle + 0.42
    ab = mix((0.40, 0.26, 0.18), dark, step01(0.58, 0.28, y))
    saddle = mix(np.broadcast_to(dark * 0.8, p.shape), dark * 1.1, step01(0.2, 0.7, t))
    bar = np.abs(((t - 0.55 * np.sqrt(x * x + 0.0004)) * 5.0) % 1.0 - 0.5) - 0.15
    saddle = mix(saddle, cream, step01(0.085, 0.045, bar))
    saddle = mix(saddle, warm, step01(0.025, -0.025, bar))
    ab = mix(ab, saddle, step01(0.40, 0.45, y))
    c = mix(c, ab, step01(0.02, -0.01, abdomen(p) - prosoma(p)))
    # Legs: bands at the joints.
    best = np.full(len(p), 9.0)
    band = np.zeros(len(p))
    for i, (deg, length, knee) in enumerate(LEGS):
        a = np.radians(deg)
        along = q[:, 0] * np.sin(a) + (z - 0.20 - 0.16 * np.cos(a)) * np.cos(a) - 0.13 * np.sin(a) ** 2
        u = along / (length - 0.14)
        d = leg(q, i)
        bands = (step01(0.035, 0.020, np.abs(u - 0.30)) + step01(0.055, 0.035, np.abs(u - 0.50))
                 + step01(0.040, 0.025, np.abs(u - 0.72)) + step01(0.030, 0.018, np.abs(u - 0.87)))
        band = np.where(d < best, bands, band)
        best = np.minimum(best, d)
    other = np.minimum(np.minimum(prosoma(p), jaws(p)), abdomen(p))
    on_leg = step01(0.010, -0.006, best - other)
    c = mix(c, mix(np.broadcast_to(dark * 1.05, p.shape), warm, 0.9 * band), on_leg)
    w = palp(q)
    on_palp = step01(0.006, -0.006, w - np.minimum(other, best))
    c = mix(c, mix(warm, cream, step01(0.24, 0.19, y)), on_palp)
    j = jaws(p)
    on_jaw = step01(0.006, -0.006, j - np.minimum(np.minimum(prosoma(p), best), w))
    c = mix(c, mix(warm * 0.8, (0.07, 0.05, 0.05), step01(0.21, 0.17, y)), on_jaw)
    c *= (1 + 0.10 * fuzz)[:, None]
    face = smin(prosoma(p), j, 0.03)
    for (centre, r), gaze in zip(EYES, GAZES):
        c = paint_eye(c, p, face, centre, gaze, r, (0.17, 0.09, 0.06), 74, 50, white=(0.06, 0.045, 0.045),
                      glint=(-0.30, 0.42), rim=(0.84, 0.48, 0.20), rim_width=0.16 * r)
    return c


def build():
    m = Model("spider", "spider with eight thin legs",
              "blended ellipsoids and tubes, surface nets, painted from position in space")

    def weight(p):
        return 1 + 3 * step01(0.38, 0.15, sphere(p, (0, 0.42, 0.50), 0.0))
    return [organic(m, field, parts, paint, (-1.25, -0.05, -1.20), (1.25, 0.95, 1.32), 0.0125,
                    10000, weight, {"body": 1.5, "abdomen": 1.25, "fangs": 1.2}, shine=(0.15, 40), flat=0.08, texture=768)]
