#include "youbot_base_sim/record/atomic_file.h"

#include <fmt/format.h>

#include <cerrno>
#include <cstring>
#include <stdexcept>

namespace youbot_base_sim {

AtomicFile::AtomicFile(const std::string& path)
    : path_(path), part_(path + ".part"), file_(std::fopen(part_.c_str(), "w")) {
  if (!file_) fail("open");
}

AtomicFile::~AtomicFile() {
  if (!file_) return;
  std::fclose(file_);
  std::remove(part_.c_str());
}

void AtomicFile::write(const std::string& text) {
  if (std::fwrite(text.data(), 1, text.size(), file_) != text.size()) fail("write");
}

void AtomicFile::commit() {
  std::FILE* file = file_;
  file_ = nullptr;
  const bool closed = std::fclose(file) == 0;
  if (closed && std::rename(part_.c_str(), path_.c_str()) == 0) return;
  const int error = errno;
  std::remove(part_.c_str());
  errno = error;
  fail(closed ? "rename" : "write");
}

void AtomicFile::fail(const char* doing) const {
  throw std::runtime_error(fmt::format("{}: cannot {} it: {}", path_, doing, std::strerror(errno)));
}

}  // namespace youbot_base_sim
