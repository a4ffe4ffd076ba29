"""Area lights: rectangles and ellipses that shine to one side, through an ideal grid when their spread is narrow.

Everything is computed in the lamp's plane: u and v along its axes from the centre, h the height of the lit point.
"""

import math

from ..core.jit import device, inlined
from ..core.records import LIGHT_DELTA, LIGHT_ELLIPSE
from ..core.vec import dot, madd, put, sub, vec
from ..core.warp import disk

# A rectangle is sampled by area where it is small beside the square of its distance: there the density by area is as
# good as that by solid angle, at a quarter of the cost, and the spherical formulas lose their digits.
_FAR = 0.1


@inlined
def _axes(light):
    p = light.p
    return (p[0], p[1], p[2]), (p[4], p[5], p[6]), (p[8], p[9], p[10])


@device
def normal_of(light):
    """The direction in which the lamp shines."""
    return (light.p[8], light.p[9], light.p[10])


@inlined
def _height(light, o):
    """(u, v, height) of o in the frame of the lamp."""
    a, b, n = _axes(light)
    w = sub(o, vec(light.center))
    return dot(w, a), dot(w, b), dot(w, n)


@inlined
def spread_factor(light, cos):
    """Share of the light that passes the grid at an angle with this cosine to the normal, normalised for power."""
    norm = light.p[12]
    if norm == 0.0:
        return 1.0
    return max((light.p[11] - math.sqrt(max(1.0 - cos * cos, 0.0)) / cos) * norm, 0.0)


@inlined
def _region(light, qu, qv, h):
    """The part of the lamp worth sampling: (ellipse, centre u, centre v, width, height); width 0: nothing is seen.

    With a spread only the disk around the foot of o's perpendicular sends light to o. The smallest of the
    lamp, that disk and the rectangle about what they share is taken.
    """
    lu = light.p[3]
    lv = light.p[7]
    ellipse = 1.0 if light.flags & LIGHT_ELLIPSE else 0.0
    if light.p[12] == 0.0:
        return ellipse, 0.0, 0.0, lu, lv
    r = h * light.p[11]
    u0 = max(qu - r, -0.5 * lu)
    u1 = min(qu + r, 0.5 * lu)
    v0 = max(qv - r, -0.5 * lv)
    v1 = min(qv + r, 0.5 * lv)
    if u0 >= u1 or v0 >= v1:
        return 0.0, 0.0, 0.0, 0.0, 0.0
    shared = (u1 - u0) * (v1 - v0)
    whole = 0.25 * math.pi * lu * lv
    seen = math.pi * r * r
    if ellipse == 0.0 or shared < min(whole, seen):
        return 0.0, 0.5 * (u0 + u1), 0.5 * (v0 + v1), u1 - u0, v1 - v0
    if seen < whole:
        return 1.0, qu, qv, 2.0 * r, 2.0 * r
    return 1.0, 0.0, 0.0, lu, lv


@inlined
def _is_far(x, y, h, width, height):
    """Whether a rectangle is small as seen from (x, y, h) relative to its centre."""
    side = max(width, height)
    return side * side < _FAR * (x * x + y * y + h * h)


@inlined
def _edge_normals(x0, x1, y0, y1, h):
    """The component towards the plane of the unit normals of the four planes through o and an edge."""
    h2 = h * h
    return (
        -y0 / math.sqrt(h2 + y0 * y0),
        x1 / math.sqrt(h2 + x1 * x1),
        y1 / math.sqrt(h2 + y1 * y1),
        -x0 / math.sqrt(h2 + x0 * x0),
    )


@inlined
def _turn(x, y):
    """cos and sin of asin x + asin y."""
    cx = math.sqrt(max(1.0 - x * x, 0.0))
    cy = math.sqrt(max(1.0 - y * y, 0.0))
    return cx * cy - x * y, cx * y + cy * x


@inlined
def _solid_angle(a, b, c, d):
    """(solid angle, cos and sin of asin cd + asin da) from the edge normals.

    The solid angle is asin ab + asin bc + asin cd + asin da; adding the angles as rotations takes one arc tangent.
    """
    cos, sin = _turn(a * b, b * c)
    cos_far, sin_far = _turn(c * d, d * a)
    angle = math.atan2(cos * sin_far + sin * cos_far, cos * cos_far - sin * sin_far)
    return angle if angle >= 0.0 else angle + 2.0 * math.pi, cos_far, sin_far


