#include "integrate.h"

namespace youbot_base_sim {

std::unique_ptr<Integration> integrate_paper(Model model, const Parts& parts, MakeGeneralMethod make_method) {
  return visit_law(model,
                   [&](auto row) { return integrate<PaperModel<typename decltype(row)::Law>>(parts, make_method); });
}

}  // namespace youbot_base_sim
