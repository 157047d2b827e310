#include "host/base/parallel.h"
#include "host/compile/shapes.h"
#include "host/compile/stages.h"
#include <stdatomic.h>

// A primitive's reach is its largest coordinate seen from the eye: its distance, or its size if that is
// larger. The error of any point near it is at least u times the reach for every ray, and the bounds are
// products of two such lengths. If the reach lies within this range, those are normal numbers, and smaller
// roundings do not count. In float the least is (2^-24 2^-36)^2 = 2^-120.
//
// The turning points of a torus are the zeros of a cubic of its size, which must be in range to the last
// bit. A smaller torus may be uncertain everywhere, if the error of a point exceeds its size.
typedef struct {
    double reach_min, reach_max, plane_min, plane_max, torus_min, torus_max, roundoff;
} CertifiedRange;

static const CertifiedRange of_float = {0x1p-36, 0x1p48, 0x1p-60, 0x1p60, 0x1p-30, 0x1p36, 0x1p-24},
                            of_double = {0x1p-220, 0x1p220, 0x1p-440, 0x1p440, 0x1p-220, 0x1p220, 0x1p-53};

typedef struct {
    const CompiledScene *compiled;
    size_t type;
    CertifiedRange range;
    atomic_bool exceeds;
} RangeTest;

static bool torus_is_in_range(const CertifiedRange *range, double size, double reach)
{
    return size <= range->torus_max && (size >= range->torus_min || size <= range->roundoff * reach);
}

static bool is_in_range(const CertifiedRange *range, size_t type, const void *primitive)
{
    const double reach = primitive_reach(type, primitive);
    // a plane's distance is not squared
    if (type == TYPE_PLANES) return reach == 0 || (reach >= range->plane_min && reach <= range->plane_max);
    if (!(reach >= range->reach_min && reach <= range->reach_max)) return false;
    if (shape_ops[type]->stretch && !(shape_ops[type]->stretch(primitive) * reach <= range->reach_max))
        return false;
    const Torus *torus = primitive;
    if (type == TYPE_TORI)
        return torus_is_in_range(range, torus->center_major.w + torus->axis_minor.w, reach);
    const Oval *oval = primitive;
    return type != TYPE_OVALS || oval->id.z != TYPE_TORI || torus_is_in_range(range, oval->sizes.x, reach);
}

static void range_test(void *context, size_t begin, size_t end)
{
    RangeTest *test = context;
    const FlatArray *array = &test->compiled->arrays[FLAT_FIRST_SHAPE + test->type];
    for (size_t i = begin; i < end; i++)
        if (!is_in_range(&test->range, test->type, flat_array_at(array, i))) {
            atomic_store(&test->exceeds, true);
            return;
        }
}

bool bounds_hold(const CompiledScene *compiled, const CompileSettings *settings)
{
    RangeTest test = {.compiled = compiled,
                      .range = settings->precision == PRECISION_DOUBLE ? of_double : of_float};
    for (; test.type < TYPE_COUNT && !test.exceeds; test.type++)
        parallel_run(compiled->arrays[FLAT_FIRST_SHAPE + test.type].count, FLAT_RANGE_MIN, range_test, &test);
    return !test.exceeds;
}
