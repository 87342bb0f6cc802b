#include "integrate.h"

namespace youbot_base_sim {

template std::unique_ptr<Integration> integrate<ExtendedModel<CoulombLaw>>(const Parts&, MakeGeneralMethod);

}  // namespace youbot_base_sim
