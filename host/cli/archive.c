#include "host/cli/archive.h"

#include "host/base/fault.h"
#include "host/base/memory.h"
#include <inttypes.h>
#include <stdlib.h>
#include <string.h>
#include <zlib.h>

enum { BLOCK = 512, GZIP_WINDOW_BITS = 15 + 16 };

// The header of a member (POSIX.1-2017, pax, "ustar Interchange Format").
typedef struct {
    char name[100], mode[8], owner[8], group[8], size[12], modified[12], checksum[8], type, link[100];
    char magic[6], version[2], owner_name[32], group_name[32], major[8], minor[8], prefix[155], unused[12];
} Header;

_Static_assert(sizeof(Header) == BLOCK, "a header is one block");

static void zeros_append(Text *tar, size_t count)
{
    static const char zeros[2 * BLOCK];
    text_append(tar, zeros, count);
}

// Writes an octal number that fills its field up to the NUL. The sizes and times of our members fit.
static void octal_write(char *field, size_t size, uint64_t value)
{
    char digits[32];
    snprintf(digits, sizeof digits, "%0*" PRIo64, (int)size - 1, value);
    memcpy(field, digits, size);
}

void archive_add(Text *tar, const char *name, const Text *contents, time_t modified)
{
    if (strlen(name) > ARCHIVE_NAME_MAX) fault("the name is too long for an archive: %s", name);
    Header header = {.type = '0', .magic = "ustar", .version = {'0', '0'}};
    memcpy(header.name, name, strlen(name));
    octal_write(header.mode, sizeof header.mode, 0644);
    octal_write(header.owner, sizeof header.owner, 0);
    octal_write(header.group, sizeof header.group, 0);
    octal_write(header.size, sizeof header.size, contents->count);
    octal_write(header.modified, sizeof header.modified, (uint64_t)modified);
    // the sum counts its own field as spaces
    memset(header.checksum, ' ', sizeof header.checksum);
    unsigned sum = 0;
    for (size_t i = 0; i < BLOCK; i++)
        sum += ((const unsigned char *)&header)[i];
    octal_write(header.checksum, sizeof header.checksum - 1, sum);
    text_append(tar, (const char *)&header, BLOCK);
    text_append(tar, text_c(contents), contents->count);
    zeros_append(tar, (BLOCK - contents->count % BLOCK) % BLOCK);
}

bool archive_write(Text *tar, OutputFile *output, MessageList *messages)
{
    zeros_append(tar, 2 * BLOCK);
    z_stream stream = {.next_in = (unsigned char *)tar->items, .avail_in = (unsigned)tar->count};
    if (tar->count > UINT32_MAX || deflateInit2(&stream, Z_BEST_COMPRESSION, Z_DEFLATED, GZIP_WINDOW_BITS,
                                                MAX_MEM_LEVEL, Z_DEFAULT_STRATEGY) != Z_OK)
        fault("cannot compress an archive of %zu bytes", tar->count);
    const size_t largest = deflateBound(&stream, tar->count);
    unsigned char *bytes = memory_allocate(largest, 1);
    stream.next_out = bytes;
    stream.avail_out = (unsigned)largest;
    if (deflate(&stream, Z_FINISH) != Z_STREAM_END) fault("an archive does not fit its bound");
    const bool is_written = output_write(output, bytes, largest - stream.avail_out, messages);
    deflateEnd(&stream);
    free(bytes);
    return is_written;
}
