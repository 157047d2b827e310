"""The random rays and meshes of host/verify/families.c, by the same operations in the same order: only + - * /
and sqrt, which are correctly rounded in C and here."""

import struct
from math import sqrt

MASK = 2**64 - 1


def mixed(state):
    """The finalizer of splitmix64 (Steele, Lea, Flood, Fast splittable pseudorandom number generators, 2014)."""
    state = (state ^ state >> 30) * 0xBF58476D1CE4E5B9 & MASK
    state = (state ^ state >> 27) * 0x94D049BB133111EB & MASK
    return state ^ state >> 31


def random(seed, index, place):
    state = ((seed << 40) + index * 32 + place + 1) * 0x9E3779B97F4A7C15 & MASK
    return (mixed(state) >> 11) * 2.0**-53


def symmetric(seed, index, place):
    return 2.0 * random(seed, index, place) - 1.0


def choice(seed, index, place, count):
    return int(random(seed, index, place) * count)


def fma3(a, x, b, y, c, z, d):
    """a x + b y + c z + d for vectors x, y, z, d: the order of the sums is the C text's."""
    return [a * p + b * q + c * r + s for p, q, r, s in zip(x, y, z, d)]


def dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def unit(a):
    size = sqrt(dot(a, a))
    return [x / size for x in a]


def toward(origin, target):
    return origin, [b - a for a, b in zip(origin, target)]


def on_circle(turn):
    """A point of the unit circle, by its rational parametrization."""
    quarter = int(turn * 4.0)
    w = turn * 4.0 - quarter
    c, s = (1.0 - w * w) / (1.0 + w * w), 2.0 * w / (1.0 + w * w)
    return ((c, s), (-s, c), (-c, -s), (s, -c))[quarter]


ORIGIN = [0.0, 0.0, 0.0]


def disc_rim(i):
    center, e, f = [10.0, 20.0, 30.0], unit([1.0, -1.0, 0.0]), unit([1.0, 1.0, -2.0])
    distance = (5.0, 500.0, 5e4)[i % 3]
    w = unit([symmetric(3, i, 0), symmetric(3, i, 1), symmetric(3, i, 2)])
    steps = 1 + choice(3, i, 3, 64)
    radius = 2.0 * (1.0 + (1 if random(3, i, 4) < 0.5 else -1) * steps * 2.0**-22)
    c, s = on_circle(random(3, i, 5))
    target = fma3(radius * c, e, radius * s, f, 0.0, ORIGIN, center)
    return toward(fma3(distance, w, 0.0, ORIGIN, 0.0, ORIGIN, center), target)


def in_room(i):
    axis = choice(5, i, 0, 3)
    target = [1.0 if random(5, i, 1 + k) < 0.5 else -1.0 for k in range(3)]
    if i % 3 != 1:
        target[axis] = symmetric(5, i, 4)
    if i % 3 == 2:
        target[(axis + 1) % 3] = symmetric(5, i, 5)
    return toward([0.1, 0.2, 0.3], target)


def cylinder_rim(i):
    base, w = [5.0, 5.0, 5.0], [1.0 / 3.0, 2.0 / 3.0, 2.0 / 3.0]
    e, f = [2.0 / 3.0, 1.0 / 3.0, -2.0 / 3.0], [2.0 / 3.0, -2.0 / 3.0, 1.0 / 3.0]
    outside = i % 2 == 1
    pull = 1e-5 if outside else 0.0
    height = pull if random(14, i, 0) < 0.5 else 2.0 - pull
    c, s = on_circle(random(14, i, 1))
    radius = 1.0 - pull
    target = fma3(radius * c, e, radius * s, f, height, w, base)
    inner = fma3(1.0, w, 0.0, ORIGIN, 0.0, ORIGIN, base)
    if not outside:
        return toward(inner, target)
    away = unit([symmetric(14, i, 2), symmetric(14, i, 3), symmetric(14, i, 4)])
    return toward(fma3(5.0, away, 0.0, ORIGIN, 0.0, ORIGIN, inner), target)


def along_torus_axis(i):
    return [1.3 * symmetric(22, i, 0), 1.3 * symmetric(22, i, 1), 10.0], [0.0, 0.0, -1.0]


