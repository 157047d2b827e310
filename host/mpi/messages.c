#include "host/mpi/messages.h"

#include "host/base/memory.h"
#include <time.h>

void poll_pause(void)
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
            poll_pause();
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

void scene_broadcast(CompiledScene *compiled, bool needs_scene)
{
    int rank;
    MPI_Comm ranks;
    MPI_Comm_rank(MPI_COMM_WORLD, &rank);
    MPI_Comm_split(MPI_COMM_WORLD, needs_scene ? 0 : MPI_UNDEFINED, rank, &ranks);
    if (ranks == MPI_COMM_NULL) return;
    broadcast(compiled, sizeof *compiled, ranks);
    if (rank != 0) {
        compiled->textures = NULL;
        compiled->instances = NULL;
    }
    for (size_t type = 0; type < FLAT_COUNT; type++) {
        FlatArray *array = &compiled->arrays[type];
        if (rank != 0) array->items = memory_allocate_large(array->count, array->layout.size);
        broadcast(array->items, array->count * array->layout.size, ranks);
    }
    MPI_Comm_free(&ranks);
}
