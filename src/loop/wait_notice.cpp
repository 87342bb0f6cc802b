#include "youbot_base_sim/loop/wait_notice.h"

namespace youbot_base_sim {

namespace {

constexpr auto kFirstLine = std::chrono::seconds(1);
constexpr auto kNextLine = std::chrono::seconds(10);
constexpr auto kDiagnostics = std::chrono::seconds(2);

}  // namespace

WaitNotice::Due WaitNotice::waits_for(const std::string& what) {
  const auto now = Clock::now();
  if (what_.empty()) console_due_ = now + kFirstLine, diagnostics_due_ = now + kDiagnostics;
  what_ = what;
  const Due due{now >= console_due_, now >= diagnostics_due_};
  if (due.console) console_due_ = now + kNextLine;
  if (due.diagnostics) diagnostics_due_ = now + kDiagnostics;
  return due;
}

}  // namespace youbot_base_sim
