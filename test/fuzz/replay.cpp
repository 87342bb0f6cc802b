// Drives a fuzz target without libFuzzer: tries every file of a corpus and a number of mutations of them, the same each
// time. Usage: TARGET [RUNS] FILE_OR_FOLDER...

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <string>
#include <vector>

#include "fuzz.h"

namespace {

namespace fs = std::filesystem;

std::string read(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

/// The texts of all files, in the order of their names.
std::vector<std::string> read_corpus(const std::vector<fs::path>& paths) {
  std::vector<fs::path> files;
  for (const fs::path& path : paths) {
    if (!fs::is_directory(path)) {
      files.push_back(path);
    } else {
      const std::size_t before = files.size();
      for (const auto& entry : fs::directory_iterator(path)) files.push_back(entry.path());
      std::sort(files.begin() + static_cast<std::ptrdiff_t>(before), files.end());
    }
  }
  std::vector<std::string> corpus;
  for (const fs::path& file : files) corpus.push_back(read(file));
  return corpus;
}

/// Changes texts at random: bytes, numbers, and pieces of one another.
class Mutator {
 public:
  explicit Mutator(const std::vector<std::string>& corpus) : corpus_(corpus) {}

  std::string operator()() {
    std::string text = any(corpus_);
    for (std::size_t n = 1 + below(4); n > 0; --n) mutate(text);
    return text;
  }

 private:
  void mutate(std::string& text) {
    static const std::vector<std::string> kNumbers = {"0",   "-1",         "1e-300", "1e308", "-1e308", "1e-9",  "1e6",
                                                      "255", "4294967296", "nan",    ".inf",  "1e400",  "0x1p3", ""};
    const std::size_t at = below(text.size() + 1), length = std::min(below(16), text.size() - at);
    switch (below(6)) {
      case 0:
        text.insert(at, 1, static_cast<char>(below(256)));
        break;
      case 1:
        text.erase(at, length);
        break;
      case 2:
        text.insert(at, text.substr(at, length));
        break;
      case 3:
        if (at < text.size()) text[at] = static_cast<char>(below(256));
        break;
      case 4:
        replace_number(text, at, any(kNumbers));
        break;
      case 5:
        splice(text, at, any(corpus_));
        break;
    }
  }

  /// Replaces the first number after `at`.
  static void replace_number(std::string& text, std::size_t at, const std::string& number) {
    const std::size_t begin = std::min(text.find_first_of("0123456789", at), text.size());
    const std::size_t end = std::min(text.find_first_not_of("0123456789.e+-", begin), text.size());
    text.replace(begin, end - begin, number);
  }

  /// Puts lines of another text where the line after `at` begins.
  void splice(std::string& text, std::size_t at, const std::string& other) {
    const std::size_t line = std::min(text.find('\n', at), text.size());
    const std::size_t from = other.rfind('\n', below(other.size() + 1));
    if (from != std::string::npos) text.insert(line, other.substr(from, below(200)));
  }

  std::size_t below(std::size_t n) { return random_() % n; }
  const std::string& any(const std::vector<std::string>& texts) { return texts[below(texts.size())]; }

  const std::vector<std::string>& corpus_;
  std::mt19937_64 random_{1};
};

void run(const std::string& text) {
  LLVMFuzzerTestOneInput(reinterpret_cast<const std::uint8_t*>(text.data()), text.size());
}

}  // namespace

int main(int argc, char** argv) {
  std::vector<fs::path> paths(argv + 1, argv + argc);
  int runs = 0;
  if (!paths.empty() && paths[0].string().find_first_not_of("0123456789") == std::string::npos) {
    runs = std::stoi(paths[0]);
    paths.erase(paths.begin());
  }
  const std::vector<std::string> corpus = read_corpus(paths);
  if (corpus.empty()) {
    fmt::print(stderr, "usage: {} [RUNS] FILE_OR_FOLDER...\n", argv[0]);
    return 2;
  }
  // What ends the process is found here afterwards.
  const fs::path last = fs::absolute(fs::path(argv[0]).filename().string() + ".input");
  fmt::print("{} files and {} mutations; the one at work is in {}\n", corpus.size(), runs, last.string());
  std::fflush(stdout);
  Mutator mutate(corpus);
  for (std::size_t k = 0; k < corpus.size() + static_cast<std::size_t>(runs); ++k) {
    const std::string text = k < corpus.size() ? corpus[k] : mutate();
    std::ofstream(last, std::ios::binary) << text;
    run(text);
  }
  fs::remove(last);
}
