#pragma once

#include <fcntl.h>
#include <gtest/gtest.h>
#include <stdlib.h>
#include <unistd.h>

#include <algorithm>
#include <string>
#include <vector>

namespace youbot_base_sim {

/// A terminal without a window, for a program that is to believe that somebody watches.
class Terminal {
 public:
  Terminal() : descriptor_(posix_openpt(O_RDWR | O_NOCTTY)) {
    EXPECT_EQ(grantpt(descriptor_), 0);
    EXPECT_EQ(unlockpt(descriptor_), 0);
  }
  ~Terminal() { close(descriptor_); }
  Terminal(const Terminal&) = delete;
  Terminal& operator=(const Terminal&) = delete;

  std::string path() const { return ptsname(descriptor_); }

  /// All that was written to it. To be called when nobody writes any longer.
  std::string text() const {
    std::string text;
    char buffer[4096];
    for (ssize_t n = 0; (n = read(descriptor_, buffer, sizeof buffer)) > 0;)
      text.append(buffer, static_cast<std::size_t>(n));
    return text;
  }

  /// What somebody sees who looks at a terminal on which this was written: its lines.
  static std::vector<std::string> lines(const std::string& text) {
    const std::string erase = "\033[K";
    std::vector<std::string> lines(1);
    std::size_t column = 0;
    for (std::size_t k = 0; k < text.size(); ++k) {
      if (text.compare(k, erase.size(), erase) == 0) {
        lines.back().resize(column);
        k += erase.size() - 1;
      } else if (text[k] == '\r') {
        column = 0;
      } else if (text[k] == '\n') {
        lines.emplace_back();
      } else {
        lines.back().resize(std::max(lines.back().size(), column + 1), ' ');
        lines.back()[column++] = text[k];
      }
    }
    return lines;
  }

 private:
  int descriptor_;
};

}  // namespace youbot_base_sim
