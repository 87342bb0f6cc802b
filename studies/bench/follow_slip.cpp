// How far SlipOdometry comes in windows of so many readings of identify_tables' table: x, y (m) and heading (rad) in
// the frame where each begins, and their covariance, a line each. Usage: follow_slip SCENE TABLE efforts|none READINGS
// WHEEL_ERROR|0 [AT_ZERO x 4]. See scripts/study odometry_twin.

#include <fmt/format.h>

#include <cstdlib>

#include "youbot_base_sim/identify/drive_table.h"
#include "youbot_base_sim/slip_odometry/slip_odometry.h"

int main(int argc, char** argv) {
  using namespace youbot_base_sim;
  if (argc != 6 && argc != 10) return 2;
  const DriveRecord record = read_drive_table(argv[2], argv[2]);
  const std::size_t readings = std::strtoul(argv[4], nullptr, 10);
  SlipOdometry::Settings settings;
  if (const double error = std::atof(argv[5]); error > 0) settings.wheel_error = error;
  if (argc == 10)
    settings.angles_at_zero = Wheels(std::atof(argv[6]), std::atof(argv[7]), std::atof(argv[8]), std::atof(argv[9]));
  SlipOdometry odometry(load_scene(argv[1]), settings);
  const bool efforts = argv[3] == std::string("efforts");
  for (std::size_t k = 0; k < record.t.size(); ++k) {
    odometry.update(record.t[k], record.phi[k], efforts ? std::optional<Wheels>(record.torque[k]) : std::nullopt,
                    record.dphi[k]);
    if (k % readings != 0) continue;
    if (k > 0)
      fmt::print("{:.9g} {:.9g}\n", fmt::join(odometry.pose(), " "),
                 fmt::join(odometry.pose_covariance().reshaped(), " "));
    odometry.reset();
  }
}
