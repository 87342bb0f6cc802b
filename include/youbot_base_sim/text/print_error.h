#pragma once

#include <cstdio>
#include <string>

namespace youbot_base_sim {

/// Prints "PROGRAM: TEXT" on standard error. A failure to write it, as on a full disk, is ignored:
/// the exit status still reports it.
inline void print_error(const std::string& program, const std::string& text) {
  std::fputs((program + ": " + text + "\n").c_str(), stderr);
}

}  // namespace youbot_base_sim
