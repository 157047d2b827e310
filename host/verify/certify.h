// Compares the objects, shadows, paths and colors of a sample of an image's pixels with quadruple precision
// (113 bits) on the scene exactly as its file defines it.
#pragma once

#include "host/render/film.h"
#include "host/render/render_settings.h"
#include "host/verify/reference_color.h"

// The reference's answers for a sample of an image's pixels.
typedef struct {
    uint32_t width, height, light_count;
    size_t count;
    uint32_t (*places)[2]; // x, y
    ReferencePixel *pixels;
    bool *shadows; // per pixel and light
} CertifySample;

// Computes one pixel, chosen by a hash, in each of about `count` equal parts of the image with these
// settings, or every pixel if there are fewer. Only the settings' size, bounces, minimum contribution and
// stop function are used. Uses all processors. Returns false, with nothing to close, if settings->stop
// returned true.
bool certify_sample_open(CertifySample *sample, const Scene *scene, const RenderSettings *settings,
                         size_t count);
void certify_sample_close(CertifySample *sample);
#define OwnedCertifySample __attribute__((cleanup(certify_sample_close))) CertifySample

// `certified` makes this claim about each pixel that AOV_FLAG does not list as uncertified. Its object,
// path and the lights that reach it are those of exact arithmetic on the scene's numbers and the camera's
// vectors in double. Its color, unless a texture is on the path, is within CERTIFIED_COLOR_ERROR of its
// largest channel, or of 1 if that is more. The color thus covers a checker's square or a shadow that is
// seen in a mirror.
//
// The comparison of a film with the claim.
typedef struct {
    size_t compared;                    // pixels that the reference decides
    size_t object, shadow, path, color; // those that are wrong, each counted once by the first that is wrong
    size_t colors;                      // compared, of pixels without a texture, right or wrong
    double right_color;                 // the largest error of a channel in right pixels
    double wrong_color;                 // and in wrong pixels
    uint32_t worst[2];                  // the pixel with the larger of the two
    // The largest distance of a wrong pixel's exact ray from the curve where its answer changes, relative to
    // the hit's distance. Faults of single precision are at most some units of roundoff from it.
    double margin;
    // Pixels that are uncertain in the reference but not in AOV_FLAG, and how many of them differ from it.
    size_t unconfirmed, contradicted;
    // Pixels that violate the claim, because they are wrong or contradicted but not uncertified, and the one
    // with the largest margin.
    size_t violations;
    uint32_t violation_place[2];
    double violation_margin;
} CertifyErrors;

// Compares a film, which needs AOV_OBJECT, AOV_SHADOW, AOV_PATH, AOV_FLAG and the color, with the sample.
CertifyErrors certify_compare(const CertifySample *sample, const Film *film);

// Pixels that an image at `certified` leaves uncertified, classified by cause. A pixel is witnessed if one of
// 16 tries with ray starts and directions off by up to 2^-50, the error of double, gives another answer. It
// is close if otherwise a deciding quantity may be below 2^-49 relative to the distance, for example where
// surfaces coincide. The others may be uncertified only because bounds are loose.
typedef struct {
    size_t count, examined, witnessed, close;
} CertifyUncertified;

// Examines at most about `count_max` pixels, spread evenly over the image, on all processors. `settings` are
// those of the sample. Examines none if settings->stop returned true.
CertifyUncertified certify_uncertified(const Scene *scene, const Film *film, const RenderSettings *settings,
                                       size_t count_max);
