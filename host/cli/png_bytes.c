#include "host/cli/png_bytes.h"

#include "host/base/array.h"
#include "host/base/fault.h"
#include <png.h>

void png_bytes_append(Text *png, const uint8_t *pixels, uint32_t width, uint32_t height,
                      const uint8_t (*palette)[3], uint32_t palette_count)
{
    png_image image = {
        .version = PNG_IMAGE_VERSION,
        .width = width,
        .height = height,
        .format = palette ? PNG_FORMAT_RGB_COLORMAP : PNG_FORMAT_RGB,
        .colormap_entries = palette_count,
    };
    png_alloc_size_t size = PNG_IMAGE_PNG_SIZE_MAX(image);
    array_reserve(*png, size + 1);
    if (!png_image_write_to_memory(&image, png->items + png->count, &size, 0, pixels, 0, palette))
        fault("libpng cannot write: %s", image.message);
    png->count += size;
    png->items[png->count] = '\0';
}
