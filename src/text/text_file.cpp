#include "youbot_base_sim/text/text_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdio>
#include <memory>
#include <system_error>

namespace youbot_base_sim {

namespace {

constexpr int kWriterTimeout = 1000;  // ms, in which a writer must have opened a pipe

[[noreturn]] void refuse_error() {
  throw UnreadableFile(fmt::format("cannot be read ({})", std::generic_category().message(errno)));
}

}  // namespace

std::string read_text_file(const std::string& path, std::size_t max_bytes) {
  // Without O_NONBLOCK, opening a pipe would wait for a writer without end.
  const int descriptor = open(path.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC);
  if (descriptor < 0) refuse_error();
  const std::unique_ptr<FILE, int (*)(FILE*)> file(fdopen(descriptor, "r"), std::fclose);
  struct stat status;
  if (!file || fstat(descriptor, &status) != 0) refuse_error();
  if (S_ISDIR(status.st_mode)) throw UnreadableFile("is a folder");
  if (!S_ISREG(status.st_mode) && !S_ISFIFO(status.st_mode)) throw UnreadableFile("is neither a file nor a pipe");
  std::string text;
  if (S_ISFIFO(status.st_mode)) {
    pollfd events{descriptor, POLLIN, 0};
    const bool in_time = poll(&events, 1, kWriterTimeout) > 0;
    char first;
    const ssize_t count = read(descriptor, &first, 1);
    if (count > 0) text += first;
    if (count == 0 && !in_time) throw UnreadableFile("is a pipe without a writer");
    fcntl(descriptor, F_SETFL, 0);  // from here on, wait for the writer
  }
  std::array<char, 65536> bytes;
  while (const std::size_t count = std::fread(bytes.data(), 1, bytes.size(), file.get())) {
    text.append(bytes.data(), count);
    if (text.compare(0, 7, "#ROSBAG") == 0) throw UnreadableFile("is a bag, which analyse reads");
    if (text.size() > max_bytes) throw UnreadableFile(fmt::format("is longer than {} bytes", max_bytes));
  }
  if (std::ferror(file.get())) refuse_error();
  constexpr char kByteOrderMark[] = "\xEF\xBB\xBF";
  if (text.compare(0, 3, kByteOrderMark) == 0) text.erase(0, 3);
  return text;
}

}  // namespace youbot_base_sim
