#pragma once

#include <atomic>
#include <functional>
#include <string>

namespace youbot_base_sim {

enum ExitStatus { kDone = 0, kNotCompleted = 1, kRefused = 2 };

/// Prints "PROGRAM: TEXT" on standard error. Ignores write errors: the exit status still reports the error.
void print_error(const std::string& program, const std::string& text);

/// The common part of the offline programs' main functions: `body` returns the exit status. An exception, and standard
/// output that takes no more, become a line on standard error, which begins with `name`, and kNotCompleted.
int run_offline_program(const char* name, const std::function<int()>& body);

/// A program in two parts: `prepare` reads command line and inputs, and returns whether there is anything to do. Its
/// std::runtime_error is a refusal: a line on standard error, and kRefused. `run` does the work, with signals caught.
int run_offline_program(const char* name, const std::function<bool()>& prepare, const std::function<int()>& run);

/// The text of the std::runtime_error that `prepare` throws; empty if it throws none.
std::string refusal_of(const std::function<void()>& prepare);

/// From here on the signals that ask a program to end set `stop_requested` and call `also`, and what cannot be written
/// is an error rather than a signal. A signal that is ignored, as by nohup, remains so.
void catch_signals(void (*also)() = nullptr);

const std::atomic<bool>& stop_requested();

/// "signal 15, Terminated"
std::string stop_reason();

}  // namespace youbot_base_sim
