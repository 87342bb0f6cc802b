#pragma once

#include <string>

#include "youbot_base_sim/record/atomic_file.h"
#include "youbot_base_sim/record/recorder.h"

namespace youbot_base_sim {

/// Rows of the motion: t, pose, velocities, phi, dphi, dgamma; SI units, heading unwrapped, wheels in the order fl, fr,
/// bl, br; numbers that read back to the same double.
class StateCsv : public Recorder {
 public:
  explicit StateCsv(const std::string& path);
  void write(double t, const Simulation& simulation, const std::vector<RollerSwitch>& switches) override;
  void commit() override { file_.commit(); }

 private:
  AtomicFile file_;
};

/// Rows of roller switches: t (s), wheel (fl ...), roller_from, roller_to (0 .. n-1), phi (rad), direction (+1 or -1),
/// count (switches that a row stands for; more than 1 only for a wheel that passes several rollers between two looks).
/// Numbers read back to the same double.
class SwitchCsv : public Recorder {
 public:
  explicit SwitchCsv(const std::string& path);
  void write(double t, const Simulation& simulation, const std::vector<RollerSwitch>& switches) override;
  void commit() override { file_.commit(); }

 private:
  AtomicFile file_;
};

}  // namespace youbot_base_sim
