#include "host/mpi/messages.h"

#include "host/base/memory.h"
#include <time.h>

void rest(void)
{
    nanosleep(&(struct timespec){.tv_nsec = 200000}, NULL);
}

void broadcast(void *bytes, size_t size, MPI_Comm ranks)
{
    const size_t most = 1 << 30; // a count is an int
    for (size_t done = 0; done < size; done += most)
        MPI_Bcast((char *)bytes + done, (int)(size - done < most ? size - done : most), MPI_BYTE, 0, ranks);
}

void send_bytes(const void *bytes, size_t size, int rank, int tag)
{
    MPI_Send(bytes, (int)size, MPI_BYTE, rank, tag, MPI_COMM_WORLD);
}

void receive_bytes(void *bytes, size_t size, int rank, int tag)
{
    MPI_Recv(bytes, (int)size, MPI_BYTE, rank, tag, MPI_COMM_WORLD, MPI_STATUS_IGNORE);
}

bool has_message(int rank, int tag, MPI_Status *status)
{
    int is_there;
    MPI_Iprobe(rank, tag, MPI_COMM_WORLD, &is_there, status);
    return is_there;
}

static void compiled_broadcast(CompiledScene *compiled, bool is_sender, MPI_Comm ranks)
{
    broadcast(compiled, sizeof *compiled, ranks);
    if (!is_sender) { // only a renderer that moves reads these
        compiled->textures = NULL;
        compiled->instances = NULL;
    }
    for (size_t type = 0; type < FLAT_COUNT; type++) {
        FlatArray *array = &compiled->arrays[type];
        if (!is_sender) array->items = memory_allocate_large(array->count, array->layout.size);
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
