// A scene's image against the reference, on a sample of its pixels: which objects, shadows and paths are not
// those of quadruple precision (113 bits) on the scene as its file says it, and how far colors are off.
#pragma once

#include "host/render/film.h"
#include "host/verify/reference_color.h"

// What the reference says of a sample of an image's pixels.
typedef struct {
    uint32_t width, height, light_count;
    size_t count;
    uint32_t (*places)[2]; // x, y
    ReferencePixel *pixels;
    bool *shadows; // of each pixel, for each light
} CertifySample;

// One pixel of each of about `count` equal parts of the image, at a place that a hash chooses; all of it if
// it has no more. Computes on all processors. False if `stop` returned true; there is nothing to close then.
bool certify_sample_open(CertifySample *sample, const Scene *scene, uint32_t width, uint32_t height,
                         size_t count, ReferencePath path, bool (*stop)(void));
void certify_sample_close(CertifySample *sample);

// What `certified` claims of a pixel that AOV_DOUBT does not list as uncertified: the object, which lights
// reach it and the path are those of exact arithmetic on the scene's numbers and the camera's vectors in
// double, and the color, unless a texture is on the path, is within CERTIFIED_COLOR_ERROR of its largest
// channel, or of 1 if that is more. So a checker's cell or a shadow that is seen in a mirror is claimed by
// the color.
//
// The counts of pixels where an image differs from that. A pixel is wrong in one way at most, the first of
// these.
typedef struct {
    size_t compared; // the reference decides them
    size_t object, shadow, path, color;
    size_t colors;      // of pixels without a texture, right or wrong
    double right_color; // the largest error of a channel where nothing is wrong
    double wrong_color; // and where something is
    uint32_t worst[2];  // where the larger of these is
    // Of wrong pixels: how far the exact ray is from the curve at which its answer changes, the most, in
    // parts of the distance. What single may see wrong is at most some units of roundoff from it.
    double margin;
    // Pixels that the reference leaves uncertain, and AOV_DOUBT does not; how many of these differ from it.
    size_t unconfirmed, contradicted;
    // Pixels that contradict the claim: wrong or contradicted, and not uncertified; and which of them has the
    // largest margin.
    size_t wrong_decided;
    uint32_t wrong_decided_place[2];
    double wrong_decided_margin;
} CertifyErrors;

// `film` has AOV_OBJECT, AOV_SHADOW, AOV_PATH, AOV_DOUBT and the color.
CertifyErrors certify_compare(const CertifySample *sample, const Film *film);

// Pixels that an image at `certified` leaves uncertified, and why those examined are. Witnessed: rays whose
// starts and directions err by up to 2^-50, as double's may, give another answer in one of 16 tries. Close:
// else a quantity that decides may be below 2^-49, in parts of the distance, as where surfaces coincide. The
// others may be open for loose bounds alone.
typedef struct {
    size_t count, examined, witnessed, close;
} CertifyUncertified;

// Examines at most about `most`, evenly over the image, on all processors. Nothing is examined if `stop`
// returned true.
CertifyUncertified certify_uncertified(const Scene *scene, const Film *film, size_t most, ReferencePath path,
                                       bool (*stop)(void));
