#include "youbot_base_sim/record/output_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/resource.h>

#include <charconv>
#include <random>
#include <system_error>

#include "youbot_base_sim/text/quote.h"

namespace youbot_base_sim {

namespace fs = std::filesystem;

namespace {

constexpr std::size_t kMark = 18;         // bytes of .incomplete-XXXXXX
constexpr std::size_t kBuffer = 1 << 16;  // bytes
constexpr int kMaxLinks = 40;             // as the kernel
constexpr std::size_t kMaxName = 255;     // bytes of a file's name

bool is_full(int error) { return error == ENOSPC || error == EFBIG || error == EDQUOT; }

[[noreturn]] void refuse(const std::string& path, const std::string& reason, int error = 0) {
  throw OutputError(fmt::format("{}: cannot be written: {}", quote_path(path), reason), error);
}

fs::path folder_of(const fs::path& path) { return path.has_parent_path() ? path.parent_path() : "."; }

/// N, if the path is /dev/fd/N by whatever name.
std::optional<int> own_descriptor(const fs::path& path) {
  std::error_code ignored;
  if (!fs::equivalent(folder_of(path), "/proc/self/fd", ignored)) return std::nullopt;
  const std::string name = path.filename();
  int number = 0;
  const auto [end, error] = std::from_chars(name.data(), name.data() + name.size(), number);
  if (error != std::errc() || end != name.data() + name.size()) return std::nullopt;
  return number;
}

/// Follows a name that may be a symbolic link, also to a file that is not there yet.
fs::path follow_links(const std::string& path) {
  fs::path target = path;
  std::error_code error;
  for (int links = 0; fs::is_symlink(target, error) && !own_descriptor(target); ++links) {
    if (links == kMaxLinks) refuse_output(path, ELOOP);
    target = target.parent_path() / fs::read_symlink(target, error);
    if (error) refuse(path, error.message());
  }
  return target;
}

/// Takes a name of its own for a file beside `target`. Returns its descriptor; negative, with errno, if there is none.
int create_beside(const fs::path& target, std::string& name) {
  std::random_device random;
  const std::string file = target.filename().string().substr(0, kMaxName - kMark);
  for (;;) {
    name = target.parent_path() / fmt::format("{}.incomplete-{:06x}", file, random() % 0x1000000);
    const int descriptor = open(name.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    if (descriptor >= 0 || errno != EEXIST) return descriptor;
  }
}

/// Returns 0 or an error number.
int sync(int descriptor) {
  return fsync(descriptor) == 0 || errno == EINVAL ? 0 : errno;  // not every file system can
}

int sync_folder(const fs::path& folder) {
  const Descriptor descriptor(open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (descriptor < 0) return errno == EACCES ? 0 : errno;  // a folder may be writable but not readable
  return sync(descriptor);
}

std::string identity_of(const struct stat& status) { return fmt::format("{}:{}", status.st_dev, status.st_ino); }

}  // namespace

bool OutputError::is_full() const { return youbot_base_sim::is_full(error_); }

void refuse_output(const std::string& path, int error) { refuse(path, OutputFile::text_of(error), error); }

OutputFile::Place OutputFile::place_of(const std::string& path) {
  if (path.empty()) throw OutputError("an output's name must not be empty");
  if (path == "-") throw OutputError("an output's name must not be -: standard output is /dev/stdout");
  Place place;
  place.target = follow_links(path);
  struct stat status {};
  if (stat(place.target.c_str(), &status) == 0) {
    place.existing = status;
  } else if (errno != ENOENT) {
    refuse_output(path, errno);
  }
  if (place.existing ? S_ISDIR(place.existing->st_mode) : !place.target.has_filename()) refuse_output(path, EISDIR);
  return place;
}

OutputFile::OutputFile(const std::string& path, Access access) : path_(path), place_(place_of(path)), access_(access) {
  straight_ = own_descriptor(place_.target) || (place_.existing && !S_ISREG(place_.existing->st_mode));
  straight_ ? open_straight() : open_beside();
}

void OutputFile::open_straight() {
  const std::optional<int> own = own_descriptor(place_.target);
  if (access_ == Access::kAnywhere &&
      (own || S_ISFIFO(place_.existing->st_mode) || S_ISSOCK(place_.existing->st_mode))) {
    refuse(path_, "must be a file rather than a pipe, since its beginning is written last");
  }
  // A copy of an own descriptor shares its position, where opening it once more would begin at 0 and overwrite.
  descriptor_ =
      Descriptor(own ? fcntl(*own, F_DUPFD_CLOEXEC, 0) : open(place_.target.c_str(), O_WRONLY | O_NOCTTY | O_CLOEXEC));
  if (descriptor_ < 0) refuse_output(path_, errno);
  if ((fcntl(descriptor_, F_GETFL) & O_ACCMODE) == O_RDONLY) refuse_output(path_, EBADF);
  name_ = place_.target;
}

void OutputFile::open_beside() {
  // Renaming ignores the mode of the file that it replaces.
  if (place_.existing && access(place_.target.c_str(), W_OK) != 0) refuse_output(path_, errno);
  descriptor_ = Descriptor(create_beside(place_.target, name_));
  if (descriptor_ < 0) {
    const int error = errno;
    refuse(path_, fmt::format("in its folder, {}: {}", quote_path(folder_of(place_.target).string()), text_of(error)),
           error);
  }
  // A file that will be private is private from the start.
  if (place_.existing) fchmod(descriptor_, (place_.existing->st_mode & 0777) | S_IRUSR | S_IWUSR);
}

OutputFile::~OutputFile() { keep_incomplete(); }

void OutputFile::write(std::string_view lines) {
  buffer_ += lines;
  if (!straight_ && buffer_.size() < kBuffer) return;
  if (const int error = flush()) fail(error);
}

int OutputFile::flush() {
  std::size_t done = 0;
  while (done < buffer_.size()) {
    const ssize_t n = ::write(descriptor_, buffer_.data() + done, buffer_.size() - done);
    // An interruption counts as a failure: a program that is interrupted while it waits for a pipe's reader must end.
    if (n < 0) {
      const int error = errno;
      buffer_.clear();
      return error;
    }
    const std::size_t line_end = std::string_view(buffer_).substr(done, static_cast<std::size_t>(n)).rfind('\n');
    if (line_end != std::string_view::npos) whole_ = written_ + static_cast<off_t>(line_end) + 1;
    written_ += n;
    done += static_cast<std::size_t>(n);
  }
  buffer_.clear();
  return 0;
}

int OutputFile::reserve(std::uint64_t size) {
  if (straight_) return 0;
  rlimit limit{};
  if (getrlimit(RLIMIT_FSIZE, &limit) == 0 && limit.rlim_cur < size) return EFBIG;
  if (fallocate(descriptor_, FALLOC_FL_KEEP_SIZE, 0, static_cast<off_t>(size)) == 0) return 0;
  return is_full(errno) ? errno : 0;  // not every file system can reserve
}

void OutputFile::commit() {
  int error = flush();
  if (error) fail(error);
  if (!straight_) {
    struct stat status {};
    if (fstat(descriptor_, &status) != 0 || ftruncate(descriptor_, status.st_size) != 0) fail(errno);  // see reserve
    if (place_.existing) {
      // For root, who may replace a file of others.
      if (fchown(descriptor_, place_.existing->st_uid, place_.existing->st_gid) != 0) errno = 0;
      if (fchmod(descriptor_, place_.existing->st_mode & 0777) != 0) fail(errno);
    }
  }
  if (sync_on_commit_) error = sync(descriptor_);
  const int closing = descriptor_.close();
  if (!error) error = closing;
  if (!error && !straight_ && rename(name_.c_str(), place_.target.c_str()) != 0) error = errno;
  if (!error && sync_on_commit_) error = sync_folder(folder_of(place_.target));
  if (error) fail(error);
}

std::string OutputFile::keep_incomplete() {
  if (descriptor_ >= 0) {
    flush();
    struct stat status {};
    if (!straight_ && fstat(descriptor_, &status) == 0) {
      const off_t end = access_ == Access::kInOrder ? whole_ : status.st_size;
      if (ftruncate(descriptor_, end) != 0) errno = 0;  // the last line may then be cut
      if (end == 0) unlink(name_.c_str());
    }
    descriptor_.close();
  }
  std::error_code ignored;
  return straight_ || !fs::exists(name_, ignored) ? "" : name_;
}

void OutputFile::fail(const std::string& reason, const std::string& state, int error) {
  const std::string kept = keep_incomplete();
  std::string text = fmt::format("{}: cannot be written: {}", quote_path(path_), reason);
  if (!kept.empty()) text += fmt::format("; what was written is kept as {}{}", quote_path(kept), state);
  throw OutputError(text, error);
}

std::string OutputFile::text_of(int error) {
  if (error == EINTR) return "interrupted while it waited for a reader";
  const std::string text = std::generic_category().message(error);
  return is_full(error) ? fmt::format("no space left for it ({})", text) : text;
}

std::string OutputFile::Place::identity() const {
  struct stat status {};
  if (!existing) {
    const bool found = stat(folder_of(target).c_str(), &status) == 0;  // else it cannot be opened
    return fmt::format("{}/{}", found ? identity_of(status) : folder_of(target).string(), target.filename().string());
  }
  const bool is_null =
      stat("/dev/null", &status) == 0 && S_ISCHR(existing->st_mode) && existing->st_rdev == status.st_rdev;
  return is_null ? "" : identity_of(*existing);
}

OutputOpener::OutputOpener(const std::vector<std::string>& inputs) {
  struct stat status {};
  for (const std::string& input : inputs) {
    if (stat(input.c_str(), &status) == 0) taken_[identity_of(status)] = "a file that is read";
  }
}

OutputFile OutputOpener::open(const std::string& option, const std::string& path, OutputFile::Access access) {
  take(option, path, OutputFile::place_of(path));
  return OutputFile(path, access);
}

void OutputOpener::keep(const std::string& option, const std::string& path) {
  const OutputFile::Place place = OutputFile::place_of(path);
  if (place.existing && !S_ISREG(place.existing->st_mode))
    throw OutputError(fmt::format("{} = {}: must be a regular file", option, quote_path(path)));
  take(option, path, place);
}

void OutputOpener::keep_all(const std::string& option, const std::string& folder,
                            const std::function<bool(const std::string& name)>& is_output) {
  std::error_code error;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error)) {
    if (is_output(entry->path().filename())) keep(option, entry->path());
  }
  if (error && error != std::errc::no_such_file_or_directory) refuse_output(folder, error.value());
  // Among the outputs that do not exist yet, only these may be reached by another name.
  for (const std::string& name : std::exchange(to_come_, {})) {
    const fs::path path = fs::path(folder) / name;
    if (is_output(name) && fs::symlink_status(path, error).type() == fs::file_type::not_found) keep(option, path);
  }
}

void OutputOpener::take(const std::string& option, const std::string& path, const OutputFile::Place& place) {
  const std::string identity = place.identity();
  const auto [taken, is_new] = taken_.emplace(identity, "the file of " + option);
  if (!is_new && !identity.empty())
    throw OutputError(fmt::format("{} = {}: must not be {}", option, quote_path(path), taken->second));
  if (!place.existing) to_come_.push_back(place.target.filename());
}

}  // namespace youbot_base_sim
