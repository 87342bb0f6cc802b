#include "youbot_base_sim/text/text_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <system_error>

namespace youbot_base_sim {

namespace {

constexpr int kWriterTimeout = 1000;  // ms, in which a writer must have opened a pipe

[[noreturn]] void refuse_error() {
  throw UnreadableFile(fmt::format("cannot be read ({})", std::generic_category().message(errno)));
}

/// A file or pipe that is read from its beginning.
class Input {
 public:
  // Without O_NONBLOCK, open would wait for ever for the writer of a pipe.
  explicit Input(const std::string& path) : descriptor_(open(path.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC)) {
    if (descriptor_ < 0) refuse_error();
  }
  ~Input() { close(descriptor_); }
  Input(const Input&) = delete;
  Input& operator=(const Input&) = delete;

  void check_kind() const {
    struct stat status;
    if (fstat(descriptor_, &status) != 0) refuse_error();
    if (S_ISDIR(status.st_mode)) throw UnreadableFile("is a folder");
    if (!S_ISREG(status.st_mode) && !S_ISFIFO(status.st_mode)) throw UnreadableFile("is neither a file nor a pipe");
  }

  /// Reads up to `size` bytes; none at the end.
  std::size_t read(char* bytes, std::size_t size) {
    bool in_time = true;
    while (true) {
      const ssize_t count = ::read(descriptor_, bytes, size);
      if (count > 0) opened_ = true;
      if (count > 0 || (count == 0 && opened_)) return static_cast<std::size_t>(count);
      if (count == 0) {  // a file that is empty or a pipe that has had no writer so far
        if (!in_time) throw UnreadableFile("is a pipe without a writer");
        opened_ = in_time = wait(kWriterTimeout);
      } else if (errno == EAGAIN) {
        opened_ = true;
        wait(-1);
      } else {
        refuse_error();
      }
    }
  }

 private:
  /// Waits for something to read or for the end, at most `timeout` ms unless that is -1. Returns false in vain.
  bool wait(int timeout) const {
    pollfd events{descriptor_, POLLIN, 0};
    const int ready = poll(&events, 1, timeout);
    if (ready < 0) refuse_error();  // also where a signal interrupts
    return ready > 0;
  }

  int descriptor_;
  bool opened_ = false;  // known not to be a pipe without a writer
};

}  // namespace

std::string read_text_file(const std::string& path, std::size_t max_bytes) {
  Input input(path);
  input.check_kind();
  std::string text;
  std::array<char, 65536> bytes;
  while (const std::size_t count = input.read(bytes.data(), bytes.size())) {
    text.append(bytes.data(), count);
    if (text.size() > max_bytes) throw UnreadableFile(fmt::format("is longer than {} bytes", max_bytes));
  }
  constexpr char kByteOrderMark[] = "\xEF\xBB\xBF";
  if (text.compare(0, 3, kByteOrderMark) == 0) text.erase(0, 3);
  return text;
}

}  // namespace youbot_base_sim
