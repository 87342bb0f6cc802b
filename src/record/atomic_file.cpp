#include "youbot_base_sim/record/atomic_file.h"

#include <fmt/format.h>

#include <cerrno>
#include <filesystem>
#include <stdexcept>
#include <utility>

namespace youbot_base_sim {

namespace {

std::error_code last_error() { return {errno, std::generic_category()}; }

}  // namespace

AtomicFile::AtomicFile(const std::string& path)
    : path_(path), part_(path + ".part"), file_(std::fopen(part_.c_str(), "w")) {
  if (!file_) fail("open", last_error());
}

AtomicFile::~AtomicFile() {
  if (!file_) return;
  std::fclose(file_);
  std::error_code ignored;
  std::filesystem::remove(part_, ignored);
}

void AtomicFile::write(const std::string& text) {
  if (std::fwrite(text.data(), 1, text.size(), file_) != text.size()) fail("write", last_error());
}

void AtomicFile::commit() {
  const bool closed = std::fclose(std::exchange(file_, nullptr)) == 0;
  std::error_code error = last_error();
  if (closed) std::filesystem::rename(part_, path_, error);
  if (closed && !error) return;
  std::error_code ignored;
  std::filesystem::remove(part_, ignored);
  fail(closed ? "rename" : "write", error);
}

void AtomicFile::fail(const char* doing, const std::error_code& error) const {
  throw std::runtime_error(fmt::format("{}: cannot {} it: {}", path_, doing, error.message()));
}

}  // namespace youbot_base_sim
