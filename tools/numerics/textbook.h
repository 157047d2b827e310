// Intersects rays with shapes by textbook formulas, to compare with glint's. The formulas are never
// shipped. make TEXTBOOK=1 includes them in kernels/traversal/primitives.h, which then calls them.

// The roots of a t^2 + 2 b t + c = 0 by the quadratic formula.
typedef struct {
    real near, far; // near <= far for a > 0
} TextbookRoots;

static inline TextbookRoots textbook_quadratic_roots(real inverse_a, real b, real discriminant)
{
    real root = sqrt(discriminant);
    return (TextbookRoots){(-b - root) * inverse_a, (-b + root) * inverse_a};
}

// Textbook sphere: b^2 - a c (Glassner, An introduction to ray tracing, 1989, section 2.1).
static inline mask textbook_sphere_hit(const Sphere *sphere, const Ray *ray, real *t)
{
    real radius = (real)(sphere->center_radius.w);
    Vector f = vector_subtract(ray->origin, vector_of(sphere->center_radius));
    real b = vector_dot(f, ray->direction);
    real c = vector_dot(f, f) - radius * radius;
    real discriminant = b * b - ray->squared * c;
    mask hit = RAY_ACTIVE(ray) & (discriminant >= (real)(0));
    if (!lanes_any(hit)) return hit;
    TextbookRoots roots = textbook_quadratic_roots(ray->inverse_squared, b, discriminant);
    *t = sphere->id.y & IGNORES_FRONT_FACES ? roots.far : ray_first(ray, roots.near, roots.far);
    return hit & (*t > ray->tmin);
}

// Textbook plane: a ray whose direction's product with the normal is at most a millionth does not hit it
// (Glassner, An introduction to ray tracing, 1989, section 2.2; here neither is normalized).
static inline mask textbook_plane_crossing(Vector point, Vector normal, const Ray *ray, real *t)
{
    real along = vector_dot(normal, ray->direction);
    *t = vector_dot(normal, vector_subtract(point, ray->origin)) / along;
    return RAY_ACTIVE(ray) & (fabs(along) > (real)(1e-6f)) & (*t > ray->tmin);
}

static inline mask textbook_plane_hit(const Plane *plane, const Ray *ray, real *t)
{
    return textbook_plane_crossing(vector_of(plane->point), vector_of(plane->normal), ray, t);
}

// Textbook disc: the plane, then the crossing's distance from the center.
static inline mask textbook_disc_hit(const Disc *disc, const Ray *ray, real *t)
{
    Vector center = vector_of(disc->center_radius);
    real radius = (real)(disc->center_radius.w);
    mask hit = textbook_plane_crossing(center, vector_of(disc->normal), ray, t);
    Vector from_center = vector_subtract(ray_point(ray, *t), center);
    return hit & (vector_dot(from_center, from_center) <= radius * radius);
}

// Textbook box: slabs, by division (Kay, Kajiya, Ray tracing complex scenes, SIGGRAPH 1986). Zeros in the
// direction yield infinities.
static inline TextbookRoots textbook_slab_crossings(real low, real high, real origin, real direction)
{
    real to_low = (low - origin) / direction, to_high = (high - origin) / direction;
    return (TextbookRoots){real_min(to_low, to_high), real_max(to_low, to_high)};
}

static inline mask textbook_box_hit(const Box *box, const Ray *ray, real *t)
{
    TextbookRoots x =
        textbook_slab_crossings((real)(box->low.x), (real)(box->high.x), ray->origin.x, ray->direction.x);
    TextbookRoots y =
        textbook_slab_crossings((real)(box->low.y), (real)(box->high.y), ray->origin.y, ray->direction.y);
    TextbookRoots z =
        textbook_slab_crossings((real)(box->low.z), (real)(box->high.z), ray->origin.z, ray->direction.z);
    real near = real_max(real_max(x.near, y.near), z.near);
    real far = real_min(real_min(x.far, y.far), z.far);
    *t = ray_first(ray, near, far);
    return RAY_ACTIVE(ray) & (near <= far) & (*t > ray->tmin);
}

// Textbook cylinder and cone: |p|^2 - (p . w)^2 = (R + k p . w)^2 for a unit axis w, b^2 - a c, and separate
// caps (Glassner, An introduction to ray tracing, 1989, section 2.3; Heckbert, Ray tracing, 1989).
typedef struct {
    real t;
    mask found;
} TextbookNearest;

static inline void textbook_nearest_update(TextbookNearest *nearest, const Ray *ray, real t, mask counts)
{
    mask closer = counts & (t > ray->tmin) & (!nearest->found | (t < nearest->t));
    nearest->t = lanes_select(closer, t, nearest->t);
    nearest->found = nearest->found | closer;
}

