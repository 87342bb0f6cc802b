#include "make_slip_integrator.h"

template std::unique_ptr<youbot_base_sim::MotionIntegrator>
youbot_base_sim::make_slip_integrator<youbot_base_sim::ExtendedFeatures>(const MotionStart&);
