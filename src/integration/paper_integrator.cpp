#include "make_slip_integrator.h"

namespace youbot_base_sim {

std::unique_ptr<MotionIntegrator> make_paper_integrator(Model model, const Parts& parts,
                                                        MakeGeneralMethod make_method) {
  return visit_law(model, [&](auto row) {
    return make_slip_integrator<PaperModel<typename decltype(row)::Law>>(parts, make_method);
  });
}

}  // namespace youbot_base_sim
