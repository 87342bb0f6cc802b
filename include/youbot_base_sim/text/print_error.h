#pragma once

#include <cstdio>
#include <string>

namespace youbot_base_sim {

/// Prints "PROGRAM: TEXT" on standard error. Where nobody can hear it, as on a full disk, the program's exit status has
/// to do: fmt::print would throw.
inline void print_error(const std::string& program, const std::string& text) {
  std::fputs((program + ": " + text + "\n").c_str(), stderr);
}

}  // namespace youbot_base_sim
