#pragma once

namespace youbot_base_sim {

/// The package's version, as in package.xml.
const char* version();

}  // namespace youbot_base_sim
