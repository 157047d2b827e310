// Defines packet width and precision. A work-item traces packets of LANES rays, one per lane.
//
// Above this file, code reads like the scalar algorithm, with a mask where that would branch. A mask is the
// result of a comparison: 0/1 for one lane, 0/-1 for more. `&`, `|` and `!` work on both. Operators widen
// scalars to all lanes. Arguments of functions need a cast. Constants need the suffix f unless they exist
// only at double.
//
// The host defines these macros before the text (prelude_of in host/render/pass.c):
//     LANES            1, 4, 8 or 16
//     IS_OUT_OF_LINE   1 if the compiler cannot build kernels with large functions inlined (OUT_OF_LINE)
//     IS_STRICT, IS_DOUBLE    the precision, at most one of them 1
//     IS_CERTIFIED     1: every decision has a bound on its error (shapes/certain.h)
//     IS_PIXEL_LIST    1: renders a list of pixels instead of a band (film.h)
//     REPAIRS_DIVIDE   1 at `strict` if the device's division and square root are inexact (numerics.h)
//     HAS_FMA          0 if the device emulates fma (pair.h)
//     PENDING_MAX      the most pending refracted rays (shading/path.h)
//     STACK_CAPACITY   the most pending children of BVH nodes (traversal/stack.h)
//     IS_COUNTING      1: rays are counted
//     PERTURB          1: errors are simulated, by PERTURB_SEED and PERTURB_SCALE (perturb.h)
//     HAS_<feature>    0 or 1 for each feature of features.h
#ifndef LANES_H
#define LANES_H

#pragma OPENCL FP_CONTRACT OFF

#if IS_DOUBLE
#pragma OPENCL EXTENSION cl_khr_fp64 : enable
typedef double scalar;
typedef double4 scalar4;
typedef long scalar_integer;
#define REAL_BASE        double
#define INTEGER_BASE     long
#define UNIT_ROUNDOFF    0x1p-53
#define EXPONENT_SHIFT   52
#define BITS_OF_ONE      0x3ff0000000000000L
#define INFINITY_BITS    0x7ff0000000000000L
#define LARGEST          DBL_MAX
#define INTEGER_MAX      0x7fffffffffffffffL
#define scalar_from_bits as_double
#define SMALLEST_RATIO   0x1p-1000
#else
typedef float scalar;
typedef float4 scalar4;
typedef int scalar_integer;
#define REAL_BASE        float
#define INTEGER_BASE     int
#define UNIT_ROUNDOFF    0x1p-24f
#define EXPONENT_SHIFT   23
#define BITS_OF_ONE      0x3f800000
#define INFINITY_BITS    0x7f800000
#define LARGEST          FLT_MAX
#define INTEGER_MAX      0x7fffffff
#define scalar_from_bits as_float
#define SMALLEST_RATIO   0x1p-120f
#endif

// For large functions that have several callers and little live state, which would be compiled once per copy
// if they were inlined, and for the bodies of kernels, of which PoCL compiles three, one per form of launch.
// GPUs would pass the functions' structs through memory, so there the functions are inlined unless the
// compiler cannot build so large a body (IS_OUT_OF_LINE).
#if LANES == 1 && !IS_OUT_OF_LINE
#define OUT_OF_LINE inline
#else
#define OUT_OF_LINE __attribute__((noinline))
#endif

// Forces inlining where constant arguments, or results that the caller does not use, remove part of the
// function.
#define ALWAYS_INLINE __attribute__((always_inline))

#define JOIN_TOKENS(a, b) a##b
#define JOIN(a, b)        JOIN_TOKENS(a, b)

#if LANES == 1
#define LANES_TYPE(base)    base
#define LANES_CONVERT(base) JOIN(convert_, base)
#define LANES_AS(base)      JOIN(as_, base)
#define real_load(from)     (*(from))
#else
#define LANES_TYPE(base)    JOIN(base, LANES)
#define LANES_CONVERT(base) JOIN(JOIN(convert_, base), LANES)
#define LANES_AS(base)      JOIN(JOIN(as_, base), LANES)
#define real_load(from)     JOIN(vload, LANES)(0, from)
#endif

typedef LANES_TYPE(REAL_BASE) real;
typedef LANES_TYPE(INTEGER_BASE) integer;
typedef integer mask;
typedef LANES_TYPE(JOIN(u, INTEGER_BASE)) unsigned_integer; // wraps

#define real_from_integer LANES_CONVERT(REAL_BASE)
#define integer_from_real LANES_CONVERT(INTEGER_BASE)
#define real_from_bits    LANES_AS(REAL_BASE)
#define bits_from_real    LANES_AS(INTEGER_BASE)

