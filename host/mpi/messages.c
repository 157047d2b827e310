#include "host/mpi/messages.h"

#include "host/base/memory.h"
#include <time.h>

// Compiles only for a value of one of these types, none of which is a pointer.
#define IS_PLAIN(value) _Generic((value), bool : 1, uint32_t : 1, uint64_t : 1, double : 1)

#define JOB_SETTING_CHECK(Type, name)                                                                        \
    _Static_assert(IS_PLAIN(((JobSettings *)0)->name) && sizeof(Type) == sizeof((RenderSettings *)0)->name,  \
                   #name " of a job is not that of RenderSettings");
JOB_SETTINGS_LIST(JOB_SETTING_CHECK)

#define JOB_SETTING_COPY(Type, name) .name = settings->name,
JobSettings job_settings_of(const RenderSettings *settings)
{
    return (JobSettings){JOB_SETTINGS_LIST(JOB_SETTING_COPY)};
}

RenderSettings settings_of_job(const JobSettings *settings)
{
    return (RenderSettings){JOB_SETTINGS_LIST(JOB_SETTING_COPY)};
}

void rest(void)
{
    nanosleep(&(struct timespec){.tv_nsec = 200000}, NULL);
}

int message_size(size_t bytes_left)
{
    const size_t most = 1 << 30;
    return (int)(bytes_left < most ? bytes_left : most);
}

void broadcast(void *bytes, size_t size, MPI_Comm ranks)
{
    for (size_t done = 0; done < size; done += (size_t)message_size(size - done))
        MPI_Bcast((char *)bytes + done, message_size(size - done), MPI_BYTE, 0, ranks);
}

void send_bytes(const void *bytes, size_t size, int rank, int tag)
{
    for (;;) {
        const int count = message_size(size);
        MPI_Send(bytes, count, MPI_BYTE, rank, tag, MPI_COMM_WORLD);
        size -= (size_t)count;
        if (size == 0) return;
        bytes = (const char *)bytes + count;
    }
}

bool has_message(int rank, int tag, MPI_Status *status)
{
    int is_there;
    MPI_Iprobe(rank, tag, MPI_COMM_WORLD, &is_there, status);
    return is_there;
}

void receive_bytes(void *bytes, size_t size, int rank, int tag)
{
    for (;;) {
        const int count = message_size(size);
        MPI_Status status;
        while (!has_message(rank, tag, &status))
            rest();
        MPI_Recv(bytes, count, MPI_BYTE, rank, tag, MPI_COMM_WORLD, MPI_STATUS_IGNORE);
        size -= (size_t)count;
        if (size == 0) return;
        bytes = (char *)bytes + count;
    }
}

bool end_poll(void *has_ended)
{
    bool *ended = has_ended;
    MPI_Status status;
    if (!*ended && has_message(0, TAG_END, &status)) end_await(ended);
    return *ended;
}

void end_await(bool *has_ended)
{
    if (!*has_ended) receive_bytes(NULL, 0, 0, TAG_END);
    *has_ended = true;
}

// The members of a CompiledScene that are read by renderers that do not move. The items of the arrays follow.
typedef struct {
    uint64_t counts[FLAT_COUNT];
    FlatLayout layouts[FLAT_COUNT];
    FeatureSet features;
    double unit;
    uint32_t pending_children_max;
} CompiledHeader;

static CompiledHeader header_of(const CompiledScene *compiled)
{
    CompiledHeader header = {.features = compiled->features,
                             .unit = compiled->unit,
                             .pending_children_max = compiled->pending_children_max};
    for (size_t type = 0; type < FLAT_COUNT; type++) {
        header.counts[type] = compiled->arrays[type].count;
        header.layouts[type] = compiled->arrays[type].layout;
    }
    return header;
}

// Returns a scene whose items are allocated but not yet received.
static CompiledScene compiled_of(const CompiledHeader *header)
{
    CompiledScene compiled = {.features = header->features,
                              .unit = header->unit,
                              .pending_children_max = header->pending_children_max};
    for (size_t type = 0; type < FLAT_COUNT; type++) {
        const size_t count = (size_t)header->counts[type];
        const FlatLayout layout = header->layouts[type];
        compiled.arrays[type] = (FlatArray){memory_allocate_large(count, layout.size), count, layout};
        compiled.changed[type] = true;
    }
    return compiled;
}

static void compiled_broadcast(CompiledScene *compiled, bool is_sender, MPI_Comm ranks)
{
    CompiledHeader header = {0};
    if (is_sender) header = header_of(compiled);
    broadcast(&header, sizeof header, ranks);
    if (!is_sender) *compiled = compiled_of(&header);
    for (size_t type = 0; type < FLAT_COUNT; type++) {
        const FlatArray *array = &compiled->arrays[type];
        broadcast(array->items, array->count * array->layout.size, ranks);
    }
}

void scene_broadcast(CompiledScene *compiled, int rank, bool takes)
{
    MPI_Comm ranks;
    MPI_Comm_split(MPI_COMM_WORLD, rank == 0 || takes ? 0 : MPI_UNDEFINED, rank, &ranks);
    if (ranks == MPI_COMM_NULL) return;
    compiled_broadcast(compiled, rank == 0, ranks);
    MPI_Comm_free(&ranks);
}
