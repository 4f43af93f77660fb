"""Signed distance functions of which the organic models are made, and functions to paint them.

Every function takes points as an (n, 3) array and returns n distances,
negative inside.  Distances need only be roughly right (the polygoniser and
the projection divide by the gradient), but they must be smooth.
"""
import numpy as np


def smin(a, b, k):
    """Smooth minimum: the union of two shapes, blended where distances differ by less than k."""
    if k <= 0:
        return np.minimum(a, b)
    h = np.maximum(k - np.abs(a - b), 0.0) / k
    return np.minimum(a, b) - h * h * (k * 0.25)


def smax(a, b, k):
    """Smooth maximum: the blended intersection.  smax(a, -b, k) subtracts b from a."""
    return -smin(-a, -b, k)


def soft_abs(x, e=0.02):
    """Smooth |x|, so that mirrored parts meet without a crease."""
    return np.sqrt(x * x + e * e)


def mirrored(p, e=0.0):
    """Returns the points mirrored into the half space x >= 0."""
    q = p.copy()
    q[:, 0] = soft_abs(p[:, 0], e) if e > 0 else np.abs(p[:, 0])
    return q


def rotation(rx=0.0, ry=0.0, rz=0.0):
    """Returns the rotation by these angles in degrees, about x first, then y, then z."""
    ax, ay, az = np.radians([rx, ry, rz])
    cx, sx, cy, sy, cz, sz = (np.cos(ax), np.sin(ax), np.cos(ay), np.sin(ay),
                              np.cos(az), np.sin(az))
    mx = np.array([[1, 0, 0], [0, cx, -sx], [0, sx, cx]])
    my = np.array([[cy, 0, sy], [0, 1, 0], [-sy, 0, cy]])
    mz = np.array([[cz, -sz, 0], [sz, cz, 0], [0, 0, 1]])
    return mz @ my @ mx


def local(p, centre, rot=None):
    """Returns the points in the coordinates of a primitive."""
    q = p - np.asarray(centre, float)
    return q if rot is None else q @ rot


def sphere(p, centre, r):
    q = p - np.asarray(centre, float)
    return np.sqrt((q * q).sum(1)) - r


def ellipsoid(p, centre, radii, rot=None):
    """First-order distance to an ellipsoid: f (f - 1) / |grad|."""
    q = local(p, centre, rot)
    r = np.asarray(radii, float)
    a = q / r
    b = a / r
    k0 = np.sqrt((a * a).sum(1))
    k1 = np.sqrt((b * b).sum(1))
    return np.where(k1 > 1e-9, k0 * (k0 - 1.0) / np.maximum(k1, 1e-9), -r.min())


def capsule(p, a, b, ra, rb):
    """Capsule whose radius runs from ra to rb."""
    a = np.asarray(a, float)
    ab = np.asarray(b, float) - a
    q = p - a
    t = np.clip(q @ ab / (ab @ ab), 0.0, 1.0)
    q = q - t[:, None] * ab
    return np.sqrt((q * q).sum(1)) - (ra + (rb - ra) * t)


def spline(rows, n):
    """Returns points of a Catmull-Rom spline through rows (of any width), n pieces between two rows."""
    r = np.asarray(rows, float)
    r = np.vstack([2 * r[0] - r[1], r, 2 * r[-1] - r[-2]])
    out = []
    for i in range(1, len(r) - 2):
        for t in np.arange(n) / n:
            out.append(0.5 * (2 * r[i] + (r[i + 1] - r[i - 1]) * t
                              + (2 * r[i - 1] - 5 * r[i] + 4 * r[i + 1] - r[i + 2]) * t * t
                              + (3 * r[i] - r[i - 1] - 3 * r[i + 1] + r[i + 2]) * t ** 3))
    out.append(r[-2])
    return np.array(out)


def tube(p, rows, n=4):
    """Tube along the spline through rows of (x, y, z, radius)."""
    s = spline(rows, n)
    d = np.full(len(p), np.inf)
    for u, v in zip(s[:-1], s[1:]):
        d = np.minimum(d, capsule(p, u[:3], v[:3], u[3], v[3]))
    return d


def gradient(field, p, e):
    """Gradient by central differences of step e."""
    g = np.empty_like(p)
    for axis in range(3):
        step = np.zeros(3)
        step[axis] = e
        g[:, axis] = (field(p + step) - field(p - step)) / (2 * e)
    return g


# -- colours ----------------------------------------------------------------

def step01(lo, hi, x):
    """Smooth step from 0 at lo to 1 at hi (lo > hi steps down)."""
    t = np.clip((x - lo) / (hi - lo), 0.0, 1.0)
    return t * t * (3 - 2 * t)