#define unsigned_from_integer LANES_AS(JOIN(u, INTEGER_BASE))
#define integer_from_unsigned LANES_AS(INTEGER_BASE)

// The tile of a packet (types.h), the position of each lane in it, and its bit in a mask that is stored as
// bits.
#define TILE_WIDTH              TILE_WIDTH_OF(LANES)
#define TILE_HEIGHT             TILE_HEIGHT_OF(LANES)
#define MACRO_TILE_COLUMNS      MACRO_TILE_COLUMNS_OF(LANES)
#define MACRO_TILE_COLUMNS_LOG2 MACRO_TILE_COLUMNS_LOG2_OF(LANES)
#define MACRO_TILE_ROWS         MACRO_TILE_ROWS_OF(LANES)
#define TILES                   LANES // per macro-tile
// Packets that are traced together. With a BVH these are a macro-tile's. Without one there are up to eight,
// because each packet's work fills the latencies of the others' roots and quotients, and their data stays in
// caches. With bounces, which are traced packet by packet, there is one.
#define PACKETS (HAS_BVH ? TILES : HAS_REFLECTION || HAS_TRANSMISSION ? 1 : TILES < 8 ? TILES : 8)
#if LANES == 1
#define LANE_X ((integer)(0))
#define LANE_Y ((integer)(0))
#elif LANES == 4
#define LANE_X   ((integer)(0, 1, 0, 1))
#define LANE_Y   ((integer)(0, 0, 1, 1))
#define LANE_BIT ((integer)(1, 2, 4, 8))
#elif LANES == 8
#define LANE_X   ((integer)(0, 1, 2, 3, 0, 1, 2, 3))
#define LANE_Y   ((integer)(0, 0, 0, 0, 1, 1, 1, 1))
#define LANE_BIT ((integer)(1, 2, 4, 8, 16, 32, 64, 128))
#elif LANES == 16
#define LANE_X   ((integer)(0, 1, 2, 3, 0, 1, 2, 3, 0, 1, 2, 3, 0, 1, 2, 3))
#define LANE_Y   ((integer)(0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3, 3))
#define LANE_BIT ((integer)(1, 2, 4, 8, 16, 32, 64, 128, 256, 512, 1024, 2048, 4096, 8192, 16384, 32768))
#endif

// Marks a rare branch, so that the compiler keeps its values out of registers.
#ifdef __clang__
#define RARELY(condition) __builtin_expect(condition, false)
#else
#define RARELY(condition) (condition)
#endif

#define lanes_select(condition, yes, no) ((condition) ? (yes) : (no))

// Returns the number in all lanes.
static inline integer integer_of(uint value)
{
    return (integer)((scalar_integer)value);
}

static inline mask mask_all(void)
{
    return (real)(0) == (real)(0);
}

static inline mask mask_none(void)
{
    return (real)(0) != (real)(0);
}

// Lanes as an array, to read and write one by one.
typedef union {
    real all;
    scalar each[LANES];
} RealLanes;

typedef union {
    integer all;
    scalar_integer each[LANES];
} IntegerLanes;

#ifndef __has_builtin
#define __has_builtin(name) 0
#endif

// clang's reductions for CPUs compile to few instructions. clang for SPIR may lack them.
#if (defined(__x86_64__) || defined(__aarch64__)) && __has_builtin(__builtin_reduce_or) &&                   \
    __has_builtin(__builtin_reduce_min)
#define IS_CPU_CLANG 1
#else
#define IS_CPU_CLANG 0
#endif

static inline bool lanes_any(mask condition)
{
#if LANES == 1
    return condition != 0;
#elif IS_CPU_CLANG
    return __builtin_reduce_or(condition != (mask)(0)) != 0;
#else
    return any(condition);
#endif
}

// Returns the smallest lane.
static inline scalar_integer lanes_smallest(integer value)
{
#if LANES > 1 && IS_CPU_CLANG
    return __builtin_reduce_min(value);
#else
    IntegerLanes lanes = {value};
    scalar_integer least = lanes.each[0];
    for (uint lane = 1; lane < LANES; lane++)
        least = min(least, lanes.each[lane]);
    return least;
#endif
}

