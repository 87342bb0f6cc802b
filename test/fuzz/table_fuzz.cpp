// Tables of torques and of velocities: each is refused in one line, or has increasing times and finite numbers and
// drives the base.

#include "../temporary_folder.h"
#include "fuzz.h"
#include "youbot_base_sim/scene/scene.h"

using namespace youbot_base_sim;

namespace {

void require_ordered(const WheelTable& table) {
  require(!table.t.empty(), "a table has rows");
  require(table.t.size() == table.values.size(), "a row has a time and values");
  require_finite(table.t, "a time");
  for (const Wheels& row : table.values) require_finite(row, "a value");
  for (std::size_t k = 1; k < table.t.size(); ++k) require(table.t[k - 1] < table.t[k], "times increase");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const TemporaryFolder folder;
  static const std::string torques = folder.write("torques.yaml", "{duration: 1, drive: {torque_table: table.csv}}");
  static const std::string rates = folder.write("rates.yaml", "{duration: 1, drive: {velocity_table: table.csv}}");
  static const std::string angles =
      folder.write("angles.yaml", "{duration: 1, drive: {wheel_angle_table: table.csv, resolution: 0.001}}");
  folder.write("table.csv", {reinterpret_cast<const char*>(data), size});
  Scene scene;
  try {
    scene = load_scene(torques);
  } catch (const SceneError& error) {
    require_one_line(error.what());
    return 0;
  }
  require_ordered(std::get<WheelTable>(scene.drive));
  Simulation torque_driven(scene);
  require_bounded_motion(torque_driven);
  scene = load_scene(rates);  // what is a table of torques is one of rates
  Simulation rate_driven(scene);
  require_bounded_motion(rate_driven);
  try {
    scene = load_scene(angles);
  } catch (const SceneError& error) {  // of rows that no wheel could follow
    require_one_line(error.what());
    return 0;
  }
  Simulation prescribed(scene);
  require_bounded_motion(prescribed);
  return 0;
}
