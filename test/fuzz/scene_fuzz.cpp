// Scene files: each is refused in one line, or is a scene of finite numbers that can be simulated.

#include "../temporary_folder.h"
#include "fuzz.h"
#include "youbot_base_sim/scene/scene.h"

namespace youbot_base_sim {
namespace {

void require_finite_scene(const Scene& scene) {
  const RobotParameters& r = scene.robot;
  const FloorParameters& f = scene.floor;
  const SolverSettings& s = scene.solver;
  const std::vector<double> numbers = {scene.duration,
                                       scene.output_rate,
                                       r.m,
                                       r.m_1,
                                       r.I_s,
                                       r.J_1,
                                       r.J_2,
                                       r.a_X,
                                       r.a_Y,
                                       r.h,
                                       r.l,
                                       r.R,
                                       r.R_d,
                                       r.a_Z,
                                       r.q,
                                       f.slope,
                                       f.uphill,
                                       f.spin_radius,
                                       f.holding_speed,
                                       f.nu,
                                       f.g,
                                       f.mu_0(r)[0],
                                       s.relative_tolerance,
                                       s.absolute_tolerance,
                                       s.control_period};
  require_finite(numbers, "a number of the scene");
  require_finite(f.f, "friction");
  require_finite(r.mu_1, "wheel_damping");
  require_finite(r.mu_2, "roller_damping");
  require_finite(scene.initial.values, "the initial state");
}

}  // namespace
}  // namespace youbot_base_sim

using namespace youbot_base_sim;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const TemporaryFolder folder;
  static const std::string table = folder.write("table.csv", "t,fl,fr,bl,br\n0,1,2,3,4\n0.001,-1,0,1,2\n");
  const std::string path = folder.write("scene.yaml", {reinterpret_cast<const char*>(data), size});
  Scene scene;
  try {
    scene = load_scene(path);
  } catch (const SceneError& error) {
    require_one_line(error.what());
    return 0;
  }
  require_finite_scene(scene);
  scene.solver.method = "radau";  // the others may take what they need
  Simulation simulation(scene);
  require_bounded_motion(simulation);
  return 0;
}
