#include "youbot_base_sim/sweep/journal.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <unistd.h>

#include <boost/crc.hpp>
#include <cerrno>
#include <charconv>
#include <filesystem>
#include <fstream>
#include <map>
#include <optional>

#include "youbot_base_sim/record/output_file.h"
#include "youbot_base_sim/text/quote.h"

namespace youbot_base_sim {

namespace {

constexpr char kFirstLine[] = "rows of a sweep under way; sweep goes on with it";
constexpr std::size_t kChecksum = 8;  // characters

std::string checksum(std::string_view text) {
  boost::crc_32_type crc;
  crc.process_bytes(text.data(), text.size());
  return fmt::format("{:08x}", crc.checksum());
}

/// The row in a line; empty if the line is damaged.
std::optional<Row> row_of(std::string_view line) {
  constexpr std::size_t kText = kChecksum + 3;  // after "checksum s "
  if (line.size() <= kText || checksum(line.substr(kChecksum + 1)) != line.substr(0, kChecksum)) return std::nullopt;
  Row row{0, static_cast<RunStatus>(line[kChecksum + 1]), std::string(line.substr(kText))};
  std::from_chars(row.text.data(), row.text.data() + row.text.size(), row.run);
  return row;
}

[[noreturn]] void refuse_reading(const std::string& path) {
  throw OutputError(fmt::format("{}: cannot be read: {}", quote_path(path), OutputFile::text_of(errno)));
}

/// The file of a descriptor, named `path`, from byte `begin` on, with a position of its own.
std::ifstream open_at(const std::string& path, int descriptor, off_t begin) {
  std::ifstream file(fmt::format("/proc/self/fd/{}", descriptor), std::ios::binary);
  if (!file.seekg(begin)) refuse_reading(path);
  return file;
}

/// The next whole line; none at the end or in a torn line. Throws OutputError for a read error, which is no end.
std::optional<std::string> next_line(const std::string& path, std::ifstream& file) {
  std::string line;
  std::getline(file, line);
  if (file.bad()) refuse_reading(path);
  return file.good() ? std::optional(line) : std::nullopt;
}

/// Deletes the file and any links on the way to it. Returns the system's error number, 0 for none.
int delete_file(const std::string& path) {
  std::error_code error;
  if (std::filesystem::is_symlink(path, error)) {
    std::filesystem::path next = std::filesystem::read_symlink(path, error);
    if (error) return error.value();
    next = std::filesystem::path(path).parent_path() / next;
    if (const int failed = delete_file(next)) return failed;
  }
  return unlink(path.c_str()) == 0 ? 0 : errno;
}

}  // namespace

void FinishedRuns::insert(std::uint64_t run) {
  ahead_.insert(run);
  while (ahead_.erase(first_open_) > 0) ++first_open_;
}

void Tally::add(RunStatus status) {
  ++runs;
  doubtful += status == RunStatus::kDoubtful;
  refused += status == RunStatus::kRefused;
  failed += status == RunStatus::kFailed;
}

Journal::Journal(const std::string& path, const std::vector<std::string>& head, const RunRange& runs)
    : path_(path),
      runs_(runs),
      descriptor_(open(path.c_str(), O_RDWR | O_APPEND | O_CREAT | O_CLOEXEC, 0666)),
      finished_(runs.begin) {
  if (descriptor_ < 0) refuse_output(path, errno);
  if (flock(descriptor_, LOCK_EX | LOCK_NB) != 0)
    throw OutputError(fmt::format("{}: is being written by another sweep", quote_path(path)));
  const std::string whole = fmt::format("{}\n{}\n\n", kFirstLine, fmt::join(head, "\n"));
  begin_ = static_cast<off_t>(whole.size());
  std::string found(whole.size(), '\0');
  const ssize_t size = pread(descriptor_, found.data(), found.size(), 0);
  if (size < 0) refuse_reading(path_);
  found.resize(static_cast<std::size_t>(size));
  if (found.size() < whole.size() && whole.compare(0, found.size(), found) == 0) {
    if (ftruncate(descriptor_, 0) != 0) refuse_output(path_, errno);  // its beginning was torn
    write(whole);
  } else {
    check_head(head);
    read_rows();
  }
}

void Journal::write(const std::string& text) {
  errno = ENOSPC;  // unless the system says another reason
  const ssize_t size = ::write(descriptor_, text.data(), text.size());
  if (size != static_cast<ssize_t>(text.size())) {
    const int error = errno;
    if (ftruncate(descriptor_, end_) != 0) errno = 0;  // a torn line is dropped when the sweep continues
    if (end_ == 0) delete_file(path_);
    refuse_output(path_, error);
  }
  end_ += size;
}

void Journal::check_head(const std::vector<std::string>& head) const {
  const auto refuse = [&](const std::string& what) {
    throw OutputError(
        fmt::format("{}: {}; must be the journal of this sweep: go on as it began, or delete it to begin anew",
                    quote_path(path_), what));
  };
  std::ifstream file = open_at(path_, descriptor_, 0);
  if (next_line(path_, file) != kFirstLine) refuse("is no journal of a sweep");
  for (const std::string& expected : head) {
    if (next_line(path_, file) != expected) refuse("was begun with another " + expected.substr(expected.find(' ') + 1));
  }
  if (next_line(path_, file) != "") refuse("was begun with more files");
}

void Journal::read_rows() {
  end_ = begin_;
  std::ifstream file = open_at(path_, descriptor_, begin_);
  while (const std::optional<std::string> line = next_line(path_, file)) {
    const std::optional<Row> row = row_of(*line);
    if (row && runs_.contains(row->run) && !finished_.contains(row->run)) {
      if (!finished_.has_room_for(row->run)) break;
      finished_.insert(row->run);
      tally_.add(row->status);
    }
    end_ += static_cast<off_t>(line->size()) + 1;
  }
  if (ftruncate(descriptor_, end_) != 0) refuse_output(path_, errno);
}

void Journal::append(const Row& row) {
  const std::string text = fmt::format("{} {}", static_cast<char>(row.status), row.text);
  write(fmt::format("{} {}\n", checksum(text), text));
  finished_.insert(row.run);
  tally_.add(row.status);
}

void Journal::sync() {
  if (fdatasync(descriptor_) == 0 || errno == EINVAL) return;  // not every file system can
  refuse_output(path_, errno);
}

void Journal::for_each_row(const std::function<void(const Row&)>& take) const {
  std::ifstream file = open_at(path_, descriptor_, begin_);
  std::map<std::uint64_t, Row> ahead;  // less than FinishedRuns::kWindow
  std::uint64_t next = runs_.begin;
  while (const std::optional<std::string> line = next_line(path_, file)) {
    const std::optional<Row> row = row_of(*line);
    if (!row || row->run < next) continue;  // damaged, see the constructor
    ahead.emplace(row->run, *row);
    for (; !ahead.empty() && ahead.begin()->first == next; ++next) take(ahead.extract(ahead.begin()).mapped());
  }
  if (next - runs_.begin != tally_.runs)
    throw OutputError(fmt::format("{}: was damaged while it was written", quote_path(path_)));
}

void Journal::remove() {
  if (const int error = delete_file(path_))
    throw OutputError(fmt::format("{}: cannot be deleted: {}", quote_path(path_), OutputFile::text_of(error)));
}

}  // namespace youbot_base_sim
