#include "youbot_base_sim/physics/parameters.h"

namespace youbot_base_sim {

Wheels normal_reactions(const RobotParameters& robot, const FloorParameters& floor) {
  // a_X / h loads the front wheels, a_Y / l the left ones.
  const Wheels forward{1, 1, -1, -1};
  const Wheels left{1, -1, 1, -1};
  return robot.m_1 * floor.g +
         robot.m * floor.g / 4 * (1 + forward * (robot.a_X / robot.h) + left * (robot.a_Y / robot.l));
}

}  // namespace youbot_base_sim