def mix(a, b, t):
    """Blend colours (n, 3) or (3,) by weights (n,)."""
    t = np.asarray(t)[:, None]
    return np.asarray(a) * (1 - t) + np.asarray(b) * t


def curve(x, at, values):
    """Cubic curve through `values` at `at`, monotone between them: without overshoot."""
    at, values = np.asarray(at, float), np.asarray(values, float)
    slope = np.diff(values) / np.diff(at)
    tangent = np.zeros(len(at))
    is_monotone = slope[:-1] * slope[1:] > 0
    tangent[1:-1][is_monotone] = 2 * (slope[:-1] * slope[1:])[is_monotone] / (slope[:-1] + slope[1:])[is_monotone]
    tangent[0], tangent[-1] = slope[0], slope[-1]
    x = np.clip(x, at[0], at[-1])
    i = np.clip(np.searchsorted(at, x, side="right") - 1, 0, len(at) - 2)
    h = at[i + 1] - at[i]
    t = (x - at[i]) / h
    return (values[i] * (1 + 2 * t) * (1 - t) ** 2 + tangent[i] * h * t * (1 - t) ** 2
            + values[i + 1] * t * t * (3 - 2 * t) + tangent[i + 1] * h * t * t * (t - 1))


def ripple(p, f, seed=0.0):
    """Smooth variation in -1..1: the mean of four sine waves in different directions."""
    x, y, z = p[:, 0] * f, p[:, 1] * f, p[:, 2] * f
    return (np.sin(1.7 * x + 2.3 * y + seed) + np.sin(2.9 * y - 1.3 * z + 2 * seed + 1)
            + np.sin(2.1 * z + 1.9 * x + 3 * seed + 2)
            + np.sin(3.1 * x - 2.7 * z + 1.1 * y + seed)) * 0.25


def paint_eye(colour, p, rest, centre, gaze, r, iris, iris_deg, pupil_deg,
              white=(0.96, 0.95, 0.92), glint=(0.30, 0.42), rim=(0.16, 0.09, 0.07),
              rim_width=0.012, glint_deg=9.5):
    """Paints the eyeballs of a symmetric face: white, iris with a dark ring,
    pupil, highlight, and a rim where the ball leaves the face.

    rest: distance to the face without its eyes; a point nearer to the ball
    than to the rest lies on the eye.  centre, gaze: of the eye at +x.
    glint: offset of the highlight from the gaze, sideways (+x) and up, to the
    same side on both eyes.  *_deg: radii as angles at the eye's centre."""
    flip = np.where(p[:, 0] < 0, -1.0, 1.0)
    q = p.copy()
    q[:, 0] = np.abs(p[:, 0])
    q = q - np.asarray(centre, float)
    dist = np.sqrt((q * q).sum(1))
    u = q / np.maximum(dist, 1e-9)[:, None]
    g = np.asarray(gaze, float) / np.linalg.norm(gaze)
    side = np.cross([0, 1, 0], g)
    side /= np.linalg.norm(side)
    up = np.cross(g, side)
    ang = np.degrees(np.arccos(np.clip(u @ g, -1, 1)))
    eye = np.broadcast_to(np.asarray(white, float), p.shape).copy()
    eye = mix(eye, np.asarray(white) * [0.72, 0.68, 0.68], step01(iris_deg + 4, 80, ang))
    iris_rgb = np.asarray(iris, float)
    iris_colour = iris_rgb * (0.85 + 0.35 * step01(0.5, -0.8, u @ up))[:, None]     # brighter below
    iris_colour = mix(iris_colour, iris_rgb * 0.35, step01(iris_deg * 0.80, iris_deg, ang))
    eye = mix(eye, iris_colour, step01(iris_deg + 1.6, iris_deg - 1.6, ang))
    eye = mix(eye, (0.03, 0.025, 0.03), step01(pupil_deg + 1.6, pupil_deg - 1.6, ang))
    for sx, sy, size, bright in ((glint[0], glint[1], glint_deg, 1.0),
                                 (-glint[0] * 0.9, -glint[1] * 0.8, glint_deg * 0.42, 0.55)):
        a = u @ side - sx * flip
        b = u @ up - sy
        a = np.degrees(np.sqrt(a * a + b * b))
        eye = mix(eye, (1.0, 1.0, 1.0), bright * step01(size + 1.6, size - 1.6, a) * step01(90, 80, ang))
    face_distance = dist - r - rest
    colour = mix(colour, rim, step01(rim_width * 1.4, rim_width * 0.6, np.abs(face_distance)) * step01(r * 1.6, r * 1.3, dist))
    return mix(colour, eye, step01(0.002, -0.004, face_distance) * step01(r * 1.35, r * 1.2, dist))
