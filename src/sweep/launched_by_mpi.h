#pragma once

#include <cstdlib>

namespace youbot_base_sim {

/// Whether mpirun, or another launcher that MPI knows, has started this process.
inline bool launched_by_mpi() {
  constexpr const char* kVariables[] = {"OMPI_COMM_WORLD_SIZE", "PMIX_RANK", "PMI_RANK"};
  for (const char* variable : kVariables) {
    if (std::getenv(variable)) return true;
  }
  return false;
}

}  // namespace youbot_base_sim