// clang's builtin for the x86 instruction that packs a mask into bits. The fallback below takes about ten
// instructions.
#ifdef __x86_64__
#if defined(__AVX512DQ__) && (__clang_major__ < 18 || __clang_major__ > 20 || defined(__EVEX512__))
#define HAS_MASKS_OF_512_BITS 1
#else
#define HAS_MASKS_OF_512_BITS 0 // clang 18 to 20 may have AVX-512 without its vectors of 512 bits
#endif
#if LANES == 16 && !IS_DOUBLE && HAS_MASKS_OF_512_BITS && __has_builtin(__builtin_ia32_cvtd2mask512)
#define MASK_BITS __builtin_ia32_cvtd2mask512
#elif LANES == 8 && IS_DOUBLE && HAS_MASKS_OF_512_BITS && __has_builtin(__builtin_ia32_cvtq2mask512)
#define MASK_BITS __builtin_ia32_cvtq2mask512
#elif LANES == 8 && !IS_DOUBLE && defined(__AVX__) && __has_builtin(__builtin_ia32_movmskps256)
#define MASK_BITS(condition) __builtin_ia32_movmskps256(real_from_bits(condition))
#elif LANES == 4 && IS_DOUBLE && defined(__AVX__) && __has_builtin(__builtin_ia32_movmskpd256)
#define MASK_BITS(condition) __builtin_ia32_movmskpd256(real_from_bits(condition))
#endif
#endif

// Estimates of 1 / a and 1 / sqrt(a) with a relative error of at most 2^-14.
#ifdef MASK_BITS
#if LANES == 16 && __has_builtin(__builtin_ia32_rcp14ps512_mask)
#define RECIPROCAL_14_BITS(a)   __builtin_ia32_rcp14ps512_mask(a, a, 0xffff)
#define INVERSE_ROOT_14_BITS(a) __builtin_ia32_rsqrt14ps512_mask(a, a, 0xffff)
#elif LANES == 8 && !IS_DOUBLE && defined(__AVX512VL__) && __has_builtin(__builtin_ia32_rcp14ps256_mask)
#define RECIPROCAL_14_BITS(a)   __builtin_ia32_rcp14ps256_mask(a, a, 0xff)
#define INVERSE_ROOT_14_BITS(a) __builtin_ia32_rsqrt14ps256_mask(a, a, 0xff)
#endif
#endif

// Returns floor(a), by one instruction if the processor has it. PoCL's floor takes ten.
static inline real real_floor(real a)
{
#if IS_CPU_CLANG && LANES > 1 && (defined(__SSE4_1__) || defined(__aarch64__)) &&                            \
    __has_builtin(__builtin_elementwise_floor)
    return __builtin_elementwise_floor(a);
#else
    return floor(a);
#endif
}

// Returns the mask as bits, with lane 0 lowest.
static inline uint lanes_bits(mask condition)
{
#if LANES == 1
    return condition != 0;
#elif defined(MASK_BITS)
    return (uint)MASK_BITS(condition);
#elif IS_CPU_CLANG
    return (uint)__builtin_reduce_or(lanes_select(condition, LANE_BIT, (integer)(0)));
#else
    IntegerLanes lanes = {condition};
    uint bits = 0;
    for (uint lane = 0; lane < LANES; lane++)
        bits |= (lanes.each[lane] != 0) << lane;
    return bits;
#endif
}

static inline mask mask_of_bits(uint bits)
{
#if LANES == 1
    return bits != 0;
#else
    return (integer_of(bits) & LANE_BIT) != (integer)(0);
#endif
}

// Returns the index of the lowest set bit of bits != 0.
static inline uint lowest_bit(uint bits)
{
    return 31 - clz(bits & -bits);
}

static inline bool lanes_all(mask condition)
{
    return !lanes_any(!condition);
}

// Broadcasts one lane of a value in memory.
static inline real real_of_lane(const real *lanes, uint lane)
{
    return (real)(((const scalar *)lanes)[lane]);
}

// Return the smaller and the larger operand, in one instruction each, unlike fmin and fmax. If either operand
// is NaN, the second one is returned.
static inline real real_min(real a, real b)
{
    return lanes_select(a < b, a, b);
}

static inline real real_max(real a, real b)
{
    return lanes_select(a > b, a, b);
}

static inline real real_min_of_3(real a, real b, real c)
{
    return real_min(real_min(a, b), c);
}

static inline real real_max_of_3(real a, real b, real c)
{
    return real_max(real_max(a, b), c);
}

static inline real real_clamp(real a, real low, real high)
{
    return real_min(real_max(a, low), high);
}

// Replaces a value in some lanes.
static inline void real_replace(real *value, mask where, real other)
{
    *value = lanes_select(where, other, *value);
}

// Holds eight vectors in `all`, which lane_minima_reduce replaces by the smallest lane of each in `each`.
enum { MINIMA_COUNT = 8 };
typedef union {
    real all[MINIMA_COUNT];
    scalar each[MINIMA_COUNT];
} LaneMinima;

