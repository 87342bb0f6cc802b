#include "stress_cells.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "youbot_base_sim/scene/scene.h"

namespace youbot_base_sim {

namespace {

constexpr char kBaseName[] = "case1";
constexpr std::uint64_t kSeed = 20200216;  // of the random torques
constexpr int kRandomRuns = 200;
constexpr double kRandomTorque = 2.0;                 // N m, at most
constexpr double kCircleSpeed = 2 * M_PI * 2.5 / 30;  // m/s: Case 1, a circle of radius 2.5 m in 30 s

std::string row(const Wheels& w) { return fmt::format("[{:.17g}, {:.17g}, {:.17g}, {:.17g}]", w[0], w[1], w[2], w[3]); }

// The parts of a scene that the cells vary; each a line of YAML or nothing.
struct Parts {
  double duration;
  std::string drive;
  std::string initial;
  std::string robot;
  std::string floor;
  std::string solver;
};

std::string yaml(const Parts& parts, double longest) {
  std::string text = fmt::format("model: coulomb\nduration: {:g}\n", std::min(parts.duration, longest));
  const auto add = [&text](const char* key, const std::string& value) {
    if (!value.empty()) text += fmt::format("{}: {{{}}}\n", key, value);
  };
  add("robot", parts.robot);
  add("floor", parts.floor);
  add("initial", parts.initial);
  add("solver", parts.solver);
  add("drive", parts.drive);
  return text;
}

// The first third of Case 1, which has all that the rest has.
Parts case1() {
  const std::string harmonics = fmt::format("period: 30, V_X: {{cos: {0:.17g}}}, V_Y: {{sin: {0:.17g}}}", kCircleSpeed);
  return {10,
          "reference_motion: {" + harmonics + "}",
          "pose: [2.5, 0, 1.5707963267948966], wheel_angles: [0.1, 0.1, 0.1, 0.1]",
          "",
          "",
          ""};
}

std::string held_torque(const Wheels& torque) {
  return fmt::format("torque: [{{start: 0, constant: {}}}]", row(torque));
}

// Torque far beyond what the floor can take (2.2 N m a wheel), in jumps and fast waves.
Parts violent() {
  const std::string drive =
      "torque: [{start: 0, constant: [10, -8, 6, -9]}, {start: 0.5, constant: [-10, 9, -7, 8]}, "
      "{start: 1, constant: [3, 3, -3, -3], cos: [20, -15, 10, 5], sin: [-5, 10, 15, -20], period: 0.05}, "
      "{start: 1.5, constant: [40, 40, 40, -40]}]";
  return {2, drive, "", "", "", ""};
}

// From rest under the torque of Case 2, which needs all four wheels.
const Wheels& case2_torque() {
  static const Wheels torque{-2.89804529810137, 2.7999194979003175, 2.2855040599920784, -2.383629860193131};
  return torque;
}

/// Torque profile of Case 1, times a factor: one harmonic for each wheel, since the motion is a translation.
std::string case1_torque(double factor) {
  const ReferenceMotion motion{30, {0, kCircleSpeed, 0}, {0, 0, kCircleSpeed}, {}};
  const ReferenceTorque torque(RobotParameters{}, motion);
  const Wheels constant = 0.5 * (torque.value(0) + torque.value(15));
  const Wheels cos = torque.value(0) - constant;
  const Wheels sin = torque.value(7.5) - constant;
  return fmt::format("torque: [{{start: 0, constant: {}, cos: {}, sin: {}, period: 30}}]", row(factor * constant),
                     row(factor * cos), row(factor * sin));
}

std::string twist(double V_X, double V_Y, double Omega) {
  return fmt::format("twist: [{:.17g}, {:.17g}, {:.17g}]", V_X, V_Y, Omega);
}

class Cells {
 public:
  explicit Cells(double longest) : longest_(longest) {}

  std::vector<StressCell> take() && { return std::move(cells_); }

  void group(const char* name) { group_ = name; }

  void add(const std::string& name, const Parts& parts, bool quick = false, const std::string& table = "") {
    cells_.push_back({group_, name, yaml(parts, longest_), table, quick});
  }

