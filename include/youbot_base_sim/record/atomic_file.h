#pragma once

#include <cstdio>
#include <string>
#include <system_error>

namespace youbot_base_sim {

/// A text file that appears under its name only when it is complete: written as NAME.part beside it, renamed by
/// `commit`, removed otherwise. Throws std::runtime_error, which names the file, where the system refuses.
class AtomicFile {
 public:
  explicit AtomicFile(const std::string& path);
  ~AtomicFile();
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;

  void write(const std::string& text);

  /// Puts the file in its place.
  void commit();

 private:
  [[noreturn]] void fail(const char* doing, const std::error_code& error) const;

  std::string path_;
  std::string part_;
  std::FILE* file_;
};

}  // namespace youbot_base_sim