typedef struct {
    Vector axis; // unit
    real radius, slope, height;
} TextbookRevolutionBody;

static inline TextbookRevolutionBody textbook_revolution_body(const Revolution *shape)
{
    real inverse = (real)(1 / shape->range.y);
    return (TextbookRevolutionBody){vector_scale(vector_of(shape->axis_slope), inverse),
                                    (real)(shape->base_radius.w) * inverse, (real)(shape->axis_slope.w),
                                    (real)(shape->range.x) * inverse};
}

static inline mask textbook_revolution_hit(const Revolution *shape, bool sloped, const Ray *ray, real *t)
{
    TextbookRevolutionBody body = textbook_revolution_body(shape);
    Vector f = vector_subtract(ray->origin, vector_of(shape->base_radius));
    real rise = vector_dot(ray->direction, body.axis), start = vector_dot(f, body.axis);
    real growth = sloped ? body.slope * rise : (real)(0);
    real radius = sloped ? body.radius + body.slope * start : body.radius;
    real a = ray->squared - rise * rise - growth * growth;
    real b = vector_dot(f, ray->direction) - start * rise - radius * growth;
    real c = vector_dot(f, f) - start * start - radius * radius;
    real discriminant = b * b - a * c;
    mask hit = RAY_ACTIVE(ray) & (discriminant >= (real)(0));
    TextbookRoots roots = textbook_quadratic_roots((real)(1) / a, b, discriminant);
    bool finite = shape->id.y & REVOLUTION_FINITE, capped = shape->id.y & REVOLUTION_CAPPED;

    TextbookNearest nearest = {*t, mask_none()};
    real near_height = start + roots.near * rise, far_height = start + roots.far * rise;
    mask near_valid = hit, far_counts = hit;
    if (finite) {
        near_valid = hit & (near_height >= (real)(0)) & (near_height <= body.height);
        far_counts = hit & (far_height >= (real)(0)) & (far_height <= body.height);
    }
    if (!(shape->id.y & IGNORES_FRONT_FACES) || capped)
        textbook_nearest_update(&nearest, ray, roots.near, near_valid);
    textbook_nearest_update(&nearest, ray, roots.far, far_counts);
    if (capped) {
        for (uint end = 0; end < 2; end++) {
            real height = end ? body.height : (real)(0);
            real end_radius = sloped ? body.radius + body.slope * height : body.radius;
            real to_end = (height - start) / rise;
            Vector p = vector_fma(ray->direction, to_end, f);
            real squared = vector_dot(p, p) - height * height;
            textbook_nearest_update(&nearest, ray, to_end,
                                    RAY_ACTIVE(ray) & (squared <= end_radius * end_radius));
        }
    }
    *t = nearest.t;
    return nearest.found;
}

static inline mask textbook_cylinder_hit(const Cylinder *cylinder, const Ray *ray, real *t)
{
    return textbook_revolution_hit(cylinder, false, ray, t);
}

static inline mask textbook_cone_hit(const Cone *cone, const Ray *ray, real *t)
{
    return textbook_revolution_hit(cone, true, ray, t);
}

// Textbook torus: the quartic in t from the ray's start, by Ferrari (Schwarze, Cubic and quartic roots,
// Graphics Gems, 1990; its threshold of 1e-9 for zero is used only where the resolvent splits the quartic).
static inline mask textbook_is_zero(real x)
{
    return fabs(x) < (real)(1e-9f);
}

// Returns a real root of x^3 + a x^2 + b x + c.
static inline real textbook_cubic_root(real a, real b, real c)
{
    const real third = (real)(1.0f / 3);
    real aa = a * a;
    real p = third * (b - third * aa);
    real q = (real)(0.5f) * ((real)(2.0f / 27) * a * aa - third * a * b + c);
    real ppp = p * p * p;
    real discriminant = q * q + ppp;
    // three real roots
    real ratio = -q / sqrt(lanes_select(ppp < (real)(0), -ppp, (real)(1)));
    real three = (real)(2) * sqrt(real_max(-p, (real)(0))) *
                 cos(third * acos(real_min(real_max(ratio, (real)(-1)), (real)(1))));
    // one
    real root = sqrt(real_max(discriminant, (real)(0)));
    real one = cbrt(root - q) - cbrt(root + q);
    return lanes_select(discriminant < (real)(0), three, one) - third * a;
}

