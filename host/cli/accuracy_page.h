// Collects the data that the HTML report of glint accuracy needs in addition to its JSON, which are the
// variants' names, the images and their differences.
#pragma once

#include "host/base/json.h"
#include "host/cli/accuracy_report.h"

// Returns an object with these members:
//   difference_decades, difference_colors
//                            the scale of differences: the first color up to 10^-decades, then two colors per
//                            decade up to 1 and beyond; the last color means not finite
//   scenes[].names           the names of the scene's variants
//   scenes[].images[]        one for each set of images equal as 32-bit floats, the reference's first
//       .variants            the variants that have the image
//       .image, .difference  8-bit PNG as data: URI; the reference has no difference
Json *accuracy_page_extras(const AccuracyReport *report);