// A row is four lanes. SHUFFLE_ROWS shuffles each row of two vectors by the lanes i, j, k and l of the first
// one, where LANES is the second vector's first lane. SELECT_ROWS selects rows i and j of a, followed by
// those of b.
#if LANES == 16 && defined(__clang__)
#define SHUFFLE_ROWS(a, b, i, j, k, l)                                                                       \
    __builtin_shufflevector(a, b, i, j, k, l, i + 4, j + 4, k + 4, l + 4, i + 8, j + 8, k + 8, l + 8,        \
                            i + 12, j + 12, k + 12, l + 12)
#define SELECT_ROWS(a, b, i, j)                                                                              \
    __builtin_shufflevector(a, b, 4 * (i), 4 * (i) + 1, 4 * (i) + 2, 4 * (i) + 3, 4 * (j), 4 * (j) + 1,      \
                            4 * (j) + 2, 4 * (j) + 3, 4 * (i) + 16, 4 * (i) + 17, 4 * (i) + 18,              \
                            4 * (i) + 19, 4 * (j) + 16, 4 * (j) + 17, 4 * (j) + 18, 4 * (j) + 19)
#elif LANES == 8 && defined(__clang__)
#define SHUFFLE_ROWS(a, b, i, j, k, l) __builtin_shufflevector(a, b, i, j, k, l, i + 4, j + 4, k + 4, l + 4)
#endif

#if LANES > 1
// Packs two vectors into one by comparing neighboring lanes, within rows if these can be shuffled, because
// lanes move between rows more slowly.
static inline real minima_pack(real a, real b)
{
#ifdef SHUFFLE_ROWS
    return real_min(SHUFFLE_ROWS(a, b, 0, 2, LANES, LANES + 2),
                    SHUFFLE_ROWS(a, b, 1, 3, LANES + 1, LANES + 3));
#else
    return real_min((real)(a.even, b.even), (real)(a.odd, b.odd));
#endif
}

// Packs vectors that minima_of_four returned.
static inline real minima_pack_halves(real a, real b)
{
#ifdef SHUFFLE_ROWS
    return real_min((real)(a.lo, b.lo), (real)(a.hi, b.hi));
#else
    return minima_pack(a, b);
#endif
}

// Packs vectors that minima_pack_halves returned.
static inline real minima_pack_rows(real a, real b)
{
#ifdef SELECT_ROWS
    return real_min(SELECT_ROWS(a, b, 0, 2), SELECT_ROWS(a, b, 1, 3));
#else
    return minima_pack(a, b);
#endif
}

// Packs four vectors into one, in which each row has one minimum per vector or, if rows cannot be shuffled,
// each vector's minima are neighbors.
static inline real minima_of_four(const real *vectors)
{
    return minima_pack(minima_pack(vectors[0], vectors[1]), minima_pack(vectors[2], vectors[3]));
}

// Returns the smallest lane of each of LANES vectors, one lane per vector.
static inline real lanes_smallest_of_each(const real *vectors)
{
    real minima = minima_of_four(vectors);
#if LANES > 4
    minima = minima_pack_halves(minima, minima_of_four(vectors + 4));
#endif
#if LANES > 8
    minima = minima_pack_rows(minima,
                              minima_pack_halves(minima_of_four(vectors + 8), minima_of_four(vectors + 12)));
#endif
    return minima;
}
#endif

// Replaces eight vectors by their smallest lanes. Unrolled, so that the vectors stay in registers.
static inline void lane_minima_reduce(LaneMinima *minima)
{
#if LANES > 1
    real *all = minima->all;
    all[0] = minima_of_four(all);
    all[1] = minima_of_four(all + 4);
#if LANES > 4
    all[0] = minima_pack_halves(all[0], all[1]);
#endif
#if LANES > 8
    all[0] = minima_pack_rows(all[0], all[0]);
#endif
#endif
}

// Returns the largest of the lanes in `members`, or -LARGEST if there are none.
static inline scalar lanes_largest(mask members, real a)
{
    // as integers the bits of negative reals order in reverse
    const uint sign = 8 * sizeof(scalar) - 1;
    integer bits = bits_from_real(lanes_select(members, -a, (real)(LARGEST)));
    scalar_integer least = lanes_smallest(bits ^ ((bits >> sign) & (integer)(INTEGER_MAX)));
    return -scalar_from_bits(least ^ ((least >> sign) & INTEGER_MAX));
}

// Prefetches memory that will soon be read, by cache line. PoCL's prefetch does nothing.
static inline void memory_prefetch(global const char *from, uint size)
{
#if IS_CPU_CLANG
#pragma unroll
    for (uint at = 0; at < size; at += 64)
        __builtin_prefetch((global const void *)(from + at));
#endif
}

#endif
