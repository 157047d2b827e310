// Computes with vectors of one value per lane. dot and cross are written out, because the built-in ones may
// have any relative error (The OpenCL C Specification 3.0, Relative Error as ULPs).
#ifndef VECTOR_H
#define VECTOR_H

#include "numerics/numerics.h"

typedef struct {
    real x, y, z;
} Vector;

static inline Vector vector_of(scalar4 v)
{
    return (Vector){(real)(v.x), (real)(v.y), (real)(v.z)};
}

static inline Vector vector_add(Vector a, Vector b)
{
    return (Vector){a.x + b.x, a.y + b.y, a.z + b.z};
}

static inline Vector vector_subtract(Vector a, Vector b)
{
    return (Vector){a.x - b.x, a.y - b.y, a.z - b.z};
}

static inline Vector vector_scale(Vector a, real factor)
{
    return (Vector){a.x * factor, a.y * factor, a.z * factor};
}

// Returns a + b factor.
static inline Vector vector_fma(Vector b, real factor, Vector a)
{
    return (Vector){real_fma(b.x, factor, a.x), real_fma(b.y, factor, a.y), real_fma(b.z, factor, a.z)};
}

static inline Vector vector_negate(Vector a)
{
    return (Vector){-a.x, -a.y, -a.z};
}

static inline Vector vector_select(mask condition, Vector yes, Vector no)
{
    return (Vector){lanes_select(condition, yes.x, no.x), lanes_select(condition, yes.y, no.y),
                    lanes_select(condition, yes.z, no.z)};
}

// Replaces a vector in some lanes.
static inline void vector_replace(Vector *vector, mask where, Vector other)
{
    *vector = vector_select(where, other, *vector);
}

static inline real vector_dot(Vector a, Vector b)
{
    return real_fma(a.x, b.x, real_fma(a.y, b.y, a.z * b.z));
}

// Returns the dot product as if in twice the precision (Ogita, Rump, Oishi, Accurate sum and dot product,
// SIAM J. Sci. Comput. 26(6), 2005, algorithm 5.3).
static inline real vector_dot_compensated(Vector a, Vector b)
{
    Pair x = two_product(a.x, b.x), y = two_product(a.y, b.y), z = two_product(a.z, b.z);
    Pair two = two_sum(x.high, y.high), three = two_sum(two.high, z.high);
    return three.high + (((x.low + y.low) + z.low) + (two.low + three.low));
}

// Returns a x b, each component within 1.5 ulp.
static inline Vector vector_cross(Vector a, Vector b)
{
    return (Vector){difference_of_products(a.y, b.z, a.z, b.y), difference_of_products(a.z, b.x, a.x, b.z),
                    difference_of_products(a.x, b.y, a.y, b.x)};
}

static inline real vector_norm(Vector a)
{
    return real_sqrt(vector_dot(a, a));
}

// Returns the unit vector within 4.5 u where quotients and roots are correctly rounded: 1.5 u for the dot
// product's root and u each for root, quotient and product. The zero vector stays zero.
static inline Vector vector_normalize(Vector a)
{
    real norm = vector_norm(a);
    mask zero = norm == 0;
    return vector_scale(a, real_divide((real)(1), lanes_select(zero, (real)(1), norm)));
}

// Bounds the error at `certified` of a unit vector, or of its dot product with another one. It is off by
// 14.5 u, as quotients may be off by 5 u and roots by 7 u.
#define DIRECTION_ROUNDING ((real)(16 * UNIT_ROUNDOFF))

// Normalizes a vector that is a unit vector except for a rounding e, by a Newton step, whose error is e^2.
static inline Vector vector_renormalize(Vector a)
{
    if (IS_COMPENSATED) return vector_normalize(a);
    return vector_scale(a, real_fma((real)(-0.5f), vector_dot(a, a), (real)(1.5f)));
}

// Returns the 1-norm |x| + |y| + |z|, to which error bounds are proportional.
static inline real vector_norm1(Vector a)
{
    return fabs(a.x) + fabs(a.y) + fabs(a.z);
}

