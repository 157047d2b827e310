// JPEG input through libjpeg-turbo.
#include "host/image/codec.h"

#include <stdlib.h>
#include <turbojpeg.h>

// Bounds the declared size by the file's: the expansion of a flat gray image.
enum { JPEG_EXPANSION = 1 << 14 };

bool jpeg_decode(Image *image, const ImageFile *file)
{
    tjhandle decoder = tjInitDecompress();
    if (!decoder) return image_refuse(file, "JPEG: %s", tjGetErrorStr());
    int width, height, sampling, color_space;
    uint8_t *bytes = NULL;
    bool done = false;
    if (tjDecompressHeader3(decoder, file->bytes, file->length, &width, &height, &sampling, &color_space) !=
        0) {
        image_refuse(file, "JPEG: %s", tjGetErrorStr2(decoder));
    } else if (image_allocate(image, file, (uint64_t)width, (uint64_t)height, 3, JPEG_EXPANSION)) {
        size_t count = (size_t)image->width * image->height * 3;
        bytes = calloc(count, 1);
        if (!bytes)
            image_refuse(file, "the image does not fit into memory");
        else if (tjDecompress2(decoder, file->bytes, file->length, bytes, width, 0, height, TJPF_RGB,
                               TJFLAG_ACCURATEDCT) != 0)
            image_refuse(file, "JPEG: %s", tjGetErrorStr2(decoder));
        else {
            for (size_t i = 0; i < count; i++)
                image->values[i] = (float)bytes[i] / 255.0F;
            done = true;
        }
    }
    image->display = true;
    image->transfer = TRANSFER_SRGB;
    free(bytes);
    tjDestroy(decoder);
    return done;
}
