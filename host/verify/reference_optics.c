#include "host/verify/reference_optics.h"

#include "host/verify/reference.h"

Quad3 reference_reflect(Quad3 direction, Quad3 normal)
{
    return quad3_subtract(direction, quad3_scale(normal, 2 * quad3_dot(direction, normal)));
}

bool reference_refract(Quad3 direction, Quad3 normal, Quad eta, Quad3 *refracted, double *margin)
{
    Quad cosine = -quad3_dot(direction, normal);
    Quad squared = 1 - eta * eta * (1 - cosine * cosine);
    margin_reduce(margin, squared);
    if (squared < 0) return false;
    *refracted =
        quad3_add(quad3_scale(direction, eta), quad3_scale(normal, eta * cosine - quad_root(squared)));
    return true;
}

Quad reference_reflectance(Quad cosine, Quad ior, bool entering)
{
    const Quad eta = entering ? 1 / ior : ior, squared = 1 - eta * eta * (1 - cosine * cosine);
    if (squared <= 0) return 1;
    const Quad behind = QUAD_CALL(sqrt)(squared), near = entering ? 1 : ior, far = entering ? ior : 1;
    const Quad across = (near * cosine - far * behind) / (near * cosine + far * behind),
               along = (near * behind - far * cosine) / (near * behind + far * cosine);
    return (across * across + along * along) / 2;
}

// With the index m, M = m^2 and q^2 = M - sine^2, the amplitude is (c - q) / (c + q) across the plane of
// incidence and (M c - q) / (M c + q) along it.
double reference_conductor_reflectance(Quad cosine, double n, double k)
{
    const Quad real = (Quad)n * n - (Quad)k * k, imaginary = 2 * (Quad)n * k;
    const Quad difference = real - (1 - cosine * cosine);
    const Quad size = QUAD_CALL(sqrt)(difference * difference + imaginary * imaginary);
    const Quad q_real = QUAD_CALL(sqrt)((size + difference) / 2),
               q_imaginary = QUAD_CALL(sqrt)((size - difference) / 2);
    Quad sum = 0;
    for (int along = 0; along < 2; along++) {
        const Quad a = along ? real * cosine : cosine, b = along ? imaginary * cosine : 0;
        sum += ((a - q_real) * (a - q_real) + (b - q_imaginary) * (b - q_imaginary)) /
               ((a + q_real) * (a + q_real) + (b + q_imaginary) * (b + q_imaginary));
    }
    return (double)(sum / 2);
}
