#include "loads.h"

#include <fmt/format.h>

namespace youbot_base_sim {

namespace {

constexpr Named<bool> kPlacements[] = {{"moving", false}, {"at_rest", true}};
constexpr Named<bool> kFrames[] = {{"platform", false}, {"fixed", true}};

void read_stretch(SceneSection& s, LoadSchedule::Stretch& stretch) {
  s["start"].number(stretch.start, {0, 1e9, "s"});
  const SceneValue end = s["end"];
  end.number(stretch.end, {0, 1e9, "s"});
  if (stretch.end <= stretch.start) end.refuse(fmt::format("after start, {}", stretch.start));
}

void read_vector(const SceneValue& value, Eigen::Vector3d& vector, const Range& range) {
  Eigen::Array3d numbers = vector.array();
  value.numbers(numbers, range);
  vector = numbers.matrix();
}

LoadSchedule::PlannedLoad read_load(SceneSection s) {
  LoadSchedule::PlannedLoad planned;
  s.required("mass").number(planned.load.mass, kLoadMasses);
  read_vector(s.required("position"), planned.load.position, kLoadPositions);
  s["inertia"].number(planned.load.inertia, kLoadInertias);
  read_stretch(s, planned);
  s["placed"].choice(planned.at_rest, kPlacements);
  s.finish();
  return planned;
}

LoadSchedule::PlannedWrench read_wrench(SceneSection s) {
  LoadSchedule::PlannedWrench planned;
  const SceneValue force = s["force"], torque = s["torque"];
  read_vector(force, planned.wrench.force, kWrenchForces);
  read_vector(s["point"], planned.wrench.point, kLoadPositions);
  torque.number(planned.wrench.torque, kWrenchTorques);
  read_stretch(s, planned);
  s["frame"].choice(planned.wrench.fixed, kFrames);
  s.finish();
  if (!force.given() && !torque.given()) force.refuse("given where torque is not");
  return planned;
}

}  // namespace

LoadSchedule read_load_schedule(const SceneValue& loads, const SceneValue& wrenches) {
  LoadSchedule plan;
  if (loads.given()) {
    for (const SceneSection& section : loads.sections()) plan.loads.push_back(read_load(section));
  }
  if (wrenches.given()) {
    for (const SceneSection& section : wrenches.sections()) plan.wrenches.push_back(read_wrench(section));
  }
  return plan;
}

}  // namespace youbot_base_sim
