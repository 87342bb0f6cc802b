#pragma once

#include <cstdio>
#include <string>

namespace youbot_base_sim {

/// Prints "PROGRAM: TEXT" on standard error. Ignores write errors: the exit status still reports the error.
inline void print_error(const std::string& program, const std::string& text) {
  std::fputs((program + ": " + text + "\n").c_str(), stderr);
}

}  // namespace youbot_base_sim
