#include "host/base/numbers.h"

#include <string.h>

void numbers_narrow(float *target, const double *values, size_t count)
{
    for (size_t i = 0; i < count; i++)
        target[i] = (float)values[i];
}

void numbers_widen(double *target, const void *values, size_t count, bool is_double)
{
    if (is_double)
        memcpy(target, values, count * sizeof *target);
    else
        for (size_t i = 0; i < count; i++)
            target[i] = (double)((const float *)values)[i];
}
