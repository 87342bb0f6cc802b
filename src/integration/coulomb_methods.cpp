#include "method_table.h"

namespace youbot_base_sim {

template const std::vector<Entry>& entries<PaperModel<CoulombLaw>>();

}  // namespace youbot_base_sim
