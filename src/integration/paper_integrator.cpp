#include "make_slip_integrator.h"

namespace youbot_base_sim {

template std::unique_ptr<MotionIntegrator> make_slip_integrator<PaperFeatures>(Model model, const Parts& parts);

}  // namespace youbot_base_sim
