// Poses of SlipOdometry along a table of identify_tables, x, y (m) and heading (rad) a line; then the processor time,
// s. Usage: follow_slip SCENE TABLE rates|angles efforts|none [AT_ZERO x 4]. See scripts/study odometry_twin.

#include <fmt/format.h>

#include <cstdlib>
#include <ctime>

#include "youbot_base_sim/identify/drive_table.h"
#include "youbot_base_sim/slip_odometry/slip_odometry.h"

int main(int argc, char** argv) {
  using namespace youbot_base_sim;
  if (argc != 5 && argc != 9) return 2;
  const DriveRecord record = read_drive_table(argv[2], argv[2]);
  SlipOdometry::Settings settings;
  if (argc == 9)
    settings.angles_at_zero = Wheels(std::atof(argv[5]), std::atof(argv[6]), std::atof(argv[7]), std::atof(argv[8]));
  SlipOdometry odometry(load_scene(argv[1]), settings);
  const bool rates = argv[3] == std::string("rates"), efforts = argv[4] == std::string("efforts");
  for (std::size_t k = 0; k < record.t.size(); ++k) {
    odometry.update(record.t[k], record.phi[k], efforts ? std::optional<Wheels>(record.torque[k]) : std::nullopt,
                    rates ? std::optional<Wheels>(record.dphi[k]) : std::nullopt);
    fmt::print("{:.9f}\n", fmt::join(odometry.pose(), " "));
  }
  fmt::print("{}\n", static_cast<double>(std::clock()) / CLOCKS_PER_SEC);
}
