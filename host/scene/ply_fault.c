// What assimp would not survive in a PLY file: its reader goes on without end where the header does not end,
// and makes whatever the header promises, of a file however short.
#include "host/scene/mesh.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>

// Every item takes a byte at least.
static bool element_fits(char *line, unsigned long long file_size)
{
    char *rest, *keyword = strtok_r(line, " \t", &rest);
    if (!keyword || strcmp(keyword, "element") != 0 || !strtok_r(NULL, " \t", &rest)) return true;
    const char *count = strtok_r(NULL, " \t", &rest);
    return !count || strtoull(count, NULL, 10) <= file_size;
}

// For assimp a line ends with any of these.
static bool elements_fit(char *lines, unsigned long long file_size)
{
    bool fit = true;
    for (char *line; (line = strsep(&lines, "\r\n\f"));)
        fit &= element_fits(line, file_size);
    return fit;
}

static bool is_end_of_header(const char *line)
{
    static const char end[] = "end_header";
    size_t length = sizeof end - 1;
    return !strncmp(line, end, length) && line[length + strspn(line + length, "\r\n")] == '\0';
}

static bool header_is_faulty(FILE *file, unsigned long long file_size, char *fault, size_t size)
{
    char *line = NULL;
    size_t capacity = 0, line_number = 1;
    const char *what = "the header lacks its end, a line 'end_header'";
    for (ssize_t length; (length = getline(&line, &capacity, file)) >= 0; line_number++) {
        if (strlen(line) < (size_t)length) {
            what = "the header holds a NUL character";
            break;
        }
        if (is_end_of_header(line)) {
            what = NULL;
            break;
        }
        if (!elements_fit(line, file_size)) {
            what = "the header promises more than the file holds";
            break;
        }
    }
    if (what) snprintf(fault, size, "line %zu: %s", line_number, what);
    free(line);
    return what != NULL;
}

bool ply_find_fault(const char *path, char *fault, size_t size)
{
    size_t length = strlen(path);
    if (length < 4 || strcasecmp(path + length - 4, ".ply") != 0) return false;
    FILE *file = fopen(path, "rb");
    struct stat status;
    if (!file) return false;
    bool faulty = fstat(fileno(file), &status) == 0 &&
                  header_is_faulty(file, (unsigned long long)status.st_size, fault, size);
    fclose(file);
    return faulty;
}
