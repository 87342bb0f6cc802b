// Ranks, built where Boost.MPI is not.

#include "launched_by_mpi.h"
#include "youbot_base_sim/sweep/ranks.h"

namespace youbot_base_sim {

class Ranks::Communicator {};

Ranks::Ranks(int&, char**&) {
  if (!launched_by_mpi()) return;
  throw std::runtime_error(
      "this sweep was built without MPI: start it without mpirun, or build it once more where libboost-mpi-dev is");
}

Ranks::~Ranks() = default;

int Ranks::rank() const { return 0; }
int Ranks::size() const { return 1; }
std::vector<std::string> Ranks::gather(const std::string& text) const { return {text}; }

void Ranks::serve(RunSchedule&, const MakeRow&, std::chrono::milliseconds, const std::function<void()>&) const {
  throw std::logic_error("no other ranks");
}

void Ranks::work(const MakeRow&) const { throw std::logic_error("no other ranks"); }

void Ranks::abort(int status) const { std::exit(status); }

}  // namespace youbot_base_sim
