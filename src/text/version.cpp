#include "youbot_base_sim/text/version.h"

namespace youbot_base_sim {

const char* version() { return YOUBOT_BASE_SIM_VERSION; }

}  // namespace youbot_base_sim