 private:
  double longest_;  // s
  std::string group_;
  std::vector<StressCell> cells_;
};

void add_floors(Cells& cells) {
  cells.group("nu");
  for (const auto& [motion, parts] : {std::pair{"case1", case1()}, std::pair{"violent", violent()}}) {
    for (int decade = -2; decade >= -9; --decade) {
      Parts varied = parts;
      varied.floor = fmt::format("slip_regularization: 1e{}", decade);
      cells.add(fmt::format("{}_1e{}", motion, decade), varied, decade == -6);
    }
  }
  cells.group("friction");
  for (const char* f : {"0", "0.1", "0.5", "1", "5"}) {
    Parts varied = case1();
    varied.floor = fmt::format("friction: {}", f);
    cells.add(f, varied, f[0] == '0' && !f[1]);
  }
}

void add_robots(Cells& cells) {
  cells.group("roller_inertia");
  for (int decade = -4; decade >= -12; --decade) {
    Parts varied = case1();
    varied.robot = fmt::format("roller_inertia: 1e{}", decade);
    cells.add(fmt::format("1e{}", decade), varied, decade == -12);
  }
  Parts massless = case1();
  massless.robot = "roller_inertia: 0";
  cells.add("0", massless, true);

  cells.group("wheel_inertia");
  Parts light = case1();
  light.robot = fmt::format("wheel_inertia: {:.17g}", 1e-3 * RobotParameters{}.J_1);
  cells.add("times_1e-3", light);

  cells.group("rollers");
  for (const int n : {3, 4, 5, 6, 8, 12, 24}) {
    Parts varied = case1();
    varied.robot = fmt::format("rollers_per_wheel: {}", n);
    cells.add(fmt::format("{}", n), varied, n == 3);
    // With few rollers the default axis lies so far out that they would end in a point before they meet.
    const double most = RobotParameters{}.R * std::cos(M_PI / n);
    if (RobotParameters{}.R_d <= most) continue;
    varied.robot += fmt::format(", roller_axis_radius: {:.17g}", 0.95 * most);
    cells.add(fmt::format("{}_that_meet", n), varied);
  }

  cells.group("locked_wheel");
  Parts locked{10, held_torque({0, 2, 2, 2}), "", "wheel_damping: [1e6, 0.11, 0.11, 0.11]", "", ""};
  cells.add("fl_from_rest", locked, true);
  locked = case1();
  locked.robot = "wheel_damping: [1e6, 0.11, 0.11, 0.11]";
  cells.add("fl_case1", locked);
}

void add_torques(Cells& cells) {
  cells.group("torque");
  for (const char* factor : {"0", "10", "1e3", "1e6"}) {
    Parts varied = case1();
    varied.drive = case1_torque(std::stod(factor));
    varied.initial += ", " + twist(kCircleSpeed, 0, 0);
    cells.add(fmt::format("case1_times_{}", factor), varied, factor[0] == '0');
  }
  cells.group("control_period");
  for (const char* period : {"1e-4", "1e-3", "1e-2", "1e-1"}) {
    Parts varied = case1();
    varied.solver = fmt::format("control_period: {}", period);
    cells.add(period, varied, period[3] == '3');
  }
  cells.group("preload");
  for (const int preload : {1, 2, 3, 10, 100}) {
    const Wheels torque = preload * Wheels{1, 1, -1, -1};
    cells.add(fmt::format("{}_N_m", preload), {10, held_torque(torque), "", "", "", ""}, preload == 1);
  }
}

// Torque of +-2 N m, the other way round every millisecond.
void add_reversals(Cells& cells) {
  cells.group("reversal");
  for (const auto& [name, signs] :
       {std::pair{"together", Wheels{1, 1, 1, 1}}, std::pair{"turning", Wheels{-1, 1, -1, 1}},
        std::pair{"preload", Wheels{1, 1, -1, -1}}}) {
    std::string table = "t,fl,fr,bl,br\n";
    for (int k = 0; k < 5000; ++k) {
      const Wheels torque = (k % 2 == 0 ? 2.0 : -2.0) * signs;
      table += fmt::format("{},{},{},{},{}\n", 1e-3 * k, torque[0], torque[1], torque[2], torque[3]);
    }
    const Parts parts{5, fmt::format("torque_table: reversal_{}.csv", name), "", "", "", "control_period: 1e-3"};
    cells.add(name, parts, signs[0] < 0, table);
  }
}

void add_starts(Cells& cells) {
  const std::string none = held_torque(Wheels::Zero());
  cells.group("spin");
  for (const int Omega : {1, 3, 10, 30, -30}) {
    cells.add(fmt::format("{}_rad_s", Omega), {10, none, twist(0, 0, Omega), "", "", ""}, Omega == 30);
  }
  cells.add("30_rad_s_and_1_m_s", {10, none, twist(0.8, 0.6, 30), "", "", ""});

  cells.group("rest");
  const std::string angles = "wheel_angles: [0.1, 0.1, 0.1, 0.1], ";
  cells.add("coast", {12, none, angles + twist(0.8, 0.6, 0), "", "", ""});
  cells.add("coast_and_stand_an_hour", {3612, none, angles + twist(0.8, 0.6, 0), "", "", ""}, true);
  cells.add("stand_an_hour", {3600, none, "", "", "", ""});

  cells.group("edge");
  const std::string edge = fmt::format("wheel_angles: {}", row(Wheels::Constant(M_PI / 6)));
  cells.add("rest", {5, none, edge, "", "", ""});
  cells.add("rest_pushed", {5, held_torque(case2_torque()), edge, "", "", ""}, true);
  cells.add("forward", {5, none, edge + ", " + twist(0.3, 0, 0), "", "", ""});
  cells.add("backward", {5, none, edge + ", " + twist(-0.3, 0, 0), "", "", ""});
  cells.add("sideways", {5, none, edge + ", " + twist(0, 0.3, 0), "", "", ""});
  // Wheels at rest on a turning base: some edges attract and some repel.
  for (const int Omega : {1, -1}) {
    const std::string turning = edge + ", wheel_rates: [0, 0, 0, 0], " + twist(0, 0, Omega);
    cells.add(fmt::format("wheels_at_rest_turning_{}", Omega), {5, none, turning, "", "", ""}, Omega == 1);
  }
}

void add_random(Cells& cells) {
  cells.group(kRandomGroup);
  std::mt19937_64 engine(kSeed);
  // The distributions of the standard library differ from one to the next; these 53 bits do not.
  const auto uniform = [&engine] { return static_cast<double>(engine() >> 11) * 0x1p-53; };
  for (int k = 0; k < kRandomRuns; ++k) {
    Wheels torque;
    for (int i = 0; i < kWheels; ++i) torque[i] = kRandomTorque * (2 * uniform() - 1);
    cells.add(fmt::format("{:03}", k), {10, held_torque(torque), "", "", "", ""}, k < 5);
  }
}

}  // namespace

StressCell base_cell(double longest) { return {"base", kBaseName, yaml(case1(), longest), "", true}; }

std::vector<StressCell> stress_cells(double longest) {
  Cells cells(longest);
  add_floors(cells);
  add_robots(cells);
  add_torques(cells);
  add_reversals(cells);
  add_starts(cells);
  add_random(cells);
  return std::move(cells).take();
}

}  // namespace youbot_base_sim
