// glint-mpi runs glint render on the devices of an MPI job, one per rank. The first rank reads the scene,
// sends the compiled arrays to the others, hands out rows and writes the image, while its own device renders
// in a thread. The others need neither the scene's files nor the output's folder.
//
// All ranks must be of one architecture and run the same program.
#include "host/base/exit_status.h"
#include "host/base/fault.h"
#include "host/cli/interrupts.h"
#include "host/cli/options.h"
#include "host/import/mesh/assimp_process.h"
#include "host/mpi/messages.h"

int main(int argument_count, char **arguments)
{
    const int child_status = assimp_process_main(argument_count, arguments);
    if (child_status >= 0) return child_status;
    int level, rank, size, local_rank, status = EXIT_DONE;
    MPI_Comm local;
    MPI_Init_thread(&argument_count, &arguments, MPI_THREAD_FUNNELED, &level);
    if (level < MPI_THREAD_FUNNELED) fault("this MPI cannot be used by a program with threads");
    signals_prepare();
    MPI_Comm_rank(MPI_COMM_WORLD, &rank);
    MPI_Comm_size(MPI_COMM_WORLD, &size);
    MPI_Comm_split_type(MPI_COMM_WORLD, MPI_COMM_TYPE_SHARED, rank, MPI_INFO_NULL, &local);
    MPI_Comm_rank(local, &local_rank);
    if (rank == 0)
        status = first_rank_run((size_t)size - 1, argument_count, arguments);
    else
        other_rank_run((size_t)local_rank, argument_count, arguments);
    MPI_Finalize();
    return status;
}
