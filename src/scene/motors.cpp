#include "motors.h"

namespace youbot_base_sim {

namespace {

struct Reader {
  SceneSection& section;

  void operator()(const char* name, double& number, const Range& range) const { section[name].number(number, range); }

  void operator()(const char* name, std::optional<double>& number, const Range& range) const {
    const SceneValue value = section[name];
    if (value.given()) value.number(number.emplace(), range);
  }

  void operator()(const char* name, std::optional<bool>& flag) const {
    const SceneValue value = section[name];
    if (value.given()) value.choice(flag.emplace(), kFlags);
  }
};

}  // namespace

MotorSettings read_motors(SceneSection section) {
  MotorSettings motors;
  visit_settings(motors, Reader{section});
  section.finish();
  return motors;
}

}  // namespace youbot_base_sim
