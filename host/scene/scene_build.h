// What the readers share when they fill a scene.
#pragma once

#include "host/scene/report.h"
#include "host/scene/scene.h"

// Returns the material's index.
uint32_t scene_add_material(Scene *scene, const Material *material, const char *name);

// Adds an object with a material of its own.
void scene_add_object(Scene *scene, Object object, const Material *material);

// Closes the report. Without errors warns of what makes a picture black; with errors empties the scene.
bool scene_finish(Scene *scene, Report *report);
