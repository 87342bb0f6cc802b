#pragma once

#include <stdlib.h>

#include <cstdlib>
#include <fstream>
#include <sstream>
#include <string>

namespace youbot_base_sim {

/// A folder of its own for a test's files, removed at the end.
class TemporaryFolder {
 public:
  TemporaryFolder() {
    char name[] = "/tmp/youbot_base_sim_test_XXXXXX";
    path_ = mkdtemp(name);
  }
  ~TemporaryFolder() { std::system(("rm -rf " + path_).c_str()) == 0 ? void() : void(); }

  std::string path(const std::string& name) const { return path_ + "/" + name; }

  /// Writes a file and returns its path.
  std::string write(const std::string& name, const std::string& text) const {
    std::ofstream(path(name)) << text;
    return path(name);
  }

  std::string read(const std::string& name) const {
    std::ostringstream text;
    text << std::ifstream(path(name)).rdbuf();
    return text.str();
  }

  bool has(const std::string& name) const { return std::ifstream(path(name)).good(); }

 private:
  std::string path_;
};

}  // namespace youbot_base_sim
