#include "host/scene/affine.h"
#include "host/scene/portable.h"

#include <math.h>
#include <string.h>

const Affine affine_identity = {{{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}}};

Affine affine_multiply(const Affine *a, const Affine *b)
{
    Affine product;
    for (int row = 0; row < 3; row++) {
        for (int column = 0; column < 4; column++) {
            double sum = column == 3 ? a->rows[row][3] : 0;
            for (int k = 0; k < 3; k++)
                sum += a->rows[row][k] * b->rows[k][column];
            product.rows[row][column] = sum;
        }
    }
    return product;
}

Vector3 affine_direction(const Affine *affine, Vector3 v)
{
    const double(*m)[4] = affine->rows;
    return (Vector3){m[0][0] * v.x + m[0][1] * v.y + m[0][2] * v.z,
                     m[1][0] * v.x + m[1][1] * v.y + m[1][2] * v.z,
                     m[2][0] * v.x + m[2][1] * v.y + m[2][2] * v.z};
}

Vector3 affine_point(const Affine *affine, Vector3 p)
{
    Vector3 moved = affine_direction(affine, p);
    return (Vector3){moved.x + affine->rows[0][3], moved.y + affine->rows[1][3],
                     moved.z + affine->rows[2][3]};
}

double affine_determinant(const Affine *affine)
{
    return vector_dot(vector_from(affine->rows[0]),
                      vector_cross(vector_from(affine->rows[1]), vector_from(affine->rows[2])));
}

// Computes the rows of the transposed inverse times |determinant| as cross products of rows.
Affine affine_for_normals(const Affine *affine)
{
    double side = affine_determinant(affine) < 0 ? -1 : 1;
    Affine cofactors = {0};
    for (int row = 0; row < 3; row++) {
        Vector3 cross = vector_scale(
            vector_cross(vector_from(affine->rows[(row + 1) % 3]), vector_from(affine->rows[(row + 2) % 3])),
            side);
        memcpy(cofactors.rows[row], (const double[3]){cross.x, cross.y, cross.z}, 3 * sizeof(double));
    }
    return cofactors;
}

Vector3 affine_normal(const Affine *for_normals, Vector3 normal)
{
    return vector_is_zero(normal) ? normal : vector_normalize(affine_direction(for_normals, normal));
}

void affine_triangle(const Affine *affine, Vector3 vertices[3], Vector3 normals[3])
{
    const Affine for_normals = affine_for_normals(affine);
    for (int i = 0; i < 3; i++) {
        vertices[i] = affine_point(affine, vertices[i]);
        normals[i] = affine_normal(&for_normals, normals[i]);
    }
    if (affine_determinant(affine) >= 0) return;
    const Vector3 vertex = vertices[1], normal = normals[1];
    vertices[1] = vertices[2], normals[1] = normals[2];
    vertices[2] = vertex, normals[2] = normal;
}

// Sets the sine and cosine of degrees, which are exact at quarter turns.
static void turn_of(double degrees, double *sine, double *cosine)
{
    int quarters;
    double rest = remquo(degrees, 90, &quarters) * (M_PI / 180);
    const double s = portable_sine(rest), c = portable_cosine(rest);
    const double turned[4] = {s, c, -s, -c};
    *sine = turned[quarters & 3];
    *cosine = turned[(quarters + 1) & 3];
}

Affine affine_of_steps(Vector3 scale, Vector3 rotate, Vector3 translate)
{
    double sx, cx, sy, cy, sz, cz;
    turn_of(rotate.x, &sx, &cx);
    turn_of(rotate.y, &sy, &cy);
    turn_of(rotate.z, &sz, &cz);
    const Affine scaled = {{{scale.x, 0, 0, 0}, {0, scale.y, 0, 0}, {0, 0, scale.z, 0}}};
    const Affine about_x = {{{1, 0, 0, 0}, {0, cx, -sx, 0}, {0, sx, cx, 0}}};
    const Affine about_y = {{{cy, 0, sy, 0}, {0, 1, 0, 0}, {-sy, 0, cy, 0}}};
    const Affine about_z = {{{cz, -sz, 0, translate.x}, {sz, cz, 0, translate.y}, {0, 0, 1, translate.z}}};
    Affine turned = affine_multiply(&about_x, &scaled);
    turned = affine_multiply(&about_y, &turned);
    return affine_multiply(&about_z, &turned);
}

// Uses Rodrigues' formula (1840).
Affine affine_about(Vector3 axis, double degrees)
{
    double sine, cosine;
    turn_of(degrees, &sine, &cosine);
    const Vector3 n = vector_normalize(axis);
    const double part = 1 - cosine;
    return (Affine){
        {{cosine + part * n.x * n.x, part * n.x * n.y - sine * n.z, part * n.x * n.z + sine * n.y, 0},
         {part * n.y * n.x + sine * n.z, cosine + part * n.y * n.y, part * n.y * n.z - sine * n.x, 0},
         {part * n.z * n.x - sine * n.y, part * n.z * n.y + sine * n.x, cosine + part * n.z * n.z, 0}}};
}

static const double tolerance = 1e-6; // of lengths and cosines

bool affine_keeps_circles(const Affine *affine, Vector3 axis, bool is_straight, AxisScale *scale)
{
    const Vector3 w = vector_normalize(axis);
    const Vector3 u = vector_normalize(vector_cross(w, vector_least_aligned_axis(w)));
    const Vector3 v = vector_cross(w, u);
    const Vector3 lu = affine_direction(affine, u), lv = affine_direction(affine, v);
    const double uu = vector_dot(lu, lu), vv = vector_dot(lv, lv);
    *scale = (AxisScale){sqrt(sqrt(uu) * sqrt(vv)), affine_direction(affine, w)};
    const double lengths = scale->across * vector_length(scale->along);
    return fabs(uu - vv) <= tolerance * uu && fabs(vector_dot(lu, lv)) <= tolerance * uu &&
           (!is_straight || (fabs(vector_dot(lu, scale->along)) <= tolerance * lengths &&
                             fabs(vector_dot(lv, scale->along)) <= tolerance * lengths));
}

bool affine_keeps_balls(const Affine *affine, AxisScale *scale)
{
    return affine_keeps_circles(affine, (Vector3){0, 1, 0}, true, scale) &&
           fabs(vector_length(scale->along) - scale->across) <= tolerance * scale->across;
}