// Returns the sum of the magnitudes of the terms of n . a. For a unit normal n this is how far errors
// proportional to the coordinates a move a point off a surface. Errors along the surface do not.
static inline real vector_norm1_along(Vector n, Vector a)
{
    return real_fma(fabs(n.x), fabs(a.x), real_fma(fabs(n.y), fabs(a.y), fabs(n.z) * fabs(a.z)));
}

// Vectors of pairs, for compensated forms.
typedef struct {
    Pair x, y, z;
} PairVector;

static inline PairVector pair_vector_difference(Vector a, Vector b)
{
    return (PairVector){two_sum(a.x, -b.x), two_sum(a.y, -b.y), two_sum(a.z, -b.z)};
}

static inline PairVector pair_vector_of(Vector a)
{
    return (PairVector){pair_of(a.x), pair_of(a.y), pair_of(a.z)};
}

static inline Pair pair_vector_dot(PairVector a, PairVector b)
{
    return pair_add(pair_add(pair_multiply(a.x, b.x), pair_multiply(a.y, b.y)), pair_multiply(a.z, b.z));
}

static inline Pair pair_vector_dot_vector(PairVector a, Vector b)
{
    return pair_add(pair_add(pair_scale(a.x, b.x), pair_scale(a.y, b.y)), pair_scale(a.z, b.z));
}

// Returns a x b.
static inline PairVector pair_vector_cross(PairVector a, Vector b)
{
    return (PairVector){pair_subtract(pair_scale(a.y, b.z), pair_scale(a.z, b.y)),
                        pair_subtract(pair_scale(a.z, b.x), pair_scale(a.x, b.z)),
                        pair_subtract(pair_scale(a.x, b.y), pair_scale(a.y, b.x))};
}

static inline Vector pair_vector_high(PairVector a)
{
    return (Vector){a.x.high, a.y.high, a.z.high};
}

// Returns a . b rounded about once, in a third of the operations of pairs. It computes
// vector_dot_compensated of the high parts and adds the low parts' products to the errors that it sums.
static inline real pair_vector_dot_once(PairVector a, Vector b)
{
    Pair x = two_product(a.x.high, b.x), y = two_product(a.y.high, b.y), z = two_product(a.z.high, b.z);
    Pair two = two_sum(x.high, y.high), three = two_sum(two.high, z.high);
    real low = real_fma(a.x.low, b.x, real_fma(a.y.low, b.y, a.z.low * b.z));
    return three.high + ((((x.low + y.low) + z.low) + (two.low + three.low)) + low);
}

// Returns a x b, each component within 2 ulp.
static inline Vector pair_vector_cross_once(PairVector a, Vector b)
{
    Vector high = vector_cross(pair_vector_high(a), b);
    return (Vector){high.x + real_fma(a.y.low, b.z, -(a.z.low * b.y)),
                    high.y + real_fma(a.z.low, b.x, -(a.x.low * b.z)),
                    high.z + real_fma(a.x.low, b.y, -(a.y.low * b.x))};
}

// A vector whose lanes are set and read one by one.
typedef struct {
    RealLanes x, y, z;
} VectorLanes;

static inline VectorLanes vector_lanes_zero(void)
{
    return (VectorLanes){{(real)(0)}, {(real)(0)}, {(real)(0)}};
}

static inline void vector_lanes_set(VectorLanes *lanes, uint lane, scalar4 value)
{
    lanes->x.each[lane] = value.x;
    lanes->y.each[lane] = value.y;
    lanes->z.each[lane] = value.z;
}

static inline Vector vector_of_lanes(const VectorLanes *lanes)
{
    return (Vector){lanes->x.all, lanes->y.all, lanes->z.all};
}

#if LANES > 1
// Broadcasts one lane's vector to all lanes.
static inline Vector vector_of_lane(const Vector *lanes, uint lane)
{
    return (Vector){real_of_lane(&lanes->x, lane), real_of_lane(&lanes->y, lane),
                    real_of_lane(&lanes->z, lane)};
}
#endif

#endif
