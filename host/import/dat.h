// Reads a Tachyon scene: its words, its textures and the statements that glint does not show.
#pragma once

#include "host/base/array.h"
#include "host/import/line.h"
#include "host/import/load.h"

// The material of triangles that have a texture, by its text, and a color.
typedef struct {
    Word texture;
    Color color;
    uint32_t index; // of the scene
} ColoredMaterial;

typedef struct {
    Report report;
    Line line;
    Scene *scene;
    ColoredMaterial last_colored; // `texture.text` is NULL if there is none
    bool has_resolution, has_camera;
    bool dims_clear; // opacity dims what a transparent surface shows, as in VMD
    void *textures;  // by their names, as tsearch keeps them
} DatReader;

// Skips the next word if it is the keyword, and returns whether it is.
bool dat_skip(DatReader *reader, const char *keyword);
// Adds a warning once, regardless of how often the source repeats its cause.
void dat_warn(DatReader *reader, size_t offset, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

// Each of these reads the keyword and the value after it. Reports an error and returns false if either is
// missing.
bool dat_expect(DatReader *reader, const char *keyword);
bool dat_number(DatReader *reader, const char *keyword, double *value);
// Reads a vector and negates its z, since Tachyon's coordinates are left-handed.
bool dat_vector(DatReader *reader, const char *keyword, Vector3 *vector);
// Reads a vector without a keyword; `name` is for errors.
bool dat_coordinates(DatReader *reader, const char *name, Vector3 *vector);

// dat_texture.c

Material dat_texture_default(void);
// Reads the definition of a texture, from its first keyword to its last, `texfunc` or `vcst`.
bool dat_texture_body(DatReader *reader, Material *material);
// Reads an object's texture, either inline or by name, and sets *material to its index in the scene.
bool dat_texture(DatReader *reader, uint32_t *material);
bool dat_texture_definition(DatReader *reader);
bool dat_texture_alias(DatReader *reader);

// dat_view.c: statements.

bool dat_resolution(DatReader *reader);
bool dat_camera(DatReader *reader);
bool dat_background(DatReader *reader);
bool dat_light(DatReader *reader);
bool dat_directional_light(DatReader *reader);
bool dat_spotlight(DatReader *reader);

// dat_objects.c: statements.

bool dat_sphere(DatReader *reader);
bool dat_plane(DatReader *reader);
bool dat_cylinder(DatReader *reader);
bool dat_finite_cylinder(DatReader *reader);
bool dat_polycylinder(DatReader *reader);
bool dat_ring(DatReader *reader);
bool dat_box(DatReader *reader);
bool dat_triangle(DatReader *reader);
bool dat_smooth_triangle(DatReader *reader);
bool dat_colored_triangle(DatReader *reader);
bool dat_vertex_array(DatReader *reader);