// Pushes the real roots of y^2 + b y + c, plus `shift`.
static inline void textbook_quadratic_push(real b, real c, real shift, mask counts, const Ray *ray,
                                           TextbookNearest *nearest)
{
    real half_b = (real)(0.5f) * b;
    real discriminant = half_b * half_b - c;
    TextbookRoots roots = textbook_quadratic_roots((real)(1), half_b, real_max(discriminant, (real)(0)));
    mask real_roots = counts & (discriminant >= (real)(0));
    textbook_nearest_update(nearest, ray, roots.near - shift, real_roots);
    textbook_nearest_update(nearest, ray, roots.far - shift, real_roots);
}

static inline mask textbook_torus_hit(const Torus *torus, const Ray *ray, real *t)
{
    Vector axis = vector_of(torus->axis_minor);
    real major = (real)(torus->center_major.w), minor = (real)(torus->axis_minor.w);
    // |direction| = 1 makes the quartic's first coefficient 1
    real norm = sqrt(ray->squared), inverse_length = (real)(1) / norm;
    Vector d = vector_scale(ray->direction, inverse_length);
    Vector f = vector_subtract(ray->origin, vector_of(torus->center_major));
    real m = vector_dot(f, d), n = vector_dot(f, f);
    real z = vector_dot(f, axis), dz = vector_dot(d, axis);
    real k = n + major * major - minor * minor, four = (real)(4) * major * major;
    real a = (real)(4) * m;
    real b = (real)(4) * m * m + (real)(2) * k - four * ((real)(1) - dz * dz);
    real c = (real)(4) * m * k - (real)(2) * four * (m - z * dz);
    real e = k * k - four * (n - z * z);

    // x^4 + p x^2 + q x + r with x = t + a / 4
    real aa = a * a;
    real p = b - (real)(3.0f / 8) * aa;
    real q = (real)(1.0f / 8) * aa * a - (real)(0.5f) * a * b + c;
    real r = (real)(-3.0f / 256) * aa * aa + (real)(1.0f / 16) * aa * b - (real)(0.25f) * a * c + e;
    real shift = (real)(0.25f) * a;

    // two quadratics by a root of the resolvent cubic
    real y = textbook_cubic_root((real)(-0.5f) * p, -r, (real)(0.5f) * r * p - (real)(1.0f / 8) * q * q);
    real u = y * y - r, v = (real)(2) * y - p;
    mask splits =
        RAY_ACTIVE(ray) & (textbook_is_zero(u) | (u > (real)(0))) & (textbook_is_zero(v) | (v > (real)(0)));
    u = sqrt(real_max(u, (real)(0)));
    v = sqrt(real_max(v, (real)(0)));
    v = lanes_select(q < (real)(0), -v, v);
    Ray unit = *ray;
    unit.tmin = ray->tmin * norm;
    TextbookNearest nearest = {*t, mask_none()};
    textbook_quadratic_push(v, y - u, shift, splits, &unit, &nearest);
    textbook_quadratic_push(-v, y + u, shift, splits, &unit, &nearest);
    *t = nearest.t * inverse_length;
    return nearest.found;
}

// Textbook triangle (Moller, Trumbore, Fast, minimum storage ray-triangle intersection, Journal of Graphics
// Tools 2(1), 1997, with its threshold of 1e-6).
static inline mask textbook_triangle_hit(const Triangle *triangle, const Ray *ray, real *t)
{
    Vector a = vector_of(triangle->a);
    Vector ab = vector_subtract(vector_of(triangle->b), a), ac = vector_subtract(vector_of(triangle->c), a);
    Vector p = vector_cross(ray->direction, ac);
    real determinant = vector_dot(ab, p);
    real inverse = (real)(1) / determinant;
    Vector f = vector_subtract(ray->origin, a);
    real u = vector_dot(f, p) * inverse;
    Vector q = vector_cross(f, ab);
    real v = vector_dot(ray->direction, q) * inverse;
    *t = vector_dot(ac, q) * inverse;
    mask hit = RAY_ACTIVE(ray) & (fabs(determinant) > (real)(1e-6f));
    return hit & (u >= (real)(0)) & (v >= (real)(0)) & (u + v <= (real)(1)) & (*t > ray->tmin);
}

// Shapes without a textbook formula keep glint's.
#define sphere_hit   textbook_sphere_hit
#define plane_hit    textbook_plane_hit
#define disc_hit     textbook_disc_hit
#define box_hit      textbook_box_hit
#define cylinder_hit textbook_cylinder_hit
#define cone_hit     textbook_cone_hit
#define torus_hit    textbook_torus_hit
#define triangle_hit textbook_triangle_hit
