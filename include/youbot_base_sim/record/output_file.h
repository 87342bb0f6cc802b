#pragma once

#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace youbot_base_sim {

/// An output that cannot be opened, written or put in its place: its name, why, and where the rest is kept.
class OutputError : public std::runtime_error {
 public:
  /// `error` is the system's number of it, if there is one.
  explicit OutputError(const std::string& text, int error = 0) : std::runtime_error(text), error_(error) {}

  /// True if there is no space left, where another place would do.
  bool is_full() const;
  /// True if a signal came while it waited for a reader of the output.
  bool is_interrupted() const { return error_ == EINTR; }

 private:
  int error_;
};

/// Owns a descriptor of the system; a negative one is none.
class Descriptor {
 public:
  explicit Descriptor(int number = -1) : number_(number) {}
  ~Descriptor() { close(); }
  Descriptor(Descriptor&& other) noexcept : number_(std::exchange(other.number_, -1)) {}
  Descriptor& operator=(Descriptor&& other) noexcept {
    std::swap(number_, other.number_);
    return *this;
  }
  operator int() const { return number_; }  // NOLINT(google-explicit-constructor): as the system takes it

  /// Returns 0 or the system's error number.
  int close() { return number_ < 0 || ::close(std::exchange(number_, -1)) == 0 ? 0 : errno; }

 private:
  int number_;
};

/// Throws OutputError with the reason of a system's error number.
[[noreturn]] void refuse_output(const std::string& path, int error);

/// A file that a program writes: the only place that opens outputs.
///
/// A regular file is written as NAME.incomplete-XXXXXX beside it and renamed by `commit`, so that NAME is always whole:
/// the last of several writers stands. However the program ends, the remains are visible and not mistaken for a
/// complete file. Symbolic links are followed, and a file that is replaced keeps its mode.
///
/// A device, a FIFO and the program's own descriptors (/dev/stdout, /dev/fd/N) are written straight to, row by row.
class OutputFile {
 public:
  enum class Access {
    kInOrder,  ///< from its beginning to its end
    kAnywhere  ///< written by a library, which opens `name` and goes back and forth: refused for pipes and the like
  };

  /// Opens it. Throws OutputError if it is empty, a folder, or cannot be written.
  explicit OutputFile(const std::string& path, Access access = Access::kInOrder);

  /// Keeps what `commit` has not put in its place, see `keep_incomplete`.
  ~OutputFile();
  OutputFile(OutputFile&& other) = default;

  /// Appends whole lines. Where that fails, keeps the lines before as `keep_incomplete` does, and throws OutputError.
  void write(std::string_view lines);

  /// Takes the space for the file to grow to `size` bytes. Returns 0, or the system's error number if it cannot.
  int reserve(std::uint64_t size);

  /// Has `commit` wait some milliseconds until the file survives a power failure.
  void sync_on_commit() { sync_on_commit_ = !straight_; }

  /// Puts the file in its place. Throws OutputError if that fails; the file is then kept as `keep_incomplete` does.
  void commit();

  /// Ends the writing early. Returns the name that keeps the whole lines so far; empty: none, or written in place.
  std::string keep_incomplete();

  /// The name under which it is being written.
  const std::string& name() const { return name_; }

  /// True if it is a terminal, where it is read as it comes.
  bool is_terminal() const { return straight_ && isatty(descriptor_); }

  /// The place of an output.
  struct Place {
    std::filesystem::path target;         ///< links followed
    std::optional<struct stat> existing;  ///< the target, if there is one

    /// Equal for all names of one file, existing or not, and for no other. Empty for the null device.
    std::string identity() const;
  };
  /// Throws OutputError for an empty name, a folder, and where the system refuses to say.
  static Place place_of(const std::string& path);

  /// Ends the writing early: throws OutputError with the reason, and where and in what `state` the rest is kept.
  [[noreturn]] void fail(const std::string& reason, const std::string& state = "", int error = 0);

  /// The system's error number as a reason; of those for a full disk, all say "no space".
  static std::string text_of(int error);

 private:
  void open_straight();
  void open_beside();
  int flush();  // 0, or an error number
  [[noreturn]] void fail(int error) { fail(text_of(error), "", error); }

  std::string path_;  // as the user names it
  Place place_;
  std::string name_;
  Access access_;
  bool straight_ = false, sync_on_commit_ = false;
  Descriptor descriptor_;
  std::string buffer_;
  off_t written_ = 0;  // bytes
  off_t whole_ = 0;    // the bytes of them up to the end of a line
};

/// Opens what a program writes. Each output must differ from the other outputs and from the files that it reads.
class OutputOpener {
 public:
  explicit OutputOpener(const std::vector<std::string>& inputs);

  /// `option` names the output where it is refused. Throws OutputError.
  OutputFile open(const std::string& option, const std::string& path,
                  OutputFile::Access access = OutputFile::Access::kInOrder);

  /// Keeps a place for an output that is opened later, and that must be a regular file. Throws OutputError.
  void keep(const std::string& option, const std::string& path);

  /// Keeps places likewise for all outputs to come in `folder`, which `is_output` recognizes. Call it last.
  void keep_all(const std::string& option, const std::string& folder,
                const std::function<bool(const std::string& name)>& is_output);

 private:
  void take(const std::string& option, const std::string& path, const OutputFile::Place& place);

  std::map<std::string, std::string> taken_;  // by identity: what it is
  std::vector<std::string> to_come_;          // names of files, without folders, that are not there yet
};

}  // namespace youbot_base_sim
