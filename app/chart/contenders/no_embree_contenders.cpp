#include "app/chart/contenders/contender.h"

namespace morphray::app {

std::vector<Contender> embree_contenders(const ChartScene&) { return {}; }

}  // namespace morphray::app
