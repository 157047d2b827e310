// Reads `transform:` of YAML scenes.
#include "host/base/array.h"
#include "host/import/yaml/yaml.h"

#include <math.h>

// The forms of a transform.
enum { FORM_STEPS = FORM_FIRST, FORM_MATRIX = FORM_SECOND };

// Bounds the cost of a hostile file.
enum { STEPS_MAX = 64 };

typedef struct {
    Vector3 angles, axis; // degrees about x, y and z; or, unless it is zero, about the axis
    double angle;
} Rotation;

typedef struct {
    Vector3 translate, scale;
    Rotation rotation;
    Affine matrix;
} Steps;

// Reads one number for all axes or three numbers. None may be 0.
static bool read_scale(YamlReader *reader, const Field *field, const YamlNode *node, void *target)
{
    Vector3 *scale = target;
    if (node->type == YAML_SEQUENCE) {
        if (!read_vector(reader, field, node, scale)) return false;
    } else {
        if (!read_number(reader, field, node, &scale->x)) return false;
        scale->y = scale->z = scale->x;
    }
    return (scale->x != 0 && scale->y != 0 && scale->z != 0) ||
           report_error(&reader->report, node->offset, "'%s' must not be zero", field->name);
}

// Reads the angles about x, y and z, or an axis and an angle.
static bool read_rotation(YamlReader *reader, const Field *field, const YamlNode *node, void *target)
{
    static const Field fields[] = {
        {"axis", read_direction, offsetof(Rotation, axis), REQUIRED},
        {"angle", read_number, offsetof(Rotation, angle), REQUIRED},
    };
    Rotation *rotation = target;
    return node->type == YAML_MAPPING
               ? fields_read(reader, node, field->name, fields, COUNT_OF(fields), rotation) != 0
               : read_vector(reader, field, node, &rotation->angles);
}

static bool step_read(YamlReader *reader, const Field *field, const YamlNode *node, Affine *affine)
{
    static const Items row_numbers = {4, "rows of four numbers", read_number, sizeof(double)},
                       matrix_rows = {3, "three rows of four numbers", read_items, 4 * sizeof(double),
                                      &row_numbers};
    static const Field fields[] = {
        {"translate", read_vector, offsetof(Steps, translate), FORM_STEPS},
        {"rotate", read_rotation, offsetof(Steps, rotation), FORM_STEPS},
        {"scale", read_scale, offsetof(Steps, scale), FORM_STEPS},
        {"matrix", read_items, offsetof(Steps, matrix), REQUIRED | FORM_MATRIX, .items = &matrix_rows},
    };
    Steps steps = {.scale = {1, 1, 1}};
    const Form form = fields_read(reader, node, field->name, fields, COUNT_OF(fields), &steps);
    if (!form) return false;
    *affine = steps.matrix;
    if (form == FORM_MATRIX) return true;
    const Rotation *rotation = &steps.rotation;
    *affine = affine_of_steps(steps.scale, rotation->angles, steps.translate);
    if (vector_is_zero(rotation->axis)) return true;
    const Vector3 none = {0, 0, 0};
    const Affine scaled = affine_of_steps(steps.scale, none, none);
    Affine turn = affine_about(rotation->axis, rotation->angle);
    turn.rows[0][3] = steps.translate.x;
    turn.rows[1][3] = steps.translate.y;
    turn.rows[2][3] = steps.translate.z;
    *affine = affine_multiply(&turn, &scaled);
    return true;
}

// Returns whether each number is at most NUMBER_MAX and no row lies nearly in the plane of the other two.
static bool has_inverse(const Affine *affine)
{
    double lengths = 1;
    for (int row = 0; row < 3; row++) {
        const double *m = affine->rows[row];
        for (int column = 0; column < 4; column++)
            if (!(fabs(m[column]) <= NUMBER_MAX)) return false;
        lengths *= hypotenuse(hypotenuse(m[0], m[1]), m[2]);
    }
    return lengths >= 1e-89 && fabs(affine_determinant(affine)) > 1e-12 * lengths;
}

bool read_transform(YamlReader *reader, const Field *field, const YamlNode *node, void *target)
{
    Affine *affine = target;
    if (node->type != YAML_SEQUENCE) {
        if (!step_read(reader, field, node, affine)) return false;
    } else {
        *affine = affine_identity;
        if (node->child_count > STEPS_MAX)
            return report_error(&reader->report, node->offset, "'%s' may have at most %d steps", field->name,
                                STEPS_MAX);
        for (const YamlNode *item = yaml_first(&reader->tree, node); item;
             item = yaml_next(&reader->tree, item)) {
            Affine step;
            if (!step_read(reader, field, item, &step)) return false;
            *affine = affine_multiply(&step, affine);
        }
    }
    return has_inverse(affine) ||
           report_error(&reader->report, node->offset,
                        "'%s' must have an inverse, and numbers of at most %g in magnitude", field->name,
                        NUMBER_MAX);
}