@device
def rectangle_solid_angle(x0, x1, y0, y1, h):
    """Solid angle of a rectangle [x0, x1] × [y0, y1] at distance h from the plane through the eye."""
    a, b, c, d = _edge_normals(x0, x1, y0, y1, h)
    return _solid_angle(a, b, c, d)[0]


@inlined
def _rectangle_sample(x0, x1, y0, y1, h, s, t):
    """(x, y, solid angle): a point of the rectangle, uniform by solid angle (Ureña, Fajardo and King 2013)."""
    a, b, c, d = _edge_normals(x0, x1, y0, y1, h)
    solid_angle, cos_far, sin_far = _solid_angle(a, b, c, d)
    # phi: the angle up to which the slices in x fill the share s; cu: the x whose slice ends there.
    cos_s = math.cos(s * solid_angle)
    sin_s = math.sin(s * solid_angle)
    sin = sin_s * cos_far - cos_s * sin_far
    f = ((cos_s * cos_far + sin_s * sin_far) * a + c) / sin if sin != 0.0 else 1e300
    cu = min(max(math.copysign(1.0 / math.sqrt(f * f + a * a), f), -1.0), 1.0) if f != 0.0 or a != 0.0 else 1.0
    x = min(max(cu * h / math.sqrt(max(1.0 - cu * cu, 1e-20)), x0), x1)
    r2 = x * x + h * h
    z0 = y0 / math.sqrt(r2 + y0 * y0)
    z1 = y1 / math.sqrt(r2 + y1 * y1)
    z = z0 + t * (z1 - z0)
    z2 = z * z
    y = z * math.sqrt(r2 / (1.0 - z2)) if z2 < 1.0 - 1e-12 else y1
    return x, min(max(y, y0), y1), solid_angle


@inlined
def sample_area(light, o, u0, u1, ls):
    """Choose a point of an area light for o; returns the factor on its strength, 0: no sample."""
    qu, qv, h = _height(light, o)
    if h <= 0.0:
        return 0.0
    u = qu
    v = qv
    solid_angle = 0.0
    density = 1.0  # by area, 0: by solid angle
    if light.flags & LIGHT_DELTA == 0:
        ellipse, cu, cv, lu, lv = _region(light, qu, qv, h)
        if lu == 0.0:
            return 0.0
        if ellipse > 0.0:
            x, y = disk(u0, u1)
            u = cu + 0.5 * lu * x
            v = cv + 0.5 * lv * y
            density = 4.0 / (math.pi * lu * lv)
        else:
            x0 = cu - 0.5 * lu - qu
            y0 = cv - 0.5 * lv - qv
            if _is_far(qu - cu, qv - cv, h, lu, lv):
                u = cu + lu * (u0 - 0.5)
                v = cv + lv * (u1 - 0.5)
                density = 1.0 / (lu * lv)
            else:
                x, y, solid_angle = _rectangle_sample(x0, x0 + lu, y0, y0 + lv, h, u0, u1)
                u = qu + x
                v = qv + y
                density = 0.0
    su = u / light.p[3]
    sv = v / light.p[7]
    if light.flags & LIGHT_ELLIPSE:
        if su * su + sv * sv > 0.25 * (1.0 + 1e-9):
            return 0.0
    elif abs(su) > 0.5 * (1.0 + 1e-9) or abs(sv) > 0.5 * (1.0 + 1e-9):
        return 0.0
    t, factor = _put_point(light, o, u, v, h, ls)
    if light.flags & LIGHT_DELTA == 0:
        ls.pdf = density * t * t * t / h if density > 0.0 else 1.0 / solid_angle
    return factor


