// Renders a compiled scene on a device in bands, or traces explicit rays through it.
#pragma once

#include "host/compile/compiled_scene.h"
#include "host/render/render_report.h"
#include "host/render/render_settings.h"
#include "host/render/trace.h"
#include "host/scene/scene.h"

typedef struct Renderer Renderer;

// Opens a renderer on a device, whose Compute must outlive it. Kernels are built when first used. Returns
// NULL with a message if a number of the scene does not fit the precision, if the settings do not fit the
// device (settings_fit) or its arithmetic (arithmetic_suits) or if the scene does not fit its memory, and
// NULL with no message if the device failed.
Renderer *renderer_open(Compute *compute, const Scene *scene, const RenderSettings *settings,
                        MessageList *messages);
// Opens a renderer as renderer_open does. Closes `earlier`, NULL or an earlier renderer of the device, and
// reuses its kernels where they suit.
Renderer *renderer_reopen(Renderer *earlier, Compute *compute, const Scene *scene,
                          const RenderSettings *settings, MessageList *messages);
// Opens a renderer that has no scene. The caller then calls renderer_receive_scene with the scene of each
// pass. Treats `earlier` as renderer_reopen does. Returns NULL with a message if the settings do not fit the
// device or its arithmetic, and NULL with no message if the device failed.
Renderer *renderer_open_empty(Compute *compute, const RenderSettings *settings, Renderer *earlier,
                              MessageList *messages);
// Returns the lanes of a pass, or 0 if the renderer does not have that pass.
uint32_t renderer_lanes(const Renderer *renderer, PixelPass pass);
// Uploads the compiled scene of the pass and its lanes, and takes ownership of it even on failure. Returns
// false with a message if the scene does not fit the device's memory, and false with no message if the device
// failed.
bool renderer_receive_scene(Renderer *renderer, PixelPass pass, CompiledScene *compiled,
                            MessageList *messages);
// Frees the memory that the scene takes. Only the kernels are left, for a later renderer.
void renderer_release_scene(Renderer *renderer);
void renderer_close(Renderer *renderer);
// Changes the scene and the settings. With settings->moves, only the camera of the scene may differ, and only
// the size, region, cell, samples and bounces of the settings. Without it, all of the scene may differ except
// its textures, and the BvhChoice. Textures stay on the device, and so do kernels that suit. Returns false
// with a message if a number of the scene does not fit the precision, if the settings do not fit the device
// or if the scene does not fit its memory; the renderer then still renders its previous scene. Returns false
// with no message if the device failed.
bool renderer_move(Renderer *renderer, const Scene *scene, const RenderSettings *settings,
                   MessageList *messages);

// Returns scene_color_max of the renderer's scene, which must be `scene`. The renderer must have been opened
// alone, not as one of several in a RendererSet.
double renderer_color_max(const Renderer *renderer, const Scene *scene);
// Returns what all bands with the color and the AOVs of the set have in common.
FilmHeader renderer_film_header(const Renderer *renderer, unsigned aovs);
// Renders the color and the AOVs of the set in bands of about band_seconds each. Returns false if the device
// failed, in which case compute_ok returns false, or if settings.stop or the sink ended the render. A failed
// device delivers no further bands.
bool renderer_render(Renderer *renderer, unsigned aovs, BandSink sink, void *context);

// Renders the rows of the queue until none are left. Returns false if the device failed, or if settings.stop
// or the queue ended the render.
bool renderer_work(Renderer *renderer, unsigned aovs, const BandQueue *queue);

// Renders the image in rounds over all of its pixels, so that a preview sharpens. After the first round every
// pixel has one sample, and after the last it has all. The AOVs of the set follow the first round, in bands
// that have no color. AOV_FLAG is then re-delivered with the last round, which flags pixels of the color. The
// final image equals renderer_render's bit for bit. Returns false if the device failed, or if settings.stop
// or the sink ended the render.
bool renderer_accumulate(Renderer *renderer, unsigned aovs, BandSink sink, void *context);

// Renders the color and the AOVs of the set into one film in double, which film_free frees. Returns false,
// with nothing to free, if the device failed or settings.stop ended the render.
bool renderer_render_film(Renderer *renderer, unsigned aovs, Film *film);

// Finds the closest hits of explicit rays (host/render/trace.h) with the intersection code that renders. The
// report includes its kernel's build and hash, but neither its launches nor its reads. Returns false if the
// device failed; `hits` is then undefined.
bool renderer_trace(Renderer *renderer, const TraceRay *rays, size_t ray_count, TraceHit *hits);
// Finds the closest hits as renderer_trace does, but faster, because it computes neither reflected and
// refracted rays nor transmission and light.
bool renderer_trace_closest(Renderer *renderer, const TraceRay *rays, size_t ray_count, TraceHit *hits);

const RenderReport *renderer_report(const Renderer *renderer);

// Returns, if settings.hashes_scene, the hash of all passes' arrays, their unit and the samples' offsets. It
// excludes the BVH and the order that it gives the primitives, since they do not change the image.
uint64_t renderer_scene_hash(const Renderer *renderer);

// Returns the composed text of the kernel that renders, for other compilers. The caller frees it.
char *renderer_kernel_text(const Renderer *renderer);
// Returns the hash of the text from which that kernel was built or, before its build, of the text above. A
// driver may have built another text, whose functions are out of line.
uint64_t renderer_kernel_hash(const Renderer *renderer);
// Clears launches, reads, bands and counted rays, so that the next render has its own report.
void renderer_report_restart(Renderer *renderer);
