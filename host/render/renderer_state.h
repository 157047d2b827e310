// Defines the members of a Renderer for the files of this room.
#pragma once

#include "host/render/pass.h"
#include "host/render/renderer.h"

struct Renderer {
    Pass passes[PASS_COUNT];
    PixelPass pass_count; // PASS_COUNT at `certified`, else 1. All passes but the last certify.
    RenderReport report;
};