@inlined
def _put_point(light, o, u, v, h, ls):
    """Fill ls with the point (u, v) of the lamp's plane as seen from o at height h: (distance, factor on strength)."""
    a, b, n = _axes(light)
    p = madd(madd(vec(light.center), a, u), b, v)
    w = sub(p, o)
    t = math.sqrt(dot(w, w))
    put(ls.wi, (w[0] / t, w[1] / t, w[2] / t))
    put(ls.ng, n)
    put(ls.p, p)
    ls.distance = t
    ls.uv[0] = u / light.p[3] + 0.5
    ls.uv[1] = v / light.p[7] + 0.5
    ls.pdf = 1.0
    return t, spread_factor(light, h / t) if light.flags & LIGHT_DELTA == 0 else 1.0


@inlined
def area_density(light, d, t):
    """Density by solid angle of points uniform by area, of the one at distance t along d."""
    size = light.p[3] * light.p[7] * (0.25 * math.pi if light.flags & LIGHT_ELLIPSE else 1.0)
    return t * t / (-dot(d, normal_of(light)) * size)


@device
def place_area(light, o, x, y, ls):
    """Fill ls with the point at texture coordinates (x, y), of a beam with the one that o sees.

    Returns the factor on the lamp's strength; ls.pdf is the density of points uniform by area.
    """
    qu, qv, h = _height(light, o)
    if h <= 0.0:
        return 0.0
    if light.flags & LIGHT_DELTA:
        u = qu / light.p[3]
        v = qv / light.p[7]
        outside = u * u + v * v > 0.25 if light.flags & LIGHT_ELLIPSE else max(abs(u), abs(v)) > 0.5
        _, factor = _put_point(light, o, qu, qv, h, ls)
        return 0.0 if outside else factor
    _, factor = _put_point(light, o, (x - 0.5) * light.p[3], (y - 0.5) * light.p[7], h, ls)
    ls.pdf = area_density(light, vec(ls.wi), ls.distance)
    return factor


@device
def intersect_area(light, o, d):
    """Distance along d to the front of the lamp, -1: no hit."""
    a, b, n = _axes(light)
    cos = -dot(d, n)
    if cos <= 0.0:
        return -1.0
    qu, qv, h = _height(light, o)
    t = h / cos
    if t <= 0.0:
        return -1.0
    su = (qu + t * dot(d, a)) / light.p[3]
    sv = (qv + t * dot(d, b)) / light.p[7]
    if abs(su) > 0.5 or abs(sv) > 0.5:
        return -1.0
    if light.flags & LIGHT_ELLIPSE and su * su + sv * sv > 0.25:
        return -1.0
    return t


@device
def area_pdf(light, o, d, t):
    """Density by solid angle with which `sample_area` chooses direction d, which meets the lamp at distance t."""
    qu, qv, h = _height(light, o)
    if h <= 0.0:
        return 0.0
    ellipse, cu, cv, lu, lv = _region(light, qu, qv, h)
    if lu == 0.0:
        return 0.0
    a, b, _ = _axes(light)
    cos = h / t
    if ellipse > 0.0:
        x = 2.0 * (qu + t * dot(d, a) - cu) / lu
        y = 2.0 * (qv + t * dot(d, b) - cv) / lv
        if x * x + y * y > 1.0:
            return 0.0
        return 4.0 / (math.pi * lu * lv) * t * t / cos
    x0 = cu - 0.5 * lu - qu
    y0 = cv - 0.5 * lv - qv
    if _is_far(qu - cu, qv - cv, h, lu, lv):
        return t * t / (cos * lu * lv)
    return 1.0 / rectangle_solid_angle(x0, x0 + lu, y0, y0 + lv, h)


@device
def area_uv(light, p):
    """Texture coordinates of a point of the lamp: 0 to 1 across it."""
    a, b, _ = _axes(light)
    w = sub(p, vec(light.center))
    return dot(w, a) / light.p[3] + 0.5, dot(w, b) / light.p[7] + 0.5


@inlined
def see_area(light, ls):
    """Complete ls, of which p, wi and distance are a ray's that meets the lamp; returns the factor on its strength."""
    d, n = vec(ls.wi), normal_of(light)
    ls.pdf = area_pdf(light, vec(ls.p), d, ls.distance)
    put(ls.p, madd(vec(ls.p), d, ls.distance))
    put(ls.ng, n)
    ls.uv[0], ls.uv[1] = area_uv(light, vec(ls.p))
    return spread_factor(light, -dot(d, n))
