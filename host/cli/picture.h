// The files one render writes: the picture, and a .npy for each kind of AOV beside it.
#pragma once

#include "host/image/image.h"
#include "host/opencl/device.h"
#include "host/render/renderer.h"

enum { PICTURE_AOV_COUNT = 8 };
extern const char
    *const picture_aov_names[PICTURE_AOV_COUNT]; // the first ones are the bits AOV_…, then "color"

typedef struct {
    const char *path;
    unsigned aovs; // a bit for each of picture_aov_names
    Transfer transfer;
    unsigned bits;
    bool apart; // a band is encoded before the next one is rendered: neither takes the other's time
} PictureOptions;

typedef struct Picture Picture;

char *
picture_default_path(const char *scene_path); // the scene's name with .png, in this folder; caller frees
bool picture_path_known(const char *path);    // false: the endings there are were printed
// Whether none of the files is one that the scene was read from; which one is was printed.
bool picture_spares_scene(const PictureOptions *options, const Scene *scene, const char *scene_path);
unsigned picture_renderer_aovs(const PictureOptions *options);

// Files are opened with the first band, when the kernels' hash is known.
Picture *picture_open(const PictureOptions *options, const char *scene_path, const Scene *scene,
                      const RenderSettings *settings, const Renderer *renderer, const Device *device);
// Encodes a copy of the band while the caller goes on, unless it is to be done apart; the messages are the
// picture's until it is committed or abandoned. False: this band could not be written, or an earlier one.
bool picture_write(Picture *picture, const Band *band, MessageList *messages);
// Puts all files in place; frees the picture. False with a message if one could not be. *seconds: spent on
// encoding and writing, beside other work or not.
bool picture_commit(Picture *picture, MessageList *messages, double *seconds);
void picture_abandon(Picture *picture);
