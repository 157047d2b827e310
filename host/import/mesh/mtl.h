// Reads the materials that an OBJ file names from its MTL files.
#pragma once

#include "host/base/array.h"
#include "host/import/line.h"
#include "host/import/mesh/draft.h"

// A material that `usemtl` sets from a corner on.
typedef struct {
    Word name;
    size_t first_corner;
} ObjMaterial;

typedef struct {
    ARRAY_OF(ObjMaterial) used;
    ARRAY_OF(Word) libraries; // `mtllib`
} ObjMaterials;

// Adds the materials to the scene and to the draft. Warns of materials that are missing or cannot be used.
void obj_materials_read(MeshDraft *draft, const ObjMaterials *materials);
