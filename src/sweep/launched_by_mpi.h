#pragma once

#include <cstdlib>

namespace youbot_base_sim {

/// Whether mpirun, or another launcher that MPI knows, has started this process.
inline bool launched_by_mpi() {
  for (const char* variable : {"OMPI_COMM_WORLD_SIZE", "PMIX_RANK", "PMI_RANK"}) {
    if (std::getenv(variable)) return true;
  }
  return false;
}

}  // namespace youbot_base_sim
