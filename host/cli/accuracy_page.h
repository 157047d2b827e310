// What the HTML report of glint accuracy needs besides its JSON: the variants' names, the images and their
// differences.
#pragma once

#include "host/base/json.h"
#include "host/cli/accuracy_report.h"

// An object with
//   difference_decades, difference_colors
//                            the scale of differences: the first color up to 10^-decades, then two colors per
//                            decade up to 1 and beyond; the last color means not finite
//   scenes[].names           of its variants
//   scenes[].images[]        one for each set of images equal as 32-bit floats, the reference's first
//       .variants            whose image it is
//       .image, .difference  8-bit PNG as data: URI; the reference has no difference
Json *accuracy_page_extras(const AccuracyReport *report);
