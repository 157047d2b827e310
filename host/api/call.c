// Begins and ends the calls of glint.h.
#include "host/api/handles.h"
#include "host/base/array.h"
#include "host/base/memory.h"
#include <stdlib.h>
#include <string.h>

bool struct_read(void *full, size_t full_size, const void *given, const char *type, MessageList *messages)
{
    size_t size;
    memset(full, 0, full_size);
    if (!struct_has_size(given, sizeof size, type, messages)) return false;
    memcpy(&size, given, sizeof size);
    for (size_t i = full_size; i < size; i++)
        if (((const char *)given)[i] != 0)
            return message_error(messages, "a %s sets a member that glint %s does not know", type,
                                 glint_version());
    memcpy(full, given, size < full_size ? size : full_size);
    return true;
}

void struct_write(void *given, const void *full, size_t full_size)
{
    size_t size;
    memcpy(&size, given, sizeof size);
    memset(given, 0, size);
    memcpy(given, full, size < full_size ? size : full_size);
    memcpy(given, &size, sizeof size);
}

bool struct_has_size(const void *given, size_t size_min, const char *type, MessageList *messages)
{
    size_t size;
    if (!given) return message_error(messages, "a %s is NULL", type);
    memcpy(&size, given, sizeof size);
    return size >= size_min ||
           message_error(messages, "the size of a %s is %zu; expected its sizeof", type, size);
}

bool real_is_known(GlintReal real, MessageList *messages)
{
    return real == GLINT_FLOAT32 || real == GLINT_FLOAT64 ||
           message_error(messages, "real is %d; expected GLINT_FLOAT32 or GLINT_FLOAT64", (int)real);
}

GlintStatus call_end(MessageList *list, GlintDevice *device, GlintStatus status, char **messages)
{
    if (device) message_list_move(list, &device->warnings);
    if (device && !compute_ok(&device->compute)) {
        OWNED char *failure = compute_failure_text(&device->compute);
        message_error(list, "%s", failure);
        status = GLINT_DEVICE_FAILED;
    }
    if (messages) *messages = message_list_text(list);
    message_list_free(list);
    return status;
}

bool precision_read(Precision *precision, GlintPrecision given, MessageList *messages)
{
    static const Precision precisions[] = {[GLINT_SINGLE] = PRECISION_SINGLE,
                                           [GLINT_STRICT] = PRECISION_STRICT,
                                           [GLINT_DOUBLE] = PRECISION_DOUBLE,
                                           [GLINT_CERTIFIED] = PRECISION_CERTIFIED};
    if ((size_t)given >= COUNT_OF(precisions))
        return message_error(messages,
                             "precision is %d; expected GLINT_SINGLE, GLINT_STRICT, GLINT_DOUBLE or "
                             "GLINT_CERTIFIED",
                             (int)given);
    *precision = precisions[given];
    return true;
}

void glint_text_free(char *text)
{
    free(text);
}
