#include "host/compile/rounding.h"

Quad3 exact_from_eye(const Rounding *rounding, Vector3 point)
{
    return quad3_subtract(quad3(point), quad3(rounding->eye));
}

// The rounding of the point and that of the kernels' sum n . (p - o) are each at most some u of the sum of
// |n p| over the axes.
Vector3 plane_point_from_eye(const Rounding *rounding, Vector3 point, Vector3 normal)
{
    if (rounding->is_double && !rounding->has_eye && !rounding->certifies)
        return point; // exact, and so is the kernels' sum
    const Quad3 from_eye = exact_from_eye(rounding, point), n = quad3(axis_scaled(normal));
    const Quad height = quad3_dot(n, from_eye);
    if (quad3_dot_magnitude(n, from_eye) <= 4 * quad_absolute(height)) return point_from_eye(rounding, point);
    return vector_rounded(rounding, quad3_rounded(quad3_scale(n, height / quad3_dot(n, n))));
}

scalar4 normal_and_inverse_length(const Rounding *rounding, Vector3 normal)
{
    Vector3 scaled = vector_rounded(rounding, axis_scaled(normal));
    return scalar4_of(scaled, 1 / vector_length(scaled));
}
