#pragma once

#include <vector>

#include "youbot_base_sim/identify/drive_record.h"
#include "youbot_base_sim/identify/forward_model.h"
#include "youbot_base_sim/scene/scene.h"

namespace youbot_base_sim {

/// Improves the angles (rad) at which the wheels of each record stood at first, `phi`: where ripples come as the
/// candidate's do. They are known but for whole rollers, and only of wheels whose rates ripple.
void find_angles(const Scene& candidate, const std::vector<DriveRecord>& records, const Workers& workers,
                 std::vector<Wheels>& phi);

/// Sets the candidate's command delay to what fits the wheels' rates best, by a parabola through the best of seven from
/// `first` on, `step` (s) apart, and its neighbours. Returns the remaining cost (dimensionless).
double find_delay(Scene& candidate, const std::vector<DriveRecord>& records, const std::vector<Wheels>& phi,
                  const Workers& workers, double first, double step);

/// The record with its commands as a driver applies them that acts once a cycle, in which it also reads the joints, as
/// the youBot's does: a command waits for the next sample, and the last one before it counts.
DriveRecord applied_in_cycles(DriveRecord record);

}  // namespace youbot_base_sim
