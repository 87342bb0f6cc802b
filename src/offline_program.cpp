#include "youbot_base_sim/offline_program.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <stdexcept>

#include "youbot_base_sim/record/output_file.h"

namespace youbot_base_sim {

namespace {

std::atomic<bool> stop{false};
std::atomic<int> stop_signal{0};
void (*on_stop)() = nullptr;

/// Opens closed standard streams, lest an output get the number of one; for reading, so that writing to one fails.
void take_standard_streams() {
  int descriptor = 0;
  while (descriptor >= 0 && descriptor <= STDERR_FILENO) descriptor = open("/dev/null", O_RDONLY | O_CLOEXEC);
  close(descriptor);
}

}  // namespace

void print_error(const std::string& program, const std::string& text) {
  std::fputs((program + ": " + text + "\n").c_str(), stderr);
}

int run_offline_program(const char* name, const std::function<int()>& body) {
  take_standard_streams();
  int status = kNotCompleted;
  try {
    status = body();
  } catch (const std::exception& error) {
    print_error(name, error.what());
  }
  if (std::fflush(stdout) == 0 && std::ferror(stdout) == 0) return status;  // an earlier write may have failed
  if (status == kDone) print_error(name, "standard output: cannot be written: " + OutputFile::text_of(errno));
  return std::max<int>(status, kNotCompleted);
}

int run_offline_program(const char* name, const std::function<bool()>& prepare, const std::function<int()>& run) {
  return run_offline_program(name, [&]() -> int {
    bool ready = false;
    const std::string refusal = refusal_of([&] { ready = prepare(); });
    if (!refusal.empty()) print_error(name, refusal);
    if (!ready) return refusal.empty() ? kDone : kRefused;
    catch_signals();
    return run();
  });
}

std::string refusal_of(const std::function<void()>& prepare) {
  try {
    prepare();
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  return "";
}

// They may come more than once: `timeout` sends two.
void catch_signals(void (*also)()) {
  on_stop = also;
  for (const int number : {SIGINT, SIGTERM, SIGHUP}) {
    struct sigaction action {};
    sigaction(number, nullptr, &action);
    if (action.sa_handler == SIG_IGN) continue;
    action.sa_handler = [](int caught) {
      stop_signal = caught;
      stop = true;
      if (on_stop) on_stop();
    };
    action.sa_flags = 0;  // waiting for a pipe's reader then ends too
    sigaction(number, &action, nullptr);
  }
  signal(SIGPIPE, SIG_IGN);
  signal(SIGXFSZ, SIG_IGN);
}

const std::atomic<bool>& stop_requested() { return stop; }

std::string stop_reason() { return fmt::format("signal {}, {}", stop_signal.load(), strsignal(stop_signal)); }

}  // namespace youbot_base_sim