def across_torus(i):
    return [-5.0, 1.3 * symmetric(23, i, 0), 1e-6 * symmetric(23, i, 1)], [1.0, 0.0, 0.0]


# A triangle with sides of 11.2, 10.1 and 1.4 across the normal (1, 2, 2) / 3.
SLIVER = [[1.0, 2.0, 3.0], [8.5, 5.7, -4.5], [7.5, 5.8, -3.6]]


def beside_sliver(i):
    a, b, c = SLIVER
    ab, ac = toward(a, b)[1], toward(a, c)[1]
    n = unit([ab[1] * ac[2] - ab[2] * ac[1], ab[2] * ac[0] - ab[0] * ac[2], ab[0] * ac[1] - ab[1] * ac[0]])
    e = unit(ab)
    f = [n[1] * e[2] - n[2] * e[1], n[2] * e[0] - n[0] * e[2], n[0] * e[1] - n[1] * e[0]]
    c, s = on_circle(random(34, i, 0))
    d = unit(fma3(c, e, s, f, 0.009076, n, ORIGIN))
    u, v = random(34, i, 1), 0.3 * symmetric(34, i, 2)
    target = fma3(u, ab, v, ac, 0.0, ORIGIN, a)
    return fma3(-100.0, d, 0.0, ORIGIN, 0.0, ORIGIN, target), d


def jittered(vertex):
    """Off the unit sphere by up to a fifth, by the vertex' own bits: the same wherever it is met."""
    state = 31
    for x in vertex:
        state = mixed(state + struct.unpack("<Q", struct.pack("<d", x + 0.0))[0] & MASK)
    size = 1.0 + 0.2 * (2.0 * ((state >> 11) * 2.0**-53) - 1.0)
    return [size * x for x in vertex]


def split(a, b, c, depth, found):
    if depth == 0:
        found.append([jittered(a), jittered(b), jittered(c)])
        return
    ab, bc, ca = (unit([x + y for x, y in zip(*pair)]) for pair in ((a, b), (b, c), (c, a)))
    for corner in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)):
        split(*corner, depth - 1, found)


ICOSAHEDRON = (
    (0, 11, 5), (0, 5, 1), (0, 1, 7), (0, 7, 10), (0, 10, 11), (1, 5, 9), (5, 11, 4), (11, 10, 2), (10, 7, 6), (7, 1, 8),
    (3, 9, 4), (3, 4, 2), (3, 2, 6), (3, 6, 8), (3, 8, 9), (4, 9, 5), (2, 4, 11), (6, 2, 10), (8, 6, 7), (9, 8, 1),
)  # fmt: skip


def icosphere():
    g = (1.0 + sqrt(5.0)) / 2.0
    corners = [[-1.0, g, 0.0], [1.0, g, 0.0], [-1.0, -g, 0.0], [1.0, -g, 0.0]]
    corners += [[0.0, -1.0, g], [0.0, 1.0, g], [0.0, -1.0, -g], [0.0, 1.0, -g]]
    corners += [[g, 0.0, -1.0], [g, 0.0, 1.0], [-g, 0.0, -1.0], [-g, 0.0, 1.0]]
    corners = [unit(corner) for corner in corners]
    found = []
    for a, b, c in ICOSAHEDRON:
        split(corners[a], corners[b], corners[c], 5, found)
    return found


def from_within(mesh, i):
    point = choice(31, i, 0, 100)
    origin = [0.17 * symmetric(32, point, k) for k in range(3)]
    corners = mesh[choice(31, i, 1, len(mesh))]
    first = choice(31, i, 2, 3)
    a, b, c = corners[first], corners[(first + 1) % 3], corners[(first + 2) % 3]
    u, v = 0.0, 0.0
    if i % 5 < 2:
        u = random(31, i, 3)
    elif i % 5 == 4:
        u = random(31, i, 3)
        v = (1.0 - u) * random(31, i, 4)
    target = fma3(u, toward(a, b)[1], v, toward(a, c)[1], 0.0, ORIGIN, a)
    return toward(origin, target)
