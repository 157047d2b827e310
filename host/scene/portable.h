// Functions of a double whose results do not depend on the processor, so that a scene has the same flat
// arrays everywhere. The C library's functions for double differ in the last bit between processors, and on
// one processor between instruction sets. Its functions of 113 bits, rounded to double, give the nearest
// double in all but about one case of 2^59.
#pragma once

#include "host/scene/quad.h"
#include "host/scene/vector.h"

static inline double portable_sine(double angle)
{
    return (double)QUAD_CALL(sin)((Quad)angle);
}

static inline double portable_cosine(double angle)
{
    return (double)QUAD_CALL(cos)((Quad)angle);
}

static inline double portable_tangent(double angle)
{
    return (double)QUAD_CALL(tan)((Quad)angle);
}

static inline double portable_arccosine(double cosine)
{
    return (double)QUAD_CALL(acos)((Quad)cosine);
}

// Returns the angle of the point (x, y) from the x axis, from -pi to pi.
static inline double portable_angle(double y, double x)
{
    return (double)QUAD_CALL(atan2)((Quad)y, (Quad)x);
}

// Returns a vector turned about a unit axis by an angle in radians, right-handed (Rodrigues, 1840).
static inline Vector3 vector_rotated(Vector3 v, Vector3 axis, double angle)
{
    const double cosine = portable_cosine(angle);
    const Vector3 along = vector_scale(axis, vector_dot(axis, v) * (1 - cosine));
    const Vector3 across = vector_scale(vector_cross(axis, v), portable_sine(angle));
    return vector_add(vector_add(vector_scale(v, cosine), across), along);
}

// Returns a vector turned about a unit axis by an angle in degrees, counterclockwise as seen from the axis'
// tip.
static inline Vector3 vector_turned(Vector3 v, Vector3 axis, double degrees)
{
    return vector_rotated(v, axis, fmod(degrees, 360) * (M_PI / 180));
}

static inline double portable_log2(double value)
{
    return (double)QUAD_CALL(log2)((Quad)value);
}

// Returns exp(value) within 2^-50 for values up to 700, or 0 below -700. Evaluates a Taylor polynomial of the
// remainder modulo ln 2, whose operations have the same result everywhere, in a hundredth of the time of a
// Quad's exponential.
static inline double portable_exponential(double value)
{
    if (value < -700) return 0;
    const double turns = rint(value * M_LOG2E);
    const double rest =
        (value - turns * 0x1.62e42fefap-1) - turns * 0x1.cf79abc9e3b3ap-40; // ln 2 in two parts
    double power = 1;
    for (int i = 14; i > 0; i--)
        power = 1 + power * rest / i;
    return ldexp(power, (int)turns);
}

static inline double portable_power(double base, double exponent)
{
    return (double)QUAD_CALL(pow)((Quad)base, (Quad)exponent);
}
