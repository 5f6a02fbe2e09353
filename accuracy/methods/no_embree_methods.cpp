#include "accuracy/methods/method.h"

namespace morphray::accuracy {

std::vector<Contender> embree_contenders(const ChartScene&) { return {}; }

}  // namespace morphray::accuracy
