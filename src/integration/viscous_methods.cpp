#include "method_table.h"

namespace youbot_base_sim {

template const std::vector<Entry>& entries<PaperModel<ViscousLaw>>();

}  // namespace youbot_base_sim
