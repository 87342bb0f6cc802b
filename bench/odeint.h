#pragma once

#include "run.h"

namespace youbot_base_sim {
namespace bench {

Run run_rosenbrock4(const Task& task);
Run run_rosenbrock4_as_shipped(const Task& task);
Run run_implicit_euler(const Task& task);
Run run_dopri5(const Task& task);
Run run_runge_kutta4(const Task& task);

}  // namespace bench
}  // namespace youbot_base_sim
