// SPDX-License-Identifier: Apache-2.0
// Program gsc-play-mpi: gsc-play that uses the ranks of an MPI job as devices. Rank 0 runs gsc-play, the other ranks
// draw for it.
#include <gsc/error.h>
#include <gsc/interrupt.h>
#include "player/commands/commands.h"
#include "player/mpi/mpi_renderer.h"
#include "player/mpi/wire.h"
#include "runtime/cli/version.h"
#include "player/devices/worker_options.h"

#include <mpi.h>

#include <algorithm>
#include <cstdio>
#include <string>

namespace {

// Returns true if all ranks run the same build; others would misread its structs, and print so. The layout of the
// structs tells builds apart whose sources were changed after their commit.
bool isOneBuild(int rank)
{
    const std::string version = gsc::versionText("gsc-play-mpi");
    std::string text =
        gsc::formatString("%s, messages %llx", version.c_str(), static_cast<unsigned long long>(gsc::kWireLayout));
    std::ranges::replace(text, '\n', ' ');
    char own[512] = {}, first[sizeof(own)] = {};
    text.copy(own, sizeof(own) - 1);
    std::ranges::copy(own, first);
    MPI_Bcast(first, sizeof(first), MPI_CHAR, 0, MPI_COMM_WORLD);
    const int same = std::ranges::equal(own, first);
    int all = 0;
    if (same == 0)
        std::fprintf(stderr, "error: rank %d: its build is %s, expected rank 0's, %s; install one on all machines\n",
                     rank, own, first);
    MPI_Allreduce(&same, &all, 1, MPI_INT, MPI_MIN, MPI_COMM_WORLD);
    return all != 0;
}

} // namespace

int main(int argc, char** argv)
{
    int threads = 0, rank = 0, ranks = 0;
    MPI_Init_thread(&argc, &argv, MPI_THREAD_MULTIPLE, &threads);
    MPI_Comm_rank(MPI_COMM_WORLD, &rank);
    MPI_Comm_size(MPI_COMM_WORLD, &ranks);
    if (threads < MPI_THREAD_MULTIPLE) {
        if (rank == 0)
            std::fprintf(stderr, "error: this MPI has no MPI_THREAD_MULTIPLE, expected one that has; use Open MPI 4 or "
                                 "later\n");
        MPI_Finalize();
        return int(gsc::ErrorCode::Unsupported);
    }
    if (!isOneBuild(rank)) {
        MPI_Finalize();
        return int(gsc::ErrorCode::Usage);
    }
    MPI_Comm here;
    int on_machine = 0;
    MPI_Comm_split_type(MPI_COMM_WORLD, MPI_COMM_TYPE_SHARED, 0, MPI_INFO_NULL, &here);
    MPI_Comm_rank(here, &on_machine);
    MPI_Comm_free(&here);
    int code = 0;
    if (rank == 0) {
        gsc::installInterruptHandler();
        gsc::RemoteWorkers remote;
        for (int other = 1; other < ranks; ++other)
            remote.devices.push_back({"rank", other});
        remote.make = [](const gsc::DeviceId& id, const gsc::ModelChoice& model, const std::string& backend,
                         const gsc::RendererOptions& limits) {
            return gsc::makeMpiRenderer(id.ordinal, model, backend, limits);
        };
        remote.wire = gsc::wireBytes;
        gsc::setRemoteWorkers(std::move(remote));
        code = gsc::runGscPlay(argc, argv);
        if (gsc::ranksHang()) {
            // The run is over and its output is complete, but one rank hangs. MPI_Finalize() would wait for it for
            // ever, and mpirun takes any other end of the process for a failure. MPI_Abort() passes the exit code on,
            // even 0, though mpirun calls it an abort.
            std::fprintf(stderr,
                         "warning: gsc-play-mpi: a rank hangs, expected it to end with the run; its process is ended "
                         "by MPI_ABORT, and the exit code is that of the run, %d\n",
                         code);
            std::fflush(nullptr);
            MPI_Abort(MPI_COMM_WORLD, code);
        }
        gsc::endRanks();
    } else {
        gsc::serveRank(on_machine);
    }
    MPI_Finalize();
    return code;
}
