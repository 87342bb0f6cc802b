#pragma once

#include <string>
#include <vector>

#include "youbot_base_sim/record/output_file.h"
#include "youbot_base_sim/record/recorder.h"

namespace youbot_base_sim {

/// Rows of the motion: t, pose, velocities, phi, dphi, dgamma; SI units, heading unwrapped, wheels in the order fl, fr,
/// bl, br; numbers that read back to the same double.
class StateCsv : public Recorder {
 public:
  explicit StateCsv(OutputFile file);
  void write(double t, const Simulation& simulation, const Events& events) override;
  void commit() override { file_.commit(); }
  std::string keep_incomplete() override { return file_.keep_incomplete(); }

 private:
  OutputFile file_;
  std::string header_;  // until it is written, with the first row
};

/// Rows of roller switches: t (s), wheel (fl ...), roller_from, roller_to (0 .. n-1), phi (rad), direction (+1 or -1),
/// count (switches that a row stands for; more than 1 only for a wheel that passes several rollers between two looks).
/// Numbers read back to the same double.
class SwitchCsv : public Recorder {
 public:
  explicit SwitchCsv(OutputFile file);
  void write(double t, const Simulation& simulation, const Events& events) override;
  void commit() override { file_.commit(); }
  std::string keep_incomplete() override { return file_.keep_incomplete(); }

 private:
  OutputFile file_;
  std::string header_;
};

}  // namespace youbot_base_sim
