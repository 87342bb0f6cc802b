#include "youbot_base_sim/text/progress_bar.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>

namespace youbot_base_sim {

ProgressBar::ProgressBar(bool quiet) : shown_(!quiet && isatty(STDERR_FILENO)) {}

void ProgressBar::draw(double share, const std::string& text) {
  if (!shown_) return;
  constexpr int kWidth = 40;
  const auto filled = static_cast<std::size_t>(kWidth * std::clamp(share, 0.0, 1.0));
  // Erased behind, for the text before may have been longer.
  std::fputs(fmt::format("\r[{:<{}}] {}\033[K", std::string(filled, '#'), kWidth, text).c_str(), stderr);
  std::fflush(stderr);
  next_ = Clock::now() + std::chrono::milliseconds(100);
  drawn_ = true;
}

void ProgressBar::clear() {
  if (drawn_) std::fputs("\r\033[K", stderr);
  drawn_ = false;
}

}  // namespace youbot_base_sim
